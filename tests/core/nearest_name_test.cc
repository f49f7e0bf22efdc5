#include "core/nearest_name.h"

#include <gtest/gtest.h>

namespace camgyro {
namespace {

TEST(EditDistance, CountsLetters) {
  EXPECT_EQ(EditDistance("", "abc"), 3u);
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3u);
  EXPECT_EQ(EditDistance("delay", "delay"), 0u);
}

TEST(NearestName, ForgivesTypingErrorsOnly) {
  const std::vector<std::string> known = {"calibrate", "delay", "track"};
  EXPECT_EQ(NearestName("calibarte", known), "calibrate");
  EXPECT_EQ(NearestName("trak", known), "track");
  EXPECT_EQ(NearestName("stabilise", known), "");
}

}  // namespace
}  // namespace camgyro
