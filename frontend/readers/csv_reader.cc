#include "frontend/readers/csv_reader.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "frontend/readers/text.h"
#include "frontend/readers/whole_file.h"

namespace camgyro {
namespace {

constexpr size_t kPieceBytes = 1 << 20;

void Split(std::string_view text, char separator, std::vector<std::string_view>* cells) {
  cells->clear();
  for (size_t begin = 0;;) {
    const size_t comma = text.find(separator, begin);
    cells->push_back(Trim(text.substr(begin, comma - begin)));
    if (comma == std::string_view::npos) return;
    begin = comma + 1;
  }
}

bool IsNumber(std::string_view cell) {
  double value;
  return ParseNumber(cell, &value);
}

}  // namespace

CsvReader::CsvReader(const std::string& file) : file_(file) {
  status_ = CheckIsFile(file);
  if (!status_) return;
  stream_.open(file, std::ios::binary);
  if (!stream_) {
    status_ = BadInput(Concat(file_, ": cannot be opened for reading"));
    return;
  }
  FindLineEnd();
  if (content_.compare(0, 3, "\xEF\xBB\xBF") == 0) position_ = 3;
}

CsvReader::CsvReader(const std::string& file, std::vector<std::string> columns,
                     std::vector<size_t> widths)
    : CsvReader(file) {
  columns_ = std::move(columns);
  widths_ = std::move(widths);
  const size_t begin = position_;
  std::string_view text;
  if (!NextLine(&text)) return;
  const bool marked = text.front() == '#';
  if (marked) text.remove_prefix(1);
  Split(text, separator_, &cells_);
  if (marked || std::none_of(cells_.begin(), cells_.end(), IsNumber)) {
    header_.assign(cells_.begin(), cells_.end());
  } else {
    position_ = begin;
    line_ = 0;
  }
}

CsvReader CsvReader::ByName(const std::string& file, int skip_lines) {
  CsvReader csv(file);
  for (size_t end = 0; csv.line_ < skip_lines; ++csv.line_) {
    end = csv.FindLineEnd();
    if (csv.position_ >= csv.content_.size()) break;
    csv.position_ = end + 1;
  }
  csv.FindHeader();
  if (csv.header_.empty()) {
    if (csv.status_) csv.status_ = BadInput(Concat(file, ": expected a header of column names"));
    return csv;
  }
  csv.columns_ = csv.header_;
  csv.widths_ = {csv.header_.size()};
  return csv;
}

void CsvReader::FindHeader() {
  std::string_view text;
  for (;;) {
    const size_t begin = position_;
    const int line = line_;
    if (!NextLine(&text)) break;
    const bool marked = text.front() == '#';
    if (marked) text.remove_prefix(1);
    Split(text, separator_, &cells_);
    const bool numbers = std::any_of(cells_.begin(), cells_.end(), IsNumber);
    if (marked || !numbers) header_.assign(cells_.begin(), cells_.end());
    if (marked) continue;
    if (numbers) {
      position_ = begin;
      line_ = line;
    }
    break;
  }
}

CsvReader CsvReader::Described(const std::string& file, char separator) {
  CsvReader csv(file);
  csv.separator_ = separator;
  csv.FindHeader();
  size_t width = csv.NextWidth();
  if (width == 0) width = csv.header_.size();
  if (csv.header_.size() != width) csv.header_.clear();  // a remark
  csv.columns_ = csv.header_;
  while (csv.columns_.size() < width) {
    csv.columns_.push_back("column " + std::to_string(csv.columns_.size() + 1));
  }
  csv.widths_ = {width};
  return csv;
}

size_t CsvReader::NamedOrNumbered(const std::string& name) {
  size_t number = 0;
  if (!HasColumn(name) && ParseNumber(std::string_view(name), &number)) {
    if (number >= 1 && number <= columns_.size()) return number - 1;
    if (status_) {
      status_ = BadInput(Concat(file_, ": has ", columns_.size(), " columns, no number ", name));
    }
    return 0;
  }
  return Column({name});
}

size_t CsvReader::Column(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const auto found = std::find(header_.begin(), header_.end(), name);
    if (found != header_.end()) return static_cast<size_t>(found - header_.begin());
  }
  if (status_) {
    std::string found, expected;
    for (const std::string& name : header_) found += (found.empty() ? "" : ",") + name;
    for (const std::string& name : names) expected += (expected.empty() ? "" : " or ") + name;
    status_ = BadInput(Concat(file_, ": the header is ", found, ", expected a column ", expected));
  }
  return 0;
}

bool CsvReader::HasColumn(const std::string& name) const {
  return std::find(header_.begin(), header_.end(), name) != header_.end();
}

size_t CsvReader::FindLineEnd() {
  for (size_t searched = position_;;) {
    const size_t end = content_.find('\n', searched);
    if (end != std::string::npos) return end;
    searched = content_.size();
    if (!stream_.good()) return searched;
    content_.resize(searched + kPieceBytes);
    stream_.read(&content_[searched], kPieceBytes);
    content_.resize(searched + static_cast<size_t>(stream_.gcount()));
    // After an error the rest is not there, and what is there is no result.
    if (stream_.bad() && status_) status_ = BadInput(Concat(file_, ": cannot be read"));
  }
}

bool CsvReader::NextLine(std::string_view* text) {
  for (;;) {
    const size_t end = FindLineEnd();
    if (position_ >= content_.size()) return false;
    *text = Trim(std::string_view(content_).substr(position_, end - position_));
    position_ = end + 1;
    ++line_;
    if (!text->empty()) return true;
  }
}

size_t CsvReader::NextWidth() {
  const size_t position = position_;
  const int line = line_;
  std::string_view text;
  size_t next_width = 0;
  while (status_ && next_width == 0 && NextLine(&text)) {
    if (text.front() == '#') continue;
    next_width = static_cast<size_t>(std::count(text.begin(), text.end(), separator_)) + 1;
  }
  position_ = position;
  line_ = line;
  return next_width;
}

bool CsvReader::NextRow() {
  if (position_ > kPieceBytes) {  // what was handed out goes
    content_.erase(0, position_);
    position_ = 0;
  }
  std::string_view text;
  do {
    if (!status_ || !NextLine(&text) || !status_) return false;
  } while (text.front() == '#');
  row_ = text;
  Split(row_, separator_, &cells_);

  if (file_width_ == 0 && std::count(widths_.begin(), widths_.end(), width()) > 0) {
    file_width_ = width();
  }
  if (width() == file_width_) return true;
  std::string expected;
  for (const size_t allowed : widths_) {
    if (file_width_ != 0 && allowed != file_width_) continue;
    expected += Concat(expected.empty() ? "" : " or ", allowed, " (");
    for (size_t i = 0; i < allowed; ++i) expected += (i ? "," : "") + columns_[i];
    expected += ")";
  }
  Fail(Concat("this row has ", width(), width() == 1 ? " column" : " columns", ", expected ",
              expected));
  return false;
}

int64_t CsvReader::Integer(size_t column, const char* expected) {
  int64_t value = 0;
  if (!ParseNumber(cells_[column], &value)) FailCell(column, expected);
  return value;
}

int64_t CsvReader::Time(size_t column, double unit_s, int64_t offset_ns) {
  constexpr double kLargestNs = 9.2e18;  // of int64_t, 292 years
  const double unit_ns = unit_s * 1e9, whole_ns = std::round(unit_ns);
  int64_t whole = 0, stamp_ns = 0;
  if (whole_ns == 1.0) {
    stamp_ns = Stamp(column);
  } else {
    const double value = Number(column);
    if (!(std::abs(value) * unit_ns < kLargestNs)) {
      FailCell(column, "a time below 292 years");
      return 0;
    }
    const bool is_whole = std::abs(unit_ns - whole_ns) < 1e-9 * unit_ns;
    stamp_ns = is_whole && ParseNumber(cells_[column], &whole)
                   ? whole * static_cast<int64_t>(whole_ns)
                   : std::llround(value * unit_ns);
  }
  if (!__builtin_add_overflow(stamp_ns, offset_ns, &stamp_ns)) return stamp_ns;
  FailCell(column, "a time below 292 years");
  return 0;
}

double CsvReader::Number(size_t column) {
  double value = 0.0;
  if (!ParseNumber(cells_[column], &value) || !std::isfinite(value)) {
    FailCell(column, "a finite number");
    return 0.0;
  }
  return value;
}

void CsvReader::FailCell(size_t column, const std::string& expected) {
  const std::string found =
      cells_[column].empty() ? "the cell is empty" : Concat("'", cells_[column], "' was found");
  Fail(Concat("column ", column + 1, ", ", columns_[column], ": ", found, ", expected ", expected));
}

void CsvReader::Fail(const std::string& message) {
  if (status_) status_ = BadInput(Concat(file_, ":", line_, ": ", message));
}

}  // namespace camgyro
