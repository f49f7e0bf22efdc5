// A lens that follows the camera's turns, found from rotations.
#include "estimator/start/stabiliser_search.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <vector>

#include "estimator/start/focal_scan.h"
#include "simulated_rotation.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kTrueFocal_px = 500.0;
constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// Rotations as pictures through a stabilised lens give them at a focal length, to first order: pan
// and tilt are those of the picture times the true focal length over the one assumed, and the roll
// is that of the camera. The lens follows the camera's true rates, 1000 times a second.
CameraRotationsAt SeenThroughLens(const Simulated& s, const RateFunction& rate,
                                  const SimulatedTruth& truth, const OpticalStabiliser& stabiliser,
                                  double gain) {
  constexpr double kBefore_s = 5.0, kStep_s = 0.001;
  const int count = static_cast<int>((kBefore_s + truth.duration_s + 0.1) / kStep_s);
  std::vector<double> times_s;
  Eigen::Matrix3Xd omega_cam(3, count);
  for (int k = 0; k < count; ++k) {
    times_s.push_back(kStep_s * k - kBefore_s);
    omega_cam.col(k) = truth.q_gyro_cam.conjugate() * rate(times_s.back());
  }
  const Eigen::Matrix2Xd angle = StabilisedAngle(times_s, omega_cam, stabiliser);
  const auto angle_of = [=](int frame) -> Eigen::Vector2d {
    return angle.col(std::lround((kBefore_s + frame / truth.fps) / kStep_s));
  };
  return [=, &s](const Recording&, const std::vector<RotationTrial>& trials) {
    std::vector<std::vector<CameraRotation>> seen(trials.size(), s.rotations);
    for (size_t k = 0; k < seen.size(); ++k) {
      for (CameraRotation& rotation : seen[k]) {
        Eigen::Vector3d turn = Log(rotation.q_a_b);
        turn.head<2>() -= gain * (angle_of(rotation.frame_b) - angle_of(rotation.frame_a));
        turn.head<2>() *= kTrueFocal_px / trials[k].focal_px;
        rotation.q_a_b = Exp(turn);
      }
    }
    return seen;
  };
}

SimulatedTruth PhoneInTheHand() {
  SimulatedTruth truth;
  truth.delay_s = -0.37;
  truth.q_gyro_cam = Exp(Eigen::Vector3d(0.03, -0.02, 1.6));
  truth.bias_gyro_rad_s = Eigen::Vector3d(0.01, -0.02, 0.005);
  truth.camera_noise_rad = 0.0015;
  truth.gyro_noise_rad_s = 0.003;
  return truth;
}

Simulated SceneOf(const RateFunction& rate, const SimulatedTruth& truth, int seed) {
  Simulated s = Simulate(rate, truth, seed);
  s.recording.camera.width_px = 640;
  s.recording.camera.height_px = 480;
  return s;
}

TEST(LookForStabiliser, FindsTheLensAndWithItDelayAndFocalLength) {
  struct Case {
    OpticalStabiliser stabiliser;
    double gain;
  };
  // The stops are reached, and hide the corner; two of these are no points of the search's grid.
  for (const Case& c :
       {Case{{0.5, 0.025}, 0.95}, Case{{0.7, 0.03}, 0.6}, Case{{0.3, kUnlimited}, 0.7}}) {
    for (int seed = 0; seed < 3; ++seed) {
      SCOPED_TRACE(NameOf(c.stabiliser) + " seed " + std::to_string(seed));
      const SimulatedTruth truth = PhoneInTheHand();
      const RateFunction rate = SmoothRandomRate(70 + seed, 0.8);
      const Simulated s = SceneOf(rate, truth, seed);
      const auto start = FindStartAndFocal(
          s.recording, SeenThroughLens(s, rate, truth, c.stabiliser, c.gain), {}, {});
      ASSERT_TRUE(start) << start.error().message;
      ASSERT_TRUE(start->stabiliser);
      const StartStabiliser& found = *start->stabiliser;
      EXPECT_TRUE(found.follows_turns);
      EXPECT_FALSE(found.is_held);
      EXPECT_NEAR(found.gain, c.gain, 4.0 * found.gain_sigma);
      EXPECT_LT(found.gain_sigma, 0.05);
      EXPECT_NEAR(found.stabiliser.corner_hz, c.stabiliser.corner_hz,
                  0.35 * c.stabiliser.corner_hz);
      if (std::isfinite(c.stabiliser.travel_rad)) {
        EXPECT_NEAR(found.stabiliser.travel_rad, c.stabiliser.travel_rad, 0.003);
      } else {
        EXPECT_FALSE(std::isfinite(found.stabiliser.travel_rad));
      }
      EXPECT_NEAR(start->delay_middle_row_s, truth.delay_s, 0.003);
      EXPECT_TRUE(start->focal->determined);
      EXPECT_NEAR(start->focal->value_px, kTrueFocal_px, 2.0 * start->focal->sigma_px);
      const Eigen::Vector3d turned = Log(truth.q_gyro_cam.conjugate() * start->q_gyro_cam);
      EXPECT_LT(turned.cwiseQuotient(start->rotation_sigma_rad).cwiseAbs().maxCoeff(), 4.0);
      EXPECT_LT(start->rotation_sigma_rad.maxCoeff(), 0.02);
      EXPECT_GT(start->explained, 0.9);
      EXPECT_FALSE(start->readout->determined);
      EXPECT_THAT(start->notes, Contains(HasSubstr("the lens follows the camera's turns")));
      EXPECT_THAT(start->notes, Not(Contains(HasSubstr("focal length is not determined"))));
    }
  }
}

TEST(LookForStabiliser, SaysThatALensIsHeld) {
  for (int seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    const SimulatedTruth truth = PhoneInTheHand();
    const RateFunction rate = SmoothRandomRate(170 + seed, 0.8);
    const Simulated s = SceneOf(rate, truth, seed);
    const auto start = FindStartAndFocal(
        s.recording, SeenThroughLens(s, rate, truth, {0.5, kUnlimited}, 0.0), {}, {});
    ASSERT_TRUE(start) << start.error().message;
    ASSERT_TRUE(start->stabiliser);
    EXPECT_FALSE(start->stabiliser->follows_turns);
    EXPECT_TRUE(start->stabiliser->is_held);
    EXPECT_NEAR(start->stabiliser->gain, 0.0, 0.1);
    EXPECT_THAT(start->notes, Not(Contains(HasSubstr("the lens follows"))));
  }
}

// Noise of the pictures' rotations as large as the motion: neither is claimed.
TEST(LookForStabiliser, ClaimsNothingWherePicturesTellNothing) {
  SimulatedTruth truth = PhoneInTheHand();
  truth.camera_noise_rad = 0.02;
  const RateFunction rate = SmoothRandomRate(70, 0.8);
  const Simulated s = SceneOf(rate, truth, 1);
  const auto seen = SeenThroughLens(s, rate, truth, {0.5, kUnlimited}, 0.5);
  StartResult start;
  start.delay_middle_row_s = truth.delay_s;
  start.q_gyro_cam = truth.q_gyro_cam;
  start.focal = StartFocal{kTrueFocal_px, 10.0, true, 0.5, {}};
  start.readout = StartReadout{0.01, 0.01, false};
  LookForStabiliser(s.recording, seen, &start);
  ASSERT_TRUE(start.stabiliser);
  EXPECT_FALSE(start.stabiliser->follows_turns);
  EXPECT_FALSE(start.stabiliser->is_held);
  EXPECT_EQ(start.delay_middle_row_s, truth.delay_s);
  EXPECT_EQ(start.focal->value_px, kTrueFocal_px);
}

}  // namespace
}  // namespace camgyro
