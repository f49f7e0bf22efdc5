// The bound against a second way to it: everything unknown in one dense matrix, differentiated by
// differences.
#include "tools/comparison/information_bound.h"

#include <gmock/gmock.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/pair_model.h"
#include "core/rotation_chain.h"
#include "core/so3.h"
#include "core/time.h"
#include "estimator/reference/implicit_ekf.h"
#include "estimator/window/gyro_noise.h"
#include "simulation/simulate.h"

namespace camgyro::comparison {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using simulation::Scenario;
using simulation::Simulated;

constexpr double kNoisePx = 0.5, kGyroSigma = 0.004;

struct Exact {
  Simulated s;
  std::vector<FramePair> pairs;
  StateVector prior_sigma;
};

// Matches without noise; readings without noise or bias walk, so that they are the truth.
Exact MakeExact(Scenario scenario) {
  scenario.tracks.noise_px = 0.0;
  scenario.gyro.noise_density_rad_s_rtHz = 0.0;
  scenario.gyro.bias_walk_rad_s2_rtHz = 0.0;
  scenario.gyro.accelerometer = false;
  Exact exact = {simulation::SimulateTracks(scenario).value(), {}, {}};
  exact.pairs = PairsFromTracks(exact.s.recording.tracks, 1);
  exact.prior_sigma = PaperStart(exact.s.truth).sigma;
  return exact;
}

Scenario Short() {
  Scenario scenario;
  scenario.duration_s = 0.1;
  scenario.margin_s = 0.05;
  scenario.gyro.rate_hz = 100.0;
  scenario.tracks.count = 12;
  return scenario;
}

std::vector<StateCovariance> BoundOf(const Exact& exact, double noise_px = kNoisePx,
                                     double gyro_sigma = kGyroSigma) {
  return InformationBound(exact.pairs, exact.s.recording, exact.s.truth, exact.prior_sigma,
                          noise_px, gyro_sigma);
}

// All residuals as a function of all unknowns: calibration (11), rates (3 per reading), two
// coordinates of each pair's direction.
class Everything {
 public:
  explicit Everything(const Exact& exact) : exact_(exact) {
    const auto& gyro = exact.s.recording.gyro;
    for (const GyroSample& sample : gyro) {
      times_.push_back(SecondsSince(gyro.front().stamp_ns, sample.stamp_ns));
    }
    x0_ = VectorXd::Zero(kStateSize + 3 * Readings() + 2 * Pairs());
    for (Eigen::Index i = 0; i < Readings(); ++i) {
      x0_.segment<3>(kStateSize + 3 * i) =
          gyro[static_cast<size_t>(i)].omega_gyro_rad_s - exact.s.truth.bias_gyro_rad_s;
    }
    // The direction in which the camera moves in the middle of a pair.
    for (Eigen::Index k = 0; k < Pairs(); ++k) {
      const FramePair& pair = exact.pairs[static_cast<size_t>(k)];
      const double middle_s = 0.5 * (Stamp(pair.frame_a) + Stamp(pair.frame_b)) +
                              exact.s.truth.delay_s + 0.5 * exact.s.truth.readout_s;
      const simulation::CameraState state = exact.s.camera->trajectory().At(middle_s);
      const Eigen::Matrix3d R_ref_cam =
          Chain(x0_).At(middle_s).R_ref_gyro * exact.s.truth.q_gyro_cam.toRotationMatrix();
      tau0_.push_back((R_ref_cam * state.R_world_cam.transpose() * state.v_world_m_s).normalized());
    }
  }
  const VectorXd& x0() const { return x0_; }

  VectorXd Residuals(const VectorXd& x) const {
    std::vector<double> r;
    for (Eigen::Index i = 0; i < Readings(); ++i) {
      const Vector3d e = x.segment<3>(kStateSize + 3 * i) + x.segment<3>(kStateBias) -
                         x0_.segment<3>(kStateSize + 3 * i);
      for (int k = 0; k < 3; ++k) r.push_back(e[k] / kGyroSigma);
    }
    for (Eigen::Index k = 0; k < Pairs(); ++k) {
      const FramePair& pair = exact_.pairs[static_cast<size_t>(k)];
      for (const Match& match : pair.matches) {
        // The noise at the truth, by differences too.
        double variance = 0.0;
        constexpr double kStep = 1e-4;
        for (int c = 0; c < 4; ++c) {
          Match plus = match, minus = match;
          (c < 2 ? plus.px_a : plus.px_b)[c % 2] += kStep;
          (c < 2 ? minus.px_a : minus.px_b)[c % 2] -= kStep;
          const double slope = (Numerator(k, plus, x0_) - Numerator(k, minus, x0_)) / (2 * kStep);
          variance += kNoisePx * kNoisePx * slope * slope;
        }
        r.push_back(Numerator(k, match, x) / std::sqrt(variance));
      }
    }
    return Eigen::Map<VectorXd>(r.data(), static_cast<Eigen::Index>(r.size()));
  }

 private:
  Eigen::Index Readings() const { return static_cast<Eigen::Index>(times_.size()); }
  Eigen::Index Pairs() const { return static_cast<Eigen::Index>(exact_.pairs.size()); }
  double Stamp(int frame) const {
    return SecondsSince(exact_.s.recording.gyro.front().stamp_ns,
                        exact_.s.recording.frames[static_cast<size_t>(frame)].stamp_ns);
  }
  RotationChain Chain(const VectorXd& x) const {
    return RotationChain(times_,
                         Eigen::Map<const Eigen::Matrix3Xd>(x.data() + kStateSize, 3, Readings()));
  }
  double Numerator(Eigen::Index k, const Match& match, const VectorXd& x) const {
    const Calibration& truth = exact_.s.truth;
    const FramePair& pair = exact_.pairs[static_cast<size_t>(k)];
    LensParameters lens = truth.lens;
    lens[kFocal] += x[kStateFocal];
    lens[kCx] += x[kStateCx];
    lens[kCy] += x[kStateCy];
    const ShutterParameters shutter(truth.readout_s + x[kStateReadout],
                                    truth.delay_s + x[kStateDelay]);
    const Eigen::Matrix3d R_gyro_cam =
        (truth.q_gyro_cam * Exp(Vector3d(x.segment<3>(kStateRotation)))).toRotationMatrix();
    const RotationChain chain = Chain(x);
    Bearing a, b;
    const Lens& model = GetLens(truth.distortion_model);
    EXPECT_TRUE(EvaluateBearing(model, lens, shutter, R_gyro_cam, chain, Stamp(pair.frame_a),
                                truth.height_px, match.px_a, &a));
    EXPECT_TRUE(EvaluateBearing(model, lens, shutter, R_gyro_cam, chain, Stamp(pair.frame_b),
                                truth.height_px, match.px_b, &b));
    const Vector3d& tau = tau0_[static_cast<size_t>(k)];
    const Vector3d t1 = tau.unitOrthogonal(), t2 = tau.cross(t1);
    const Vector2d turn = x.segment<2>(kStateSize + 3 * Readings() + 2 * k);
    return (tau + turn[0] * t1 + turn[1] * t2).dot(a.ray_ref.cross(b.ray_ref));
  }

  const Exact& exact_;
  std::vector<double> times_;
  std::vector<Vector3d> tau0_;
  VectorXd x0_;
};

TEST(InformationBound, IsTheInverseOfTheWholeInformation) {
  const Exact exact = MakeExact(Short());
  ASSERT_EQ(exact.pairs.size(), 3u);
  const Everything everything(exact);
  const VectorXd& x0 = everything.x0();
  const VectorXd r0 = everything.Residuals(x0);
  MatrixXd J(r0.size(), x0.size());
  for (Eigen::Index k = 0; k < x0.size(); ++k) {
    const double step = k < 3 ? 1e-3 : 1e-6;
    VectorXd plus = x0, minus = x0;
    plus[k] += step;
    minus[k] -= step;
    J.col(k) = (everything.Residuals(plus) - everything.Residuals(minus)) / (2 * step);
  }
  MatrixXd information = J.transpose() * J;
  information.diagonal().head<kStateSize>() += exact.prior_sigma.cwiseAbs2().cwiseInverse();
  const MatrixXd covariance = information.ldlt().solve(MatrixXd::Identity(x0.size(), x0.size()));
  const StateVector expected = covariance.diagonal().head<kStateSize>().cwiseSqrt();
  const StateVector bound = BoundOf(exact).back().diagonal().cwiseSqrt();
  // The direction of motion is not quite what the exact matches are perpendicular to.
  EXPECT_LT((bound.cwiseQuotient(expected).array() - 1.0).abs().maxCoeff(), 0.02)
      << bound.cwiseQuotient(expected).transpose();
  // And the data say something: the delay is better known than before.
  EXPECT_LT(bound[kStateDelay], 0.9 * exact.prior_sigma[kStateDelay]);
}

TEST(InformationBound, ShrinksWithEveryPairAndScalesWithNoise) {
  Scenario scenario = Short();
  scenario.duration_s = 2.0;
  scenario.tracks.count = 40;
  const Exact exact = MakeExact(scenario);
  const auto bounds = BoundOf(exact);
  ASSERT_EQ(bounds.size(), exact.pairs.size());
  StateVector last = exact.prior_sigma.cwiseAbs2();
  for (const StateCovariance& bound : bounds) {
    EXPECT_LE((bound.diagonal() - last).cwiseQuotient(last).maxCoeff(), 1e-9);
    last = bound.diagonal();
  }
  // With all noise halved and hardly any prior, sigmas halve.
  Exact free = exact;
  free.prior_sigma *= 1e3;
  const StateVector whole = BoundOf(free).back().diagonal().cwiseSqrt();
  const StateVector half =
      BoundOf(free, 0.5 * kNoisePx, 0.5 * kGyroSigma).back().diagonal().cwiseSqrt();
  EXPECT_LT((half.cwiseQuotient(whole).array() - 0.5).abs().maxCoeff(), 0.01);
}

// What the motion does not determine keeps its prior: rotation about one axis only leaves the part
// of q_c about that axis, and nothing else, as it was.
TEST(InformationBound, KnowsWhatTheMotionDoesNotDetermine) {
  Scenario scenario = Short();
  scenario.duration_s = 2.0;
  scenario.tracks.count = 40;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kSingleAxis);
  const Exact exact = MakeExact(scenario);
  const StateVector ratio =
      BoundOf(exact).back().diagonal().cwiseSqrt().cwiseQuotient(exact.prior_sigma);
  EXPECT_GT(ratio[kStateRotation + 1], 0.95);  // about the camera's y axis
  EXPECT_LT(ratio[kStateDelay], 0.3);
}

// Without translation there is no direction: the bound is still finite and informed.
TEST(InformationBound, CopesWithPureRotation) {
  Scenario scenario = Short();
  scenario.duration_s = 1.0;
  scenario.tracks.count = 40;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRotation);
  const Exact exact = MakeExact(scenario);
  const StateVector sigma = BoundOf(exact).back().diagonal().cwiseSqrt();
  ASSERT_TRUE(sigma.allFinite());
  EXPECT_LT(sigma[kStateFocal], 10.0);
  EXPECT_GT(sigma[kStateFocal], 0.1);
  EXPECT_LT(sigma[kStateDelay], 0.3 * exact.prior_sigma[kStateDelay]);
}

}  // namespace
}  // namespace camgyro::comparison
