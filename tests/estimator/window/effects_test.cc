// Every effect of core/effects against the simulator, which models it on its own: noise-free
// pixels fit with the effect at its true size, and do not fit without.
#include <gmock/gmock.h>

#include <cmath>

#include "core/linear_algebra.h"
#include "core/so3.h"
#include "estimator/window/direction_search.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_view.h"
#include "factors/coplanarity_plane.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

struct Case {
  std::string name;       // as for --effects
  std::string overrides;  // of the scenario, separated by |
  std::vector<double> values;
  double gain = 10.0;      // the effect lowers the residual by more than this
  double delay_s = 0.015;  // that fits, where the effect has a part in it
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class EffectAgainstSimulator : public testing::TestWithParam<Case> {};

// Rms of the plane residuals in pixels, with the direction and its turn that fit each pair best.
double Rms(const EstimationInput& input, const Calibration& calibration) {
  PairGraphOptions options;
  options.robust_threshold = 0.0;
  options.gyro_sigma_rad_s.setConstant(1e-3);
  double sum_sq = 0.0;
  int count = 0;
  PairView view;
  for (size_t i = 0; i < input.pairs.size(); i += 7) {
    EXPECT_TRUE(ViewPair(input, input.pairs[i], calibration, 0.05, options, &view));
    const DirectionEstimate found = FindDirection(view.bearings, 0.0025, 0.0025, 0.0);
    // The bend: one linear step.
    const PairMeasurement& m = view.measurement;
    Eigen::MatrixXd J(m.matches.size(), 9);
    Eigen::VectorXd r(m.matches.size());
    for (size_t k = 0; k < m.matches.size(); ++k) {
      const Bearing &a = view.bearings.a[k], &b = view.bearings.b[k];
      const PlaneResidual residual = EvaluatePlaneResidual(a.ray_ref, a.J_ray_px, b.ray_ref,
                                                           b.J_ray_px, found.tau, 0.0025, 0.0025);
      const auto row = static_cast<Eigen::Index>(k);
      r[row] = residual.value;
      const Eigen::Vector2d shares = CoplanarityPlane::BendShares(m, m.matches[k]);
      J.row(row) << residual.by_tau.transpose(), shares[0] * residual.by_tau.transpose(),
          shares[1] * residual.by_tau.transpose();
    }
    r -= J * LeastSquares(J, r);
    sum_sq += 0.0025 * r.squaredNorm();
    count += static_cast<int>(r.size());
  }
  return std::sqrt(sum_sq / count);
}

TEST_P(EffectAgainstSimulator, FitsItsPixels) {
  const Case& test = GetParam();
  std::vector<std::string> overrides = {"duration_s=9",
                                        "seed=4",
                                        "tracks.noise_px=0",
                                        "gyro.rate_hz=400",
                                        "gyro.noise_density_rad_s_rtHz=0",
                                        "motion.kind=walking",
                                        "gyro.bias_walk_rad_s2_rtHz=0"};
  for (size_t begin = 0; begin < test.overrides.size();) {
    const size_t end = std::min(test.overrides.find('|', begin), test.overrides.size());
    overrides.push_back(test.overrides.substr(begin, end - begin));
    begin = end + 1;
  }
  const auto scenario = simulation::ParseScenario("", overrides);
  ASSERT_TRUE(scenario) << scenario.error().message;
  const auto simulated = simulation::SimulateTracks(*scenario);
  ASSERT_TRUE(simulated) << simulated.error().message;
  const EstimationInput input = MakeEstimationInput(simulated->recording);
  Calibration calibration = simulated->truth;
  calibration.delay_s = test.delay_s;
  calibration.lens = MakePinhole(650.0, {359.5, 239.5});
  if (test.name == "readout_direction") calibration.readout_s = 0.0;
  const double without = Rms(input, calibration);

  const Result<EffectSet> effects =
      MakeEffects(test.name, MakeEffectSetup(simulated->recording, calibration));
  ASSERT_TRUE(effects) << effects.error().message;
  calibration.effects = std::make_shared<const EffectSet>(*effects);
  calibration.effect_values = Eigen::Map<const Eigen::VectorXd>(
      test.values.data(), static_cast<Eigen::Index>(test.values.size()));
  ASSERT_EQ(effects->size(), calibration.effect_values.size());
  if (test.name == "bias_drift:linear") {  // the bias is then that of the middle
    const double middle_s = 0.5 * (input.pairs.front().time_a_s + input.pairs.back().time_b_s);
    calibration.bias_gyro_rad_s += (middle_s + test.delay_s) * calibration.effect_values;
  }
  if (test.name == "gyro_g_sensitivity") {  // and that under the mean force
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const AccelSample& sample : simulated->recording.accel) {
      mean += sample.accel_gyro_m_s2 / static_cast<double>(simulated->recording.accel.size());
    }
    calibration.bias_gyro_rad_s += mean.cwiseProduct(calibration.effect_values.head<3>());
  }
  const double with = Rms(input, calibration);
  EXPECT_LT(with, without / test.gain) << "without " << without << " px, with " << with << " px";
}

INSTANTIATE_TEST_SUITE_P(
    Catalogue, EffectAgainstSimulator,
    testing::Values(
        Case{"radial_distortion", "effects.radial_distortion={k1: -0.14,k2: 0.03}", {-0.14, 0.03}},
        Case{"tangential_distortion",
             "effects.tangential_distortion={p1: 0.002,p2: -0.003}",
             {0.002, -0.003}},
        Case{"aspect_ratio", "effects.aspect_ratio={ratio: 1.012}", {0.012}},
        Case{"focal_drift:linear", "effects.focal_drift={rate_px_s: 2}", {2.0}},
        Case{"optical_stabilisation:0.5",
             "effects.optical_stabilisation={gain: 0.4,corner_hz: 0.5}",
             {0.4 * 650.0, 0.0, 0.0, 0.0, 0.0}},
        // Of another shape, to first order.
        Case{"optical_stabilisation:0.45",
             "effects.optical_stabilisation={gain: 0.4,corner_hz: 0.5}",
             {0.4 * 650.0, 0.4 * 650.0 * std::log(0.5 / 0.45), 0.0, 0.0, 0.0}},
        Case{"clock_skew", "effects.clock_skew={ppm: 400}", {400.0}},
        Case{"delay_step:5", "effects.delay_step={time_s: 5.0,step_s: 0.01}", {0.01}},
        Case{"readout_direction", "effects.readout_direction={columns: true}", {0.02}},
        Case{"readout_nonlinear", "effects.readout_nonlinear={curve: 0.06}", {0.06 * 0.02}},
        Case{"gyro_scale", "effects.gyro_scale={error: [0.015,-0.01,0.02]}", {0.015, -0.01, 0.02}},
        Case{"gyro_misalignment",
             "effects.gyro_misalignment={xy: 0.01,xz: -0.008,yz: 0.006}",
             {0.01, -0.008, 0.006}},
        // The time constant is in the delay.
        Case{"gyro_lowpass",
             "effects.gyro_lowpass={time_constant_s: 0.016}",
             {2.56e-4},
             30.0,
             0.031},
        Case{"gyro_axis_delay",
             "effects.gyro_axis_delay={y_after_x_s: 0.015,z_after_x_s: -0.01}",
             {0.015, -0.01},
             100.0},
        Case{"bias_drift:linear",
             "effects.bias_drift={rate_rad_s2: [0.005,-0.003,0.002]}",
             {0.005, -0.003, 0.002}},
        Case{"gyro_g_sensitivity",
             "effects.gyro_g_sensitivity={factor_rad_s_m: [0.001,-0.0008,0.0006]}",
             {0.001, -0.0008, 0.0006}},
        // The path through the exposure is averaged, too, and fourth order is neglected.
        Case{"exposure_lowpass",
             "effects.exposure_lowpass={factor: 1}|camera.exposure_s=0.02|motion.kind=running",
             {1.0},
             3.0},
        Case{"exposure_delay",
             "effects.exposure_delay={factor: 0.5}|camera.exposure_s=0.012|"
             "camera.exposure_swing=0.8",
             {0.5}}),
    [](const auto& tested) {
      std::string name = tested.param.name;
      for (char& c : name) {
        if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
      }
      return name;
    });

// One pixel without a ray leaves a pair without residuals, and a solve without a start.
TEST(EffectOfALens, LeavesOutPixelsWithoutARayIfAsked) {
  Prior prior;
  Calibration& start = prior.mean;
  start.width_px = 640;
  start.height_px = 480;
  start.lens = MakePinhole(400.0, {319.5, 239.5});
  prior.sigma.setOnes();
  const Result<EffectSet> effects = MakeEffects("radial_distortion:radtan", EffectSetup());
  ASSERT_TRUE(effects) << effects.error().message;
  start.effects = std::make_shared<const EffectSet>(*effects);
  start.effect_values = Eigen::Vector2d(-0.5, 0.0);  // folds 218 px from the centre
  std::vector<Match> matches;
  for (int i = 0; i < 12; ++i) {
    matches.push_back({{220.0 + 20.0 * i, 200.0 + 7.0 * i}, {223.0 + 20.0 * i, 205.0 + 7.0 * i}});
  }
  matches[3].px_b << 5.0, 5.0;
  for (const bool drop : {false, true}) {
    PairGraphOptions options;
    options.drop_without_ray = drop;
    PairGraph graph(start, prior, options);
    for (int i = 0; i < 100; ++i) graph.AddRate({0.005 * i, {0.3, 0.1, 0.0}});
    TimedPair pair;
    pair.time_a_s = 0.2;
    pair.time_b_s = 0.2 + 1.0 / 30.0;
    pair.matches = matches;
    ASSERT_EQ(graph.AddPair(pair), AddPairResult::kAdded);
    EXPECT_EQ(graph.Residuals(0, false).size(), drop ? 11U : 0U);
  }
}

}  // namespace
}  // namespace camgyro
