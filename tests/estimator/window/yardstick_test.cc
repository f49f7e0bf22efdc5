// Distances in sigmas, and when frames' times have settled.
#include "estimator/window/yardstick.h"

#include <gtest/gtest.h>

#include <cmath>

namespace camgyro {
namespace {

TEST(Yardstick, MeasuresInSigmas) {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(kStateSize, kStateSize);
  covariance(kStateFocal, kStateFocal) = 4.0;   // 2 px
  covariance(kStateDelay, kStateDelay) = 1e-8;  // 0.1 ms
  covariance(kStateReadout, kStateReadout) = 1e-8;
  const Calibration at;
  Calibration moved = at;
  moved.lens[kFocal] += 6.0;
  moved.delay_s += 4e-4;
  EXPECT_NEAR(Yardstick(covariance).Distance(moved, at), 5.0, 1e-9);
  // What is known together only: delay and readout against each other.
  covariance(kStateDelay, kStateReadout) = covariance(kStateReadout, kStateDelay) = -0.96e-8;
  moved = at;
  moved.delay_s += 1e-4;
  moved.readout_s -= 1e-4;
  EXPECT_NEAR(Yardstick(covariance).Distance(moved, at), std::sqrt(2.0 / 1.96), 1e-6);
  moved.readout_s += 2e-4;
  EXPECT_NEAR(Yardstick(covariance).Distance(moved, at), std::sqrt(2.0 / 0.04), 1e-5);
}

TEST(Yardstick, FrameTimesSettleButForATenth) {
  std::vector<FrameOffset> known;
  std::map<int64_t, double> before_s, now_s;
  for (int64_t frame = 0; frame < 20; ++frame) {
    known.push_back({frame, 0.0, frame < 10 ? 1e-3 : 1e-4});
    before_s[frame] = 0.0;
    now_s[frame] = 0.09 * known.back().sigma_s;
  }
  EXPECT_TRUE(FrameTimesHaveSettled(known, before_s, now_s));
  now_s[0] = now_s[1] = -0.02;  // two of twenty may creep
  EXPECT_TRUE(FrameTimesHaveSettled(known, before_s, now_s));
  now_s[15] = 5e-5;  // half of its sigma
  EXPECT_FALSE(FrameTimesHaveSettled(known, before_s, now_s));
}

}  // namespace
}  // namespace camgyro
