#include "core/format.h"

#include <gtest/gtest.h>

namespace camgyro {
namespace {

TEST(Format, HasNoLongestText) {
  EXPECT_EQ(Format("%.2f px of %d", 1.255, 7), "1.25 px of 7");
  EXPECT_EQ(Format("%s", ""), "");
  const std::string word(5000, 'x');
  EXPECT_EQ(Format("<%s>", word.c_str()), "<" + word + ">");
}

}  // namespace
}  // namespace camgyro
