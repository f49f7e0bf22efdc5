#include "core/optical_stabiliser.h"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

namespace camgyro {
namespace {

// A constant rate about x, with a hole of 1 s after 2 s if asked for, at 200 Hz for 4 s.
struct Turning {
  std::vector<double> times_s;
  Eigen::Matrix3Xd omega;
  explicit Turning(bool with_hole) {
    for (int k = 0; k <= 800; ++k) {
      const double t = 0.005 * k;
      if (!with_hole || t <= 2.0 || t >= 3.0) times_s.push_back(t);
    }
    omega = Eigen::Vector3d(0.3, 0.0, 0.1).replicate(1, static_cast<Eigen::Index>(times_s.size()));
  }
  Eigen::Matrix2Xd Angle(const OpticalStabiliser& s) const {
    return StabilisedAngle(times_s, omega, s);
  }
};

TEST(OpticalStabiliser, ForgetsAConstantRate) {
  const Turning turning(false);
  const double a = 2.0 * M_PI * 0.5;
  const Eigen::Matrix2Xd angle = turning.Angle({0.5});
  for (size_t k = 0; k < turning.times_s.size(); k += 100) {
    const double expected = 0.3 / a * (1.0 - std::exp(-a * turning.times_s[k]));
    EXPECT_NEAR(angle(0, static_cast<Eigen::Index>(k)), expected, 1e-4);
    EXPECT_EQ(angle(1, static_cast<Eigen::Index>(k)), 0.0);
  }
}

TEST(OpticalStabiliser, BeginsAnewAfterAHole) {
  const Turning turning(true);
  const Eigen::Matrix2Xd angle = turning.Angle({0.5});
  const Eigen::Index after = 401;  // the first sample after the hole
  ASSERT_NEAR(turning.times_s[after], 3.0, 1e-9);
  EXPECT_EQ(angle(0, after), 0.0);
  EXPECT_GT(angle(0, after - 1), 0.09);
  EXPECT_NEAR(angle(0, after + 1), 0.0015, 2e-5);
}

TEST(OpticalStabiliser, HasAName) {
  EXPECT_EQ(NameOf({0.5}), "0.5");
  EXPECT_EQ(NameOf({0.5, 0.025}), "0.5/0.025");
  const auto read = StabiliserOf(NameOf({0.6789, 0.02345}));
  ASSERT_TRUE(read);
  EXPECT_NEAR(read->corner_hz, 0.679, 1e-9);
  EXPECT_NEAR(read->travel_rad, 0.0234, 1e-4);
  EXPECT_TRUE(std::isinf(StabiliserOf("1")->travel_rad));
  EXPECT_FALSE(StabiliserOf("1/"));
}

}  // namespace
}  // namespace camgyro
