#include "frontend/readers/csv_reader.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace camgyro {
namespace {

using testing::HasSubstr;

// Longer than the pieces of a megabyte in which a file is read: every border of two pieces lies
// somewhere in a row.
class LongCsvTest : public testing::Test {
 protected:
  static constexpr int kRows = 200000;

  LongCsvTest()
      : file_(std::filesystem::temp_directory_path() /
              ("camgyro_csv_" + std::to_string(::getpid()) + ".csv")) {}
  ~LongCsvTest() override { std::filesystem::remove(file_); }

  // Rows of a number, twice and three times it; `before` and `after` are written around them.
  std::string Write(const std::string& before, const std::string& after) const {
    std::ofstream out(file_);
    out << before;
    for (int i = 0; i < kRows; ++i) out << i << "," << 2 * i << "," << 3 * i << "\n";
    out << after;
    return file_.string();
  }

  std::filesystem::path file_;
};

TEST_F(LongCsvTest, EveryRowIsThere) {
  CsvReader csv(Write("#a,b,c\n", ""), {"a", "b", "c"}, {3});
  EXPECT_THAT(csv.header(), testing::ElementsAre("a", "b", "c"));
  int row = 0;
  for (; csv.NextRow(); ++row) {
    ASSERT_EQ(csv.Integer(0), row);
    ASSERT_EQ(csv.Integer(1), 2 * row);
    ASSERT_EQ(csv.Number(2), 3.0 * row);
    ASSERT_EQ(csv.line(), row + 2);
  }
  EXPECT_TRUE(csv.status());
  EXPECT_EQ(row, kRows);
}

// Looking at the next row, over a border of two pieces, leaves the cells of this one as they are.
TEST_F(LongCsvTest, TheNextWidthIsSeenFromEveryRow) {
  CsvReader csv(Write("a,b,c\n", ""), {"a", "b", "c"}, {3});
  for (int row = 0; csv.NextRow(); ++row) {
    const bool last = row + 1 == kRows;
    ASSERT_EQ(csv.NextWidth(), last ? 0u : 3u);
    ASSERT_EQ(csv.Integer(0), row);
    ASSERT_EQ(csv.Integer(1), 2 * row);
  }
  EXPECT_TRUE(csv.status());
}

TEST_F(LongCsvTest, AFaultFarIntoTheFileHasItsLine) {
  CsvReader csv(Write("a,b,c\n", "1,2\n"), {"a", "b", "c"}, {3});
  while (csv.NextRow()) {
  }
  ASSERT_FALSE(csv.status());
  EXPECT_THAT(csv.status().error().message,
              HasSubstr(".csv:" + std::to_string(kRows + 2) + ": this row has 2 columns"));
}

// A header may come after a comment of any length.
TEST_F(LongCsvTest, TheHeaderIsFoundBehindAComment) {
  std::string comment;
  for (int i = 0; i < 30000; ++i) comment += "# a remark about the table, and its units, [m]\n";
  CsvReader csv = CsvReader::ByName(Write(comment + "a,b,c\n", ""));
  ASSERT_TRUE(csv.status());
  const size_t b = csv.Column({"b"});
  int row = 0;
  for (; csv.NextRow(); ++row) ASSERT_EQ(csv.Integer(b), 2 * row);
  EXPECT_EQ(row, kRows);
}

TEST_F(LongCsvTest, LinesBeforeTheHeaderAreSkipped) {
  CsvReader csv = CsvReader::ByName(Write("words\n1,2,3,4\na,b,c\n", ""), 2);
  ASSERT_TRUE(csv.status()) << csv.status().error().message;
  ASSERT_TRUE(csv.NextRow());
  EXPECT_EQ(csv.line(), 4);
  EXPECT_EQ(csv.Integer(csv.Column({"c"})), 0);
}

// A file without an end of line in it is one row, whatever its length.
TEST_F(LongCsvTest, ALineMayBeLongerThanAPiece) {
  std::ofstream(file_) << "a\n" << std::string(3'000'000, 'x');
  CsvReader csv(file_.string(), {"a"}, {1});
  ASSERT_TRUE(csv.NextRow());
  EXPECT_EQ(csv.Cell(0).size(), 3'000'000u);
  EXPECT_FALSE(csv.NextRow());
  EXPECT_TRUE(csv.status());
}

TEST_F(LongCsvTest, AFolderIsNoTable) {
  CsvReader csv(std::filesystem::temp_directory_path().string(), {"a"}, {1});
  EXPECT_FALSE(csv.NextRow());
  EXPECT_THAT(csv.status().error().message, HasSubstr("is a folder"));
}

}  // namespace
}  // namespace camgyro
