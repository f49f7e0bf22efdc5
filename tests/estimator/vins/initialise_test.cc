// The VINS initialisation on simulated windows: accuracy, honest sigmas, and every refusal.
#include "estimator/vins/initialise.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/linear_algebra.h"
#include "core/so3.h"
#include "estimator/vins/alignment.h"
#include "estimator/vins/structure.h"
#include "tests/estimator/vins/vins_scene.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;
using simulation::Scenario;
using simulation::Simulated;
using simulation::SimulateTracks;

struct Case {
  Scenario scenario;
  Simulated simulated;
  VinsInput input;
};
Case MakeCase(const Scenario& scenario) {
  Case c{scenario, SimulateTracks(scenario).value(), {}};
  c.input = CutVinsInput(c.simulated.recording, GoodCalibration(c.simulated), 0.0, 2.0);
  return c;
}

TEST(InitialiseVins, FindsTheStateOfAWalk) {
  const Case c = MakeCase(WalkingScenario(2.0));
  const auto start = InitialiseVins(c.input, SimulatorsNoise(c.scenario));
  ASSERT_TRUE(start) << start.error().message;
  ASSERT_EQ(start->verdict, VinsVerdict::kReady) << start->explanation;
  const VinsTruth truth = TruthOf(*start, c.simulated, c.scenario);
  EXPECT_NEAR(start->noise_px, 0.5, 0.08);
  EXPECT_LT(std::abs(ScaleError(*start, truth)), 0.03);
  EXPECT_LT(GravityErrorRad(*start, truth), 0.02);
  EXPECT_LT(start->bias_accel_m_s2.norm(), 0.2);  // the truth is zero
  for (size_t k = 0; k < start->states.size(); ++k) {
    EXPECT_LT((start->states[k].v_world_m_s - truth.states[k].v_world_m_s).norm(), 0.06) << k;
    EXPECT_LT((start->states[k].p_world_m - truth.states[k].p_world_m).norm(), 0.1) << k;
    EXPECT_LT(start->states[k].q_world_gyro.angularDistance(truth.states[k].q_world_gyro), 5e-3);
  }
  // The middle row of the first frame: stamp + delay + half the readout.
  EXPECT_NEAR(
      1e-9 * static_cast<double>(start->states[0].time_ns - start->states[0].frame_stamp_ns),
      c.simulated.truth.delay_s + 0.5 * c.simulated.truth.readout_s, 2e-9);
  EXPECT_EQ(start->states.back().frame_stamp_ns, c.input.frame_stamps_ns.back());
  EXPECT_GT(start->landmarks.size(), 40u);
}

TEST(InitialiseVins, LandmarksLieWhereTheSceneIs) {
  const Case c = MakeCase(WalkingScenario(2.0));
  const auto start = InitialiseVins(c.input, SimulatorsNoise(c.scenario));
  ASSERT_TRUE(start);
  const VinsState first = TrueState(c.simulated, c.scenario, start->states.front().time_ns);
  int near = 0, within = 0;
  for (const VinsLandmark& landmark : start->landmarks) {
    const Vector3d point = landmark.point.head<3>() / landmark.point.w();
    const Vector3d truth_m = [&] {
      for (size_t i = 0; i < c.simulated.points.size(); ++i) {
        for (size_t n = 0; n < c.simulated.points[i].size(); ++n) {
          if (c.simulated.recording.tracks[i][n].track_id == landmark.track_id) {
            return c.simulated.points[i][n].world_m;
          }
        }
      }
      return Vector3d(Vector3d::Constant(std::nan("")));
    }();
    const Vector3d truth = first.q_world_gyro.conjugate() * (truth_m - first.p_world_m);
    const Vector3d error = point - truth;
    const double mahalanobis = SquaredMahalanobis(error, landmark.covariance_m2);
    ++near;
    within += mahalanobis < 11.3;  // 99 % of chi-square with 3 degrees of freedom
  }
  EXPECT_GT(near, 40);
  EXPECT_GT(within, 0.93 * near);
}

// 24 windows. What the input does not know exactly is wrong by what it claims: calibration,
// accelerometer bias, lever arm. Errors over sigmas are then those of a covariance that tells the
// truth.
TEST(InitialiseVins, CovarianceIsHonest) {
  Scenario scenario = WalkingScenario(24.0);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Vector3d(sigma * Vector3d(x, y, z));
  };
  double nees_velocity = 0.0, scale = 0.0, gravity = 0.0;
  int windows = 0;
  for (const uint64_t seed : {1, 2}) {
    scenario.seed = seed;
    const Simulated s = SimulateTracks(scenario).value();
    for (double first_s = 0.0; first_s + 2.0 <= 24.0; first_s += 2.0) {
      VinsOptions options = SimulatorsNoise(scenario);
      options.keyframe_interval_s = 0.25;
      options.p_gyro_cam_sigma_m = 0.02;
      options.p_gyro_cam_m = scenario.mount.p_gyro_cam_m + draw(options.p_gyro_cam_sigma_m);
      Calibration calibration = GoodCalibration(s);
      const StateVector sigma = calibration.sigma();
      calibration.lens[kFocal] += sigma[kStateFocal] * normal(random);
      calibration.lens[kCx] += sigma[kStateCx] * normal(random);
      calibration.lens[kCy] += sigma[kStateCy] * normal(random);
      calibration.readout_s += sigma[kStateReadout] * normal(random);
      calibration.delay_s += sigma[kStateDelay] * normal(random);
      calibration.bias_gyro_rad_s += draw(sigma[kStateBias]);
      calibration.q_gyro_cam = calibration.q_gyro_cam * Exp(draw(sigma[kStateRotation]));
      VinsInput input = CutVinsInput(s.recording, calibration, first_s, first_s + 2.0);
      const Vector3d bias = draw(options.accel_bias_sigma_m_s2);
      for (AccelSample& sample : input.accel) sample.accel_gyro_m_s2 += bias;
      const auto start = InitialiseVins(input, options);
      ASSERT_TRUE(start);
      ASSERT_GT(start->covariance.rows(), 0) << start->explanation;
      const VinsTruth truth = TruthOf(*start, s, scenario);
      const Eigen::Index row = start->StateRow(start->states.size() - 1) + 6;
      const Vector3d error = start->states.back().v_world_m_s - truth.states.back().v_world_m_s;
      nees_velocity += SquaredMahalanobis(error, start->covariance.block<3, 3>(row, row)) / 3.0;
      scale += std::pow(ScaleError(*start, truth) / start->scale_sigma, 2);
      const Vector3d g = start->gravity_world_m_s2 - truth.gravity_world_m_s2;
      gravity += g.squaredNorm() /
                 start->covariance.block<3, 3>(start->GravityRow(), start->GravityRow()).trace();
      ++windows;
    }
  }
  // Means of 24 values of chi-square / dof with 3, 1 and 2 degrees of freedom: one sigma is 0.17,
  // 0.29, 0.2.
  EXPECT_EQ(windows, 24);
  EXPECT_NEAR(nees_velocity / windows, 1.0, 0.6);
  EXPECT_NEAR(scale / windows, 1.0, 0.9);
  EXPECT_NEAR(gravity / windows, 1.0, 0.6);
}

TEST(InitialiseVins, OutliersDoNotMatter) {
  Scenario scenario = WalkingScenario(2.0);
  scenario.tracks.outlier_fraction = 0.05;
  const Case c = MakeCase(scenario);
  const auto start = InitialiseVins(c.input, SimulatorsNoise(c.scenario));
  ASSERT_TRUE(start);
  ASSERT_EQ(start->verdict, VinsVerdict::kReady) << start->explanation;
  const VinsTruth truth = TruthOf(*start, c.simulated, c.scenario);
  EXPECT_LT(std::abs(ScaleError(*start, truth)), 0.05);
  EXPECT_LT(GravityErrorRad(*start, truth), 0.02);
}

TEST(InitialiseVins, TwoRunsAreBitIdentical) {
  const Case c = MakeCase(WalkingScenario(2.0));
  const auto a = InitialiseVins(c.input), b = InitialiseVins(c.input);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->covariance, b->covariance);
  EXPECT_EQ(a->states.back().v_world_m_s, b->states.back().v_world_m_s);
}

TEST(InitialiseVins, CalibrationMovesWithinItsCovariance) {
  Case c = MakeCase(WalkingScenario(2.0));
  // The delay is 5 ms off and knows that it may be: tracks and gyro put it right.
  c.input.calibration.delay_s += 0.005;
  c.input.calibration.covariance(kStateDelay, kStateDelay) = 1e-4;
  const auto start = InitialiseVins(c.input, SimulatorsNoise(c.scenario));
  ASSERT_TRUE(start);
  const double error_s = start->calibration.delay_s - c.simulated.truth.delay_s;
  EXPECT_LT(std::abs(error_s), 1.5e-3);
  EXPECT_LT(start->calibration.sigma()[kStateDelay], 1e-3);
}

// A calibration is off by what its total says, not by its noise.
TEST(InitialiseVins, CalibrationMovesWithinItsTotalCovariance) {
  Case c = MakeCase(WalkingScenario(2.0));
  c.input.calibration.delay_s += 0.005;
  c.input.calibration.covariance(kStateDelay, kStateDelay) = 1e-10;
  c.input.calibration.total_covariance = c.input.calibration.covariance;
  (*c.input.calibration.total_covariance)(kStateDelay, kStateDelay) = 1e-4;
  const auto start = InitialiseVins(c.input, SimulatorsNoise(c.scenario));
  ASSERT_TRUE(start);
  EXPECT_LT(std::abs(start->calibration.delay_s - c.simulated.truth.delay_s), 1.5e-3);
  EXPECT_FALSE(start->calibration.total_covariance.has_value());
}

VinsVerdict VerdictOf(const VinsInput& input) {
  const auto start = InitialiseVins(input);
  EXPECT_TRUE(start) << start.error().message;
  if (!start) return VinsVerdict::kNotConverged;
  EXPECT_FALSE(start->explanation.empty());
  return start->verdict;
}

TEST(InitialiseVins, MissingAccelerometerIsNamed) {
  Case c = MakeCase(WalkingScenario(2.0));
  VinsInput half = c.input;
  half.accel.resize(half.accel.size() / 2);
  EXPECT_EQ(VerdictOf(half), VinsVerdict::kNoAccelerometer);
  c.input.accel.clear();
  EXPECT_EQ(VerdictOf(c.input), VinsVerdict::kNoAccelerometer);
}

TEST(InitialiseVins, WrongAccelerometerIsNamed) {
  const Case c = MakeCase(WalkingScenario(2.0));
  const auto with = [&](auto change) {
    VinsInput input = c.input;
    for (AccelSample& sample : input.accel) change(&sample.accel_gyro_m_s2);
    return VerdictOf(input);
  };
  EXPECT_EQ(with([](Vector3d* a) { *a /= 9.80665; }), VinsVerdict::kAccelerometerImplausible);
  // Axes of another frame: gravity then moves as the phone turns.
  EXPECT_EQ(with([](Vector3d* a) { *a = Vector3d(a->z(), a->x(), a->y()); }),
            VinsVerdict::kAccelerometerImplausible);
  // Gravity points the wrong way: a sign convention.
  EXPECT_EQ(with([](Vector3d* a) { *a = -*a; }), VinsVerdict::kAccelerometerImplausible);
}

TEST(InitialiseVins, WrongDelayIsNoStart) {
  Case c = MakeCase(WalkingScenario(2.0));
  c.input.calibration.delay_s -= 0.045;
  const VinsVerdict verdict = VerdictOf(c.input);
  EXPECT_TRUE(verdict == VinsVerdict::kCalibrationImplausible ||
              verdict == VinsVerdict::kAccelerometerImplausible ||
              verdict == VinsVerdict::kNotConverged)
      << VinsVerdictName(verdict);
}

TEST(InitialiseVins, SteadyMotionHasNoScale) {
  Scenario scenario = WalkingScenario(2.0);
  scenario.motion.step_hz = 0.0;
  scenario.motion.sway_rms_m_s = 0.0;
  scenario.mount.p_gyro_cam_m.setZero();  // or turning alone moves the accelerometer
  EXPECT_EQ(VerdictOf(MakeCase(scenario).input), VinsVerdict::kTooLittleExcitation);
}

TEST(InitialiseVins, TurningOnTheSpotHasNoParallax) {
  Scenario scenario = WalkingScenario(2.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRotation);
  scenario.mount.p_gyro_cam_m.setZero();
  scenario.gyro.accel_noise_density_m_s2_rtHz = 0.2;  // shaken, but not moved
  const VinsVerdict verdict = VerdictOf(MakeCase(scenario).input);
  EXPECT_TRUE(verdict == VinsVerdict::kTooLittleParallax || verdict == VinsVerdict::kTooFewTracks)
      << VinsVerdictName(verdict);
}

TEST(InitialiseVins, TooFewDataAreNamed) {
  const Case c = MakeCase(WalkingScenario(2.0));
  VinsInput few = c.input;
  for (auto& points : few.tracks) points.resize(std::min<size_t>(points.size(), 10));
  EXPECT_EQ(VerdictOf(few), VinsVerdict::kTooFewTracks);
  VinsInput late = c.input;
  late.gyro.erase(late.gyro.begin(), late.gyro.begin() + 100);
  EXPECT_EQ(VerdictOf(late), VinsVerdict::kTooFewTracks);
  EXPECT_EQ(VerdictOf({c.input.calibration, {}, {}, {}, {}}), VinsVerdict::kTooFewTracks);
}

TEST(InitialiseVins, BadDataAreErrors) {
  const Case c = MakeCase(WalkingScenario(2.0));
  const auto refused = [&](auto change) {
    VinsInput input = c.input;
    change(&input);
    const auto start = InitialiseVins(input);
    return !start && start.error().kind == ErrorKind::kBadInput;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused([&](VinsInput* i) { i->gyro[5].omega_gyro_rad_s.x() = nan; }));
  EXPECT_TRUE(refused([&](VinsInput* i) { i->accel[5].accel_gyro_m_s2.x() = nan; }));
  EXPECT_TRUE(refused([&](VinsInput* i) { i->tracks[3][0].px.x() = nan; }));
  EXPECT_TRUE(refused([&](VinsInput* i) { i->calibration.lens[kFocal] = nan; }));
  EXPECT_TRUE(refused([&](VinsInput* i) { i->gyro[5].stamp_ns = i->gyro[4].stamp_ns; }));
  EXPECT_TRUE(refused([&](VinsInput* i) { i->frame_stamps_ns[5] = i->frame_stamps_ns[4]; }));
  EXPECT_TRUE(refused([&](VinsInput* i) { i->tracks.pop_back(); }));
}

TEST(FindStructure, CentresAreTheTrueOnesUpToScale) {
  Scenario scenario = WalkingScenario(2.0);
  scenario.tracks.noise_px = 0.05;
  const Case c = MakeCase(scenario);
  const auto window = MakeVinsWindow(c.input, 0.2);
  ASSERT_TRUE(window);
  const auto structure = FindStructure(*window);
  ASSERT_TRUE(structure) << structure.error().message;
  const auto camera_at = [&](const VinsKeyframe& k) {
    return c.simulated.camera->trajectory().At(SecondsSince(scenario.start_ns, window->origin_ns) +
                                               k.time_s);
  };
  const simulation::CameraState first = camera_at(window->keyframes[0]);
  const Eigen::Matrix3d R_cam_world = first.R_world_cam.transpose();
  const Eigen::Matrix3d R_world_cam = scenario.mount.q_gyro_cam.toRotationMatrix();
  Eigen::Matrix3Xd truth(3, structure->centres.cols());
  for (Eigen::Index k = 0; k < truth.cols(); ++k) {
    truth.col(k) =
        R_world_cam * R_cam_world *
        (camera_at(window->keyframes[static_cast<size_t>(k)]).p_world_m - first.p_world_m);
  }
  const double scale =
      truth.cwiseProduct(structure->centres).sum() / structure->centres.squaredNorm();
  EXPECT_GT(scale, 0.0);
  // 0.05 px of 650 px at 5 m is 0.4 mm; rotations by the gyro are good to 0.2 mrad.
  EXPECT_LT((scale * structure->centres - truth).colwise().norm().maxCoeff(), 0.01);

  const auto alignment =
      AlignWithInertial(*window, *structure, scenario.mount.p_gyro_cam_m, 0.01, 9.80665);
  ASSERT_TRUE(alignment) << alignment.error().message;
  EXPECT_NEAR(alignment->scale / scale, 1.0, 0.02);
  EXPECT_NEAR(alignment->free_gravity_m_s2, 9.80665, 0.2);
  EXPECT_NEAR(alignment->gravity_world.norm(), 9.80665, 1e-9);
}

}  // namespace
}  // namespace camgyro
