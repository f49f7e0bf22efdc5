// The VINS initialisation on a recording that this project did not make.
#include <gmock/gmock.h>

#include "estimator/vins/initialise.h"
#include "frontend/readers/read_recording.h"
#include "pipeline/read_calibration.h"
#include "tests/measured_data.h"

namespace camgyro {
namespace {

// Speed in the gyro frame: the same whatever the world.
Eigen::Vector3d VelocityInGyro(const VinsState& state) {
  return state.q_world_gyro.conjugate() * state.v_world_m_s;
}
Eigen::Vector3d GravityInGyro(const VinsStart& start, const VinsState& state) {
  return state.q_world_gyro.conjugate() * start.gravity_world_m_s2;
}

// The second window begins with the last frame of the first, and shares nothing else.
TEST(Measured, NeighbouringWindowsAgreeOnSpeedAndGravity) {
  const auto path = MeasuredData("ov_handheld_rs");
  if (!path) GTEST_SKIP() << "no measured recordings";
  const auto recording = ReadRecording(*path);
  ASSERT_TRUE(recording) << recording.error().message;
  auto calibration = ReadCalibration(*path + "/truth.yaml");
  ASSERT_TRUE(calibration) << calibration.error().message;
  calibration->covariance.setZero();
  calibration->covariance.diagonal().segment<3>(kStateBias).setConstant(1e-6);
  VinsOptions options;
  options.noise = {1.7e-4, 2e-3};
  for (const double first_s : {10.0, 30.0, 45.0}) {
    SCOPED_TRACE(first_s);
    const auto a =
        InitialiseVins(CutVinsInput(*recording, *calibration, first_s, first_s + 2.0), options);
    const auto b = InitialiseVins(
        CutVinsInput(*recording, *calibration, first_s + 1.999, first_s + 4.0), options);
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->verdict, VinsVerdict::kReady) << a->explanation;
    ASSERT_EQ(b->verdict, VinsVerdict::kReady) << b->explanation;
    EXPECT_NEAR(a->noise_px, 0.3, 0.06);  // the recording's own
    // The truth of EuRoC's cam0: the camera sits at (-0.022, -0.065, 0.010) m in the IMU frame.
    EXPECT_LT((a->p_gyro_cam_m - Eigen::Vector3d(-0.0216, -0.0647, 0.0098)).norm(), 0.08);
    const VinsState &last = a->states.back(), &first = b->states.front();
    ASSERT_EQ(last.frame_stamp_ns, first.frame_stamp_ns);
    EXPECT_LT((VelocityInGyro(last) - VelocityInGyro(first)).norm(), 0.06);
    EXPECT_LT((GravityInGyro(*a, last) - GravityInGyro(*b, first)).norm(), 0.25);  // 1.5 deg
  }
}

}  // namespace
}  // namespace camgyro
