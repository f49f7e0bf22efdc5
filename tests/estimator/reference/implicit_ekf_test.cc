// The reference filter against the paper's equations: start, prediction, measurement, update.
#include "estimator/reference/implicit_ekf.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/so3.h"
#include "estimator/reference/calibrate_with_ekf.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using simulation::Scenario;
using simulation::Simulated;

// Running at 30 frames/s, 200 Hz, 60 tracks. The paper's tracker is KLT: 0.05 px.
Simulated RunningScene(double duration_s, double noise_px) {
  Scenario scenario;
  scenario.duration_s = duration_s;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
  scenario.tracks.count = 60;
  scenario.tracks.noise_px = noise_px;
  scenario.gyro.accelerometer = false;
  return simulation::SimulateTracks(scenario).value();
}

// Off the truth by about one of the paper's standard deviations in everything.
Prior StartNear(const Calibration& truth) {
  Prior prior{truth, PaperStart(truth).sigma};
  Calibration& start = prior.mean;
  const StateVector& sigma = prior.sigma;
  start.lens[kFocal] += sigma[kStateFocal];
  start.lens[kCx] -= sigma[kStateCx];
  start.lens[kCy] += sigma[kStateCy];
  start.readout_s += sigma[kStateReadout];
  start.delay_s -= sigma[kStateDelay];
  start.bias_gyro_rad_s += Vector3d(1, -1, 1).cwiseProduct(sigma.segment<3>(kStateBias));
  start.q_gyro_cam = start.q_gyro_cam * Exp(Vector3d(-0.0134, 0.0134, 0.0134));
  return prior;
}

// A filter that has read the whole gyro and made one prediction and update with the first pair.
struct FirstPair {
  explicit FirstPair(const Simulated& s, const EkfOptions& options = {})
      : input(MakeEstimationInput(s.recording)), filter(StartNear(s.truth), options) {
    for (const TimedRate& rate : input.rates) {
      filter.AddReading(rate.time_s, rate.omega_gyro_rad_s);
    }
  }
  ImplicitEkf::UpdateResult Update(size_t i) {
    const TimedPair& pair = input.pairs[i];
    return filter.Update(pair.time_a_s, pair.time_b_s, pair.matches);
  }
  EstimationInput input;
  ImplicitEkf filter;
};

TEST(PaperStart, IsSectionVC) {
  Calibration guess;
  guess.width_px = 720;
  guess.height_px = 480;
  guess.lens = MakePinhole(650.0, {300.0, 200.0});
  guess.delay_s = 1.0;
  const Prior prior = PaperStart(guess);
  const Calibration& start = prior.mean;
  EXPECT_EQ(start.lens[kFocal], 650.0);
  EXPECT_EQ(start.lens[kCx], 359.5);
  EXPECT_EQ(start.lens[kCy], 239.5);
  EXPECT_EQ(start.readout_s, 0.0275);
  EXPECT_EQ(start.delay_s, 0.0);
  EXPECT_TRUE(start.bias_gyro_rad_s.isZero(0.0));
  const ImplicitEkf filter(prior, {});
  VectorXd sigma(12);
  sigma << 20, 6.67, 6.67, 0.00167, 0.01, 0.0067, 0.0067, 0.0067, 0.0067, 0.0067, 0.0067, 0.0067;
  EXPECT_LT((filter.covariance().diagonal().cwiseSqrt() - sigma).norm(), 1e-12);
  // Half the rotation vector is the quaternion's vector part: 0.0067 there is 0.0134 rad.
  EXPECT_NEAR(filter.Estimate().sigma()[kStateRotation], 0.0134, 1e-9);
}

// Readings that appear for the first time are w = measured - b + n, eq. (8) in our sign; those that
// stay keep value and correlations.
TEST(ImplicitEkf, PredictsAsPrinted) {
  const Simulated s = RunningScene(0.5, 0.05);
  EkfOptions options;
  options.gate_sigmas = 1e-9;  // no measurement passes: predictions only
  options.bias_walk_rad_s2_rtHz = 1e-3;
  FirstPair run(s, options);
  ASSERT_EQ(run.Update(0), ImplicitEkf::UpdateResult::kUpdated);
  const int kB = ImplicitEkf::kBg, kW = ImplicitEkf::kRates;
  VectorXd x = run.filter.state();
  MatrixXd P = run.filter.covariance();
  const Vector3d bias = x.segment<3>(kB);
  const auto is_reading = [&](const Vector3d& rate) {
    for (const TimedRate& r : run.input.rates) {
      if ((r.omega_gyro_rad_s - bias - rate).norm() < 1e-12) return true;
    }
    return false;
  };
  for (int n = 0; n < run.filter.num_rates(); ++n)
    EXPECT_TRUE(is_reading(x.segment<3>(kW + 3 * n)));
  const double var_b = 0.0067 * 0.0067, var_g = 0.003 * 0.003;
  EXPECT_NEAR(P(kW, kW), var_b + var_g, 1e-12);
  EXPECT_NEAR(P(kW, kB), -var_b, 1e-12);
  EXPECT_NEAR(P(kW, kW + 3), var_b, 1e-12);  // both through the bias
  EXPECT_NEAR(P(kW, kW + 1), 0.0, 1e-12);    // another axis

  const VectorXd last_rate = x.tail<3>();
  ASSERT_EQ(run.Update(1), ImplicitEkf::UpdateResult::kUpdated);
  x = run.filter.state();
  P = run.filter.covariance();
  // 33.3 ms of 200 Hz and a readout of 20 ms: states of 11 to 13 readings, 5 to 7 of them new.
  int overlap = -1;
  for (int n = 0; n < run.filter.num_rates(); ++n) {
    if ((x.segment<3>(kW + 3 * n) - last_rate).norm() < 1e-15) overlap = n + 1;
  }
  EXPECT_THAT(overlap, testing::AllOf(testing::Ge(4), testing::Le(8)));
  const double walked = 1e-6 / 30.0;  // (1e-3)^2 * interval
  EXPECT_NEAR(P(kB, kB), var_b + walked, 1e-13);
  EXPECT_NEAR(P(kW, kW), var_b + var_g, 1e-13);  // stayed: its bias was the old one
  const auto newest = P.rows() - 3;
  EXPECT_NEAR(P(newest, newest), var_b + walked + var_g, 1e-13);
  EXPECT_NEAR(P(kW, newest), var_b, 1e-13);
}

// Eq. (4) holds for exact matches at the truth, but for the direction of translation that is not
// quite constant over a readout while running: small against what 1 px makes of the determinant.
TEST(ImplicitEkf, MeasurementVanishesAtTheTruth) {
  Scenario scenario;
  scenario.duration_s = 0.2;
  scenario.tracks.noise_px = 0.0;
  scenario.gyro.noise_density_rad_s_rtHz = 0.0;
  scenario.gyro.bias_walk_rad_s2_rtHz = 0.0;
  scenario.gyro.rate_hz = 1000.0;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const EstimationInput input = MakeEstimationInput(s.recording);
  const Prior truth{s.truth, PaperStart(s.truth).sigma};
  EkfOptions options;
  options.gate_sigmas = 1e-9;
  ImplicitEkf filter(truth, options);
  for (const TimedRate& rate : input.rates) filter.AddReading(rate.time_s, rate.omega_gyro_rad_s);
  const TimedPair& pair = input.pairs[2];
  ASSERT_EQ(filter.Update(pair.time_a_s, pair.time_b_s, pair.matches),
            ImplicitEkf::UpdateResult::kUpdated);
  ImplicitEkf::Measurement z;
  const ImplicitEkf::Pair group = {
      pair.time_a_s, pair.time_b_s, pair.matches, {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {9, 10, 11}}};
  ASSERT_TRUE(filter.Measure(group, filter.state(), &z));
  const VectorXd in_sigmas = z.h.cwiseQuotient(z.variance.cwiseSqrt());
  EXPECT_LT(in_sigmas.cwiseAbs().maxCoeff(), 0.05);
  VectorXd off = filter.state();
  off[ImplicitEkf::kTd] += 0.01;
  ASSERT_TRUE(filter.Measure(group, off, &z));
  EXPECT_GT(z.h.cwiseQuotient(z.variance.cwiseSqrt()).cwiseAbs().maxCoeff(), 0.2);
}

struct MeasuredPair {
  MeasuredPair() : s(RunningScene(0.3, 0.5)), run(s) {
    EXPECT_EQ(run.Update(1), ImplicitEkf::UpdateResult::kUpdated);
    const TimedPair& timed = run.input.pairs[1];
    pair = {timed.time_a_s, timed.time_b_s, timed.matches, {{0, 5, 9}, {3, 17, 30}, {40, 2, 21}}};
  }
  Simulated s;
  FirstPair run;
  ImplicitEkf::Pair pair;
};

TEST(ImplicitEkf, MeasurementJacobianMatchesDifferences) {
  const MeasuredPair m;
  const VectorXd x = m.run.filter.state();
  ImplicitEkf::Measurement z, plus, minus;
  ASSERT_TRUE(m.run.filter.Measure(m.pair, x, &z));
  for (int k = 0; k < x.size(); ++k) {
    const double step = 1e-6 * (1.0 + std::abs(x[k]));
    VectorXd moved = x;
    moved[k] = x[k] + step;
    ASSERT_TRUE(m.run.filter.Measure(m.pair, moved, &plus));
    moved[k] = x[k] - step;
    ASSERT_TRUE(m.run.filter.Measure(m.pair, moved, &minus));
    const VectorXd numeric = (plus.h - minus.h) / (2.0 * step);
    EXPECT_LT((z.H.col(k) - numeric).norm(), 1e-4 * numeric.norm() + 1e-12) << "state row " << k;
  }
}

// The variance of a determinant under detection errors of all six rays, by drawing them. The error
// of a ray does not move its row's time in (9): with a readout of zero it cannot.
TEST(ImplicitEkf, NoiseOfAllSixRaysEnters) {
  MeasuredPair m;
  VectorXd x = m.run.filter.state();
  x[ImplicitEkf::kTr] = 0.0;
  ImplicitEkf::Measurement z, drawn;
  ASSERT_TRUE(m.run.filter.Measure(m.pair, x, &z));
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, 0.1);  // small: first order; 1 px is assumed
  const int kDraws = 4000;
  VectorXd sum_sq = VectorXd::Zero(3);
  for (int i = 0; i < kDraws; ++i) {
    ImplicitEkf::Pair noisy = m.pair;
    for (Match& match : noisy.matches) {
      match.px_a += Eigen::Vector2d{normal(random), normal(random)};
      match.px_b += Eigen::Vector2d{normal(random), normal(random)};
    }
    ASSERT_TRUE(m.run.filter.Measure(noisy, x, &drawn));
    sum_sq += (drawn.h - z.h).cwiseAbs2();
  }
  const VectorXd ratio = (sum_sq / kDraws / 0.01).cwiseQuotient(z.variance);
  // A variance from 4000 draws is known to 1/sqrt(2000) = 2.2 %.
  EXPECT_LT((ratio.array() - 1.0).abs().maxCoeff(), 0.10) << ratio.transpose();
}

// The update of a filter with one measurement, by hand.
TEST(ImplicitEkf, UpdatesAsTheTextbookDoes) {
  const Simulated s = RunningScene(0.3, 0.5);
  EkfOptions options;
  options.triplets = 1;
  FirstPair run(s, options);
  EkfOptions closed = options;
  closed.gate_sigmas = 1e-9;
  FirstPair predicted(s, closed);
  // Three matches leave the filter no choice of features.
  TimedPair pair = run.input.pairs[0];
  pair.matches = {pair.matches[4], pair.matches[20], pair.matches[33]};
  ASSERT_EQ(run.filter.Update(pair.time_a_s, pair.time_b_s, pair.matches),
            ImplicitEkf::UpdateResult::kUpdated);
  ASSERT_EQ(predicted.filter.Update(pair.time_a_s, pair.time_b_s, pair.matches),
            ImplicitEkf::UpdateResult::kUpdated);
  const VectorXd x = predicted.filter.state();
  const MatrixXd P = predicted.filter.covariance();
  ImplicitEkf::Measurement z;
  ASSERT_TRUE(
      predicted.filter.Measure({pair.time_a_s, pair.time_b_s, pair.matches, {{0, 1, 2}}}, x, &z));
  const double S = (z.H * P * z.H.transpose())(0, 0) + z.variance[0];
  const VectorXd K = P * z.H.transpose() / S;
  VectorXd expected = x - K * z.h[0];
  expected.segment<4>(ImplicitEkf::kQc).normalize();
  const MatrixXd expected_P = P - K * z.H * P;
  const VectorXd sigma = P.diagonal().cwiseSqrt();
  EXPECT_LT((run.filter.state() - expected).cwiseQuotient(sigma).norm(), 1e-9);
  EXPECT_LT((sigma.cwiseInverse().asDiagonal() * (run.filter.covariance() - expected_P) *
             sigma.cwiseInverse().asDiagonal())
                .norm(),
            1e-9);
  EXPECT_GT((expected - x).cwiseQuotient(sigma).norm(), 1e-3);  // something moved
}

// In the regime of the paper's experiments, tracks much better than the assumed 1 px, the filter
// does what the paper says.
TEST(ImplicitEkf, ConvergesWithGoodTracks) {
  const Simulated s = RunningScene(6.0, 0.05);
  const EkfRun run =
      RunEkf(MakeEstimationInput(s.recording), s.recording.frames, StartNear(s.truth), {});
  EXPECT_EQ(run.skipped_pairs, 0);
  ASSERT_EQ(run.trace.size(), 180u);
  EXPECT_EQ(run.trace.back().frame_stamp_ns, s.recording.frames.back().stamp_ns);
  const Calibration& estimate = run.trace.back().estimate;
  const StateVector error = Difference(estimate, s.truth);
  EXPECT_LT(error.cwiseQuotient(estimate.sigma()).cwiseAbs().maxCoeff(), 3.5) << error.transpose();
  EXPECT_LT(std::abs(error[kStateFocal]), 3.0);     // from 20 px
  EXPECT_LT(std::abs(error[kStateDelay]), 0.5e-3);  // from 10 ms
  EXPECT_LT(std::abs(error[kStateReadout]), 0.7e-3);
  EXPECT_LT(error.tail<3>().norm(), 8e-3);  // from 23 mrad
  // Again: the same numbers.
  const EkfRun again =
      RunEkf(MakeEstimationInput(s.recording), s.recording.frames, StartNear(s.truth), {});
  EXPECT_EQ(Difference(again.trace.back().estimate, estimate).norm(), 0.0);
}

// Iterations linearise anew: the first pairs, far from the truth, are used better.
TEST(ImplicitEkf, IterationsHelpFarFromTheTruth) {
  const Simulated s = RunningScene(0.3, 0.05);
  const auto final_error = [&](int iterations) {
    EkfOptions options;
    options.sigma_px = 0.05;
    options.iterations = iterations;
    const EkfRun run =
        RunEkf(MakeEstimationInput(s.recording), s.recording.frames, StartNear(s.truth), options);
    return Difference(run.trace.back().estimate, s.truth)
        .cwiseQuotient(PaperStart(s.truth).sigma)
        .norm();
  };
  EXPECT_LT(final_error(5), final_error(1));
}

// Near the truth, a determinant of matches that are 100 px off is no innovation to believe.
TEST(ImplicitEkf, GateDropsGrossOutliers) {
  const Simulated s = RunningScene(0.3, 0.05);
  const EstimationInput input = MakeEstimationInput(s.recording);
  const Prior start{s.truth, 0.01 * PaperStart(s.truth).sigma};
  const auto moved_sigmas = [&](double gate, double off_px) {
    EkfOptions options;
    options.triplets = 1;
    options.sigma_px = 0.1;
    options.gate_sigmas = gate;
    ImplicitEkf filter(start, options);
    for (const TimedRate& rate : input.rates) filter.AddReading(rate.time_s, rate.omega_gyro_rad_s);
    TimedPair pair = input.pairs[0];
    pair.matches = {pair.matches[4], pair.matches[20], pair.matches[33]};
    pair.matches[0].px_b.y() += off_px;
    pair.matches[1].px_b.x() += off_px;
    pair.matches[2].px_b -= Eigen::Vector2d(off_px, 0.5 * off_px);
    EXPECT_EQ(filter.Update(pair.time_a_s, pair.time_b_s, pair.matches),
              ImplicitEkf::UpdateResult::kUpdated);
    return Difference(filter.Estimate(), start.mean).cwiseQuotient(start.sigma).norm();
  };
  EXPECT_GT(moved_sigmas(0.0, 100.0), 0.01);
  EXPECT_EQ(moved_sigmas(3.0, 100.0), 0.0);
  EXPECT_GT(moved_sigmas(3.0, 0.0), 0.0);
}

TEST(ImplicitEkf, SaysWhyAPairIsNotUsed) {
  using UpdateResult = ImplicitEkf::UpdateResult;
  const Simulated s = RunningScene(0.3, 0.05);
  const EstimationInput input = MakeEstimationInput(s.recording);
  const TimedPair& pair = input.pairs[0];
  ImplicitEkf filter(StartNear(s.truth), {});
  EXPECT_EQ(filter.Update(pair.time_a_s, pair.time_b_s, pair.matches), UpdateResult::kGyroTooLate);
  for (const TimedRate& rate : input.rates) filter.AddReading(rate.time_s, rate.omega_gyro_rad_s);
  EXPECT_EQ(filter.Update(pair.time_a_s - 2.0, pair.time_b_s - 2.0, pair.matches),
            UpdateResult::kGyroTooEarly);
  EXPECT_EQ(filter.Update(pair.time_a_s, pair.time_b_s, {pair.matches[0], pair.matches[1]}),
            UpdateResult::kTooFewMatches);
  // Three times the same feature has no cross product: nothing to learn, and nothing to divide by.
  const Match still = {{100, 100}, {100, 100}};
  const VectorXd q = filter.state().segment<4>(ImplicitEkf::kQc);
  EXPECT_EQ(filter.Update(pair.time_a_s, pair.time_b_s, {still, still, still}),
            UpdateResult::kNotPositive);
  EXPECT_EQ(filter.state().segment<4>(ImplicitEkf::kQc), q);
  EXPECT_EQ(filter.Update(pair.time_a_s, pair.time_b_s, pair.matches), UpdateResult::kUpdated);
}

TEST(CalibrateWithEkf, RefusesWhatHasNoRotation) {
  Scenario scenario;
  scenario.duration_s = 3.0;
  scenario.motion.rotation_rms_rad_s.setZero();
  scenario.gyro.accelerometer = false;
  const Simulated s = simulation::SimulateTracks(scenario).value();
  const auto none = [](const Recording&, const std::vector<RotationTrial>& trials) {
    return std::vector<std::vector<CameraRotation>>(trials.size());
  };
  const auto report = CalibrateWithEkf(s.recording, none, {}, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::kCannotEstimate);
}

}  // namespace
}  // namespace camgyro
