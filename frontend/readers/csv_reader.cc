#include "frontend/readers/csv_reader.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

#include "frontend/readers/text.h"

namespace camgyro {
namespace {

void Split(std::string_view text, std::vector<std::string_view>* cells) {
  cells->clear();
  for (size_t begin = 0;;) {
    const size_t comma = text.find(',', begin);
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

CsvReader::CsvReader(const std::string& file, std::vector<std::string> columns,
                     std::vector<size_t> widths)
    : file_(file), columns_(std::move(columns)), widths_(std::move(widths)) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    status_ = BadInput(Concat(file, ": cannot be opened for reading"));
    return;
  }
  content_.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  if (content_.compare(0, 3, "\xEF\xBB\xBF") == 0) position_ = 3;

  const size_t begin = position_;
  std::string_view text;
  if (!NextLine(&text)) return;
  const bool marked = text.front() == '#';
  if (marked) text.remove_prefix(1);
  Split(text, &cells_);
  if (marked || std::none_of(cells_.begin(), cells_.end(), IsNumber)) {
    header_.assign(cells_.begin(), cells_.end());
  } else {
    position_ = begin;
    line_ = 0;
  }
}

bool CsvReader::NextLine(std::string_view* text) {
  while (position_ < content_.size()) {
    const size_t end = std::min(content_.find('\n', position_), content_.size());
    *text = Trim(std::string_view(content_).substr(position_, end - position_));
    position_ = end + 1;
    ++line_;
    if (!text->empty()) return true;
  }
  return false;
}

bool CsvReader::NextRow() {
  std::string_view text;
  do {
    if (!status_ || !NextLine(&text)) return false;
  } while (text.front() == '#');
  Split(text, &cells_);

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
