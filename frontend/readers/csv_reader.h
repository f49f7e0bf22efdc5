// Rows of a comma-separated file, with complaints that name file, line, column and expectation.
#ifndef CAMGYRO_FRONTEND_READERS_CSV_READER_H_
#define CAMGYRO_FRONTEND_READERS_CSV_READER_H_

#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace camgyro {

// Hands out the rows of a file, of which it holds a piece at a time. The first error sticks:
// NextRow() is false from then on, and status() says what was wrong; cells read after an error are
// zero.
//
//   CsvReader csv(file, {"timestamp [ns]", "u [px]", "v [px]"}, {3});
//   while (csv.NextRow()) points.push_back({csv.Stamp(0), csv.Number(1), csv.Number(2)});
//   if (!csv.status()) return tl::unexpected(csv.status().error());
//
// Tolerated: a byte order mark, CRLF, blanks around cells, empty lines, lines that begin with '#',
// and a first line without '#' in which no cell is a number (a header).
class CsvReader {
 public:
  // columns: names for messages, in order. widths: how many of them a row may have (e.g. {4, 7});
  // all rows of a file have the width of its first row.
  CsvReader(const std::string& file, std::vector<std::string> columns, std::vector<size_t> widths);

  // A file whose columns go by the names in its header: the first line in which no cell is a
  // number, or a line with '#' before the first row of numbers. skip_lines: of another kind, before
  // it. Rows have the header's width.
  static CsvReader ByName(const std::string& file, int skip_lines = 0);

  // A table of which somebody says where its columns are: cells between separators of any kind; the
  // header, if there is one, as of ByName. Without one the columns are called by their numbers.
  static CsvReader Described(const std::string& file, char separator);

  // Of Described: the column with this name, or of this number, from 1; an error and 0 otherwise.
  size_t NamedOrNumbered(const std::string& name);

  // Of ByName: the index of the column with one of these names; an error and 0 if there is none.
  size_t Column(const std::vector<std::string>& names);
  bool HasColumn(const std::string& name) const;

  // Cell names of the header (without '#'); empty without one. Known before the first NextRow().
  const std::vector<std::string>& header() const { return header_; }

  bool NextRow();
  size_t NextWidth();  // cells of the row that NextRow() will find; 0 at the end
  size_t width() const { return cells_.size(); }
  int line() const { return line_; }  // of the current row, from 1
  std::string Place() const { return file_ + ":" + std::to_string(line_); }

  std::string_view Cell(size_t column) const { return cells_[column]; }
  int64_t Stamp(size_t column) { return Integer(column, "an integer number of nanoseconds"); }
  int64_t Integer(size_t column, const char* expected = "an integer");
  // A time in units of `unit_s`, plus an offset, as nanoseconds; exact if it is written as an
  // integer and the unit is of whole nanoseconds.
  int64_t Time(size_t column, double unit_s, int64_t offset_ns = 0);
  double Number(size_t column);  // finite

  // Records an error of the current row; the file and the line are put in front.
  void Fail(const std::string& message);
  const Status& status() const { return status_; }

 private:
  explicit CsvReader(const std::string& file);  // opens it only
  void FindHeader();
  // Where the line that begins at position_ ends, in content_; reads on until it is whole.
  size_t FindLineEnd();
  bool NextLine(std::string_view* text);
  void FailCell(size_t column, const std::string& expected);

  std::string file_;
  char separator_ = ',';
  std::vector<std::string> columns_;
  std::vector<size_t> widths_;
  std::ifstream stream_;  // empty of what is in content_
  // The piece: what is not handed out yet, and until NextRow() also what is, so that the search for
  // a header, or NextWidth(), can go back.
  std::string content_;
  size_t position_ = 0;  // in content_
  int line_ = 0;
  size_t file_width_ = 0;  // of the first row; 0 before it
  std::vector<std::string> header_;
  std::string row_;                      // the current one
  std::vector<std::string_view> cells_;  // of row_
  Status status_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_CSV_READER_H_
