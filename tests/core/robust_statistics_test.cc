#include "core/robust_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>

namespace camgyro {
namespace {

TEST(Median, IsTheUpperOneOfAnEvenNumber) {
  std::vector<double> three = {5.0, -1.0, 2.0};
  EXPECT_EQ(MedianInPlace(&three), 2.0);
  EXPECT_EQ(MedianOr({4.0, 1.0, 3.0, 2.0}, 0.0), 3.0);
  EXPECT_EQ(MedianOr({}, 7.0), 7.0);
  // Of integers without rounding.
  std::vector<int64_t> stamps = {int64_t{1} << 60, (int64_t{1} << 60) + 1, 0};
  EXPECT_EQ(MedianInPlace(&stamps), int64_t{1} << 60);
}

// Groups of four that lost one degree each, with every tenth residual wrong.
TEST(RobustScale, IsTheStandardDeviationOfWhatIsRight) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0.0, 0.5);
  std::vector<std::vector<double>> groups(5000);
  int count = 0;
  for (auto& group : groups) {
    double mean = 0.0;
    for (int i = 0; i < 4; ++i) group.push_back(normal(generator));
    for (const double r : group) mean += 0.25 * r;
    for (double& r : group) r = count++ % 10 == 0 ? 100.0 : r - mean;
  }
  // A tenth beyond all others moves the median of a Gaussian to its 55.6 % quantile: 1.13.
  EXPECT_NEAR(RobustScale(groups, 1), 1.13 * 0.5, 0.02);
  EXPECT_EQ(RobustScale({{1.0, 2.0}}, 2), 0.0);
}

}  // namespace
}  // namespace camgyro
