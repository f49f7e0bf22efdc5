#include "estimator/start/slerp_delay_search.h"

#include <gmock/gmock.h>

#include "simulated_rotation.h"

namespace camgyro {
namespace {

using ::testing::HasSubstr;

SimulatedTruth UsualTruth() {
  SimulatedTruth truth;
  truth.delay_s = 0.0637;
  truth.q_gyro_cam = Exp(Eigen::Vector3d(0.03, -0.02, 1.6));
  truth.bias_gyro_rad_s = Eigen::Vector3d(0.02, -0.01, 0.03);
  truth.duration_s = 20.0;
  return truth;
}

TEST(SlerpDelaySearch, FindsTheDelayWithTheSignOfTheDesign) {
  const SimulatedTruth truth = UsualTruth();
  const Simulated s = Simulate(SmoothRandomRate(1, 0.8), truth, 1);
  for (const SlerpReference reference : {SlerpReference::kGyro, SlerpReference::kCamera}) {
    SlerpOptions options;
    options.reference = reference;
    if (reference == SlerpReference::kCamera) options.range_s = 0.4;
    const auto delay = SlerpDelaySearch(s.recording, s.rotations, 100, truth.q_gyro_cam,
                                        truth.bias_gyro_rad_s, options);
    ASSERT_TRUE(delay) << delay.error().message;
    // Camera at 30 Hz interpolated: a millisecond; gyro at 200 Hz: a tenth.
    EXPECT_NEAR(delay->delay_s, truth.delay_s, reference == SlerpReference::kGyro ? 2e-3 : 1e-4);
    EXPECT_EQ(delay->curve.size(), reference == SlerpReference::kGyro ? 1001u : 801u);
    EXPECT_NEAR(delay->curve.front().delay_s, -options.range_s, 1e-12);
    // 50 pairs at 30 Hz are 1.667 s; with 0.5 s cut at both ends 20 intervals are left.
    EXPECT_EQ(delay->terms, reference == SlerpReference::kGyro ? 20 : 50);
  }
}

TEST(SlerpDelaySearch, MovingTheGyroBeatsMovingTheCamera) {
  SimulatedTruth truth = UsualTruth();
  truth.camera_noise_rad = 0.001;
  truth.gyro_noise_rad_s = 0.003;
  double squares_gyro_fixed = 0.0, squares_camera_fixed = 0.0;
  int windows = 0;
  for (int seed = 0; seed < 4; ++seed) {
    const Simulated s = Simulate(SmoothRandomRate(30 + seed, 0.8), truth, seed);
    for (int first = 20; first + 50 < 580; first += 25) {
      SlerpOptions options;
      options.range_s = 0.4;
      const auto theirs = SlerpDelaySearch(s.recording, s.rotations, first, truth.q_gyro_cam,
                                           truth.bias_gyro_rad_s, options);
      options.reference = SlerpReference::kCamera;
      const auto ours = SlerpDelaySearch(s.recording, s.rotations, first, truth.q_gyro_cam,
                                         truth.bias_gyro_rad_s, options);
      ASSERT_TRUE(theirs) << theirs.error().message;
      ASSERT_TRUE(ours) << ours.error().message;
      squares_gyro_fixed += std::pow(theirs->delay_s - truth.delay_s, 2);
      squares_camera_fixed += std::pow(ours->delay_s - truth.delay_s, 2);
      ++windows;
    }
  }
  const double rms_theirs_s = std::sqrt(squares_gyro_fixed / windows);
  const double rms_ours_s = std::sqrt(squares_camera_fixed / windows);
  RecordProperty("rms_error_gyro_fixed_us", static_cast<int>(1e6 * rms_theirs_s));
  RecordProperty("rms_error_camera_fixed_us", static_cast<int>(1e6 * rms_ours_s));
  EXPECT_LT(rms_theirs_s, 0.005);
  EXPECT_LT(rms_ours_s, 0.7 * rms_theirs_s);
}

TEST(SlerpDelaySearch, CentreMovesTheRange) {
  SimulatedTruth truth = UsualTruth();
  truth.delay_s = 1.9;
  const Simulated s = Simulate(SmoothRandomRate(1, 0.8), truth, 1);
  SlerpOptions options;
  options.centre_s = 1.8;
  const auto delay = SlerpDelaySearch(s.recording, s.rotations, 100, truth.q_gyro_cam,
                                      truth.bias_gyro_rad_s, options);
  ASSERT_TRUE(delay) << delay.error().message;
  EXPECT_NEAR(delay->delay_s, 1.9, 2e-3);
}

TEST(SlerpDelaySearch, RefusesWhatItCannotDo) {
  const SimulatedTruth truth = UsualTruth();
  Simulated s = Simulate(SmoothRandomRate(1, 0.8), truth, 1);
  const auto search = [&](int first, const SlerpOptions& options) {
    return SlerpDelaySearch(s.recording, s.rotations, first, truth.q_gyro_cam,
                            truth.bias_gyro_rad_s, options);
  };
  SlerpOptions options;
  options.step_s = 0.0;
  ASSERT_FALSE(search(0, options));
  EXPECT_EQ(search(0, options).error().kind, ErrorKind::kBadUsage);
  options = {};
  ASSERT_FALSE(search(580, options));
  EXPECT_THAT(search(580, options).error().message, HasSubstr("less than 50 camera rotations"));
  options.range_s = 0.9;
  ASSERT_FALSE(search(0, options));
  EXPECT_THAT(search(0, options).error().message, HasSubstr("too short"));
  options.range_s = 0.05;  // the truth, 63.7 ms, is outside
  ASSERT_FALSE(search(0, options));
  EXPECT_THAT(search(0, options).error().message, HasSubstr("at the edge"));
  s.rotations.erase(s.rotations.begin() + 10);
  ASSERT_FALSE(search(0, {}));
  EXPECT_THAT(search(0, {}).error().message, HasSubstr("9 and 10 are not consecutive"));
}

}  // namespace
}  // namespace camgyro
