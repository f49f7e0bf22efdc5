// Times of what an estimator does most: camgyro_timing [--benchmark_filter=REGEX].
// One pair of frames has 100 matches and some 15 rates (200 Hz, 30 frames/s, 20 ms readout).
#include <benchmark/benchmark.h>
#include <glog/logging.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "core/pair_model.h"
#include "core/rotation_chain.h"
#include "estimator/reference/implicit_ekf.h"
#include "estimator/window/direction_search.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/sliding_window.h"
#include "factors/coplanarity_determinant.h"
#include "factors/coplanarity_plane.h"
#include "factors/symmetric_transfer.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

using simulation::Simulated;

Simulated MakeRecording(double duration_s) {
  simulation::Scenario scenario;
  scenario.duration_s = duration_s;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.tracks.count = 110;  // some are lost from one frame to the next
  scenario.tracks.noise_px = 0.5;
  scenario.gyro.accelerometer = false;
  return simulation::SimulateTracks(scenario).value();
}

// The first pair of a recording with its rates, as the factors want it, at the truth.
struct OnePair {
  OnePair() {
    const Simulated s = MakeRecording(0.1);
    truth = s.truth;
    const EstimationInput input = MakeEstimationInput(s.recording);
    const TimedPair& timed = input.pairs[0];
    pair->matches = timed.matches;
    pair->matches.resize(std::min<size_t>(100, pair->matches.size()));
    pair->frame_a = timed.first();
    pair->frame_b = timed.second();
    pair->size_px << truth.width_px, truth.height_px;
    pair->sigma = 0.5;
    pair->robust_threshold = 2.5;
    pair->lens = &GetLens(truth.distortion_model);
    const double from = timed.time_a_s + truth.delay_s - 0.01;
    const double to = timed.time_b_s + truth.delay_s + truth.readout_s + 0.01;
    std::vector<Eigen::Vector3d> inside;
    for (const TimedRate& rate : input.rates) {
      if (rate.time_s < from || rate.time_s > to) continue;
      pair->rate_times_s.push_back(rate.time_s);
      inside.push_back(rate.omega_gyro_rad_s - truth.bias_gyro_rad_s);
    }
    rates.resize(3, static_cast<Eigen::Index>(inside.size()));
    for (size_t i = 0; i < inside.size(); ++i) rates.col(static_cast<Eigen::Index>(i)) = inside[i];
    pair->rate_group_sizes = {static_cast<int>(inside.size())};
    shutter << truth.readout_s, truth.delay_s;
    lens = truth.lens;
    q_gyro_cam = truth.q_gyro_cam;
  }

  // Pointers in the order of `factor`; tau and turn where it has them.
  std::vector<double*> Parameters(bool with_direction) {
    std::vector<double*> p = {lens.data(), shutter.data(), q_gyro_cam.coeffs().data()};
    if (with_direction) {
      p.push_back(tau.data());
      p.push_back(turn.data());
    }
    p.push_back(rates.data());
    return p;
  }
  RotationChain Chain() const { return RotationChain(pair->rate_times_s, rates); }

  std::shared_ptr<PairMeasurement> pair = std::make_shared<PairMeasurement>();
  Calibration truth;
  LensParameters lens;
  ShutterParameters shutter;
  Eigen::Quaterniond q_gyro_cam;
  Eigen::Vector3d tau = Eigen::Vector3d::UnitZ(), turn = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd rates;
};

void RotationChainOfAPair(benchmark::State& state) {
  const OnePair one;
  for (auto _ : state) benchmark::DoNotOptimize(one.Chain());
}
BENCHMARK(RotationChainOfAPair);

// Both observations of every match. Argument: with derivatives.
void BearingsOfAPair(benchmark::State& state) {
  OnePair one;
  const RotationChain chain = one.Chain();
  PairBearings bearings;
  for (auto _ : state) {
    CHECK(EvaluatePairBearings(*one.pair, chain, one.lens.data(), one.shutter.data(),
                               one.q_gyro_cam.coeffs().data(), nullptr, state.range(0) != 0,
                               &bearings));
    benchmark::DoNotOptimize(bearings);
  }
}
BENCHMARK(BearingsOfAPair)->Arg(0)->Arg(1)->ArgName("derivatives");

void EvaluateFactor(benchmark::State& state, const ceres::CostFunction& factor,
                    std::vector<double*> parameters) {
  std::vector<double> residuals(static_cast<size_t>(factor.num_residuals()));
  std::vector<std::vector<double>> storage;
  std::vector<double*> jacobians;
  for (const int size : factor.parameter_block_sizes()) {
    storage.emplace_back(residuals.size() * static_cast<size_t>(size));
  }
  for (auto& block : storage) jacobians.push_back(block.data());
  for (auto _ : state) {
    CHECK(factor.Evaluate(parameters.data(), residuals.data(),
                          state.range(0) != 0 ? jacobians.data() : nullptr));
    benchmark::DoNotOptimize(residuals.data());
  }
}

void PlaneResiduals(benchmark::State& state) {
  OnePair one;
  EvaluateFactor(state, CoplanarityPlane(one.pair), one.Parameters(/*with_direction=*/true));
}
BENCHMARK(PlaneResiduals)->Arg(0)->Arg(1)->ArgName("jacobians");

void DeterminantResiduals(benchmark::State& state) {
  OnePair one;
  const int count = static_cast<int>(one.pair->matches.size());
  EvaluateFactor(state, CoplanarityDeterminant(one.pair, RandomTriplets(count, count, /*seed=*/1)),
                 one.Parameters(/*with_direction=*/false));
}
BENCHMARK(DeterminantResiduals)->Arg(0)->Arg(1)->ArgName("jacobians");

void SymmetricTransferResiduals(benchmark::State& state) {
  OnePair one;
  EvaluateFactor(state, SymmetricTransfer(one.pair), one.Parameters(/*with_direction=*/false));
}
BENCHMARK(SymmetricTransferResiduals)->Arg(0)->Arg(1)->ArgName("jacobians");

void DirectionSearch(benchmark::State& state) {
  OnePair one;
  PairBearings bearings;
  CHECK(EvaluatePairBearings(*one.pair, one.Chain(), one.lens.data(), one.shutter.data(),
                             one.q_gyro_cam.coeffs().data(), nullptr, false, &bearings));
  for (auto _ : state) {
    benchmark::DoNotOptimize(FindDirection(bearings, one.pair->variance_a(), one.pair->variance_b(),
                                           one.pair->robust_threshold));
  }
}
BENCHMARK(DirectionSearch)->Unit(benchmark::kMicrosecond);

Prior StartAt(const Calibration& truth) { return {truth, PaperStart(truth).sigma}; }

constexpr int kSteps = 300;

// One more pair in a window that has settled: solve, covariance, marginalisation. Pairs lie side by
// side, `frames` to a pair: the time per frame is the time of a step over that.
void WindowStep(benchmark::State& state) {
  const Simulated s = MakeRecording(60.0);
  const Prior start = StartAt(s.truth);
  SlidingWindowOptions options;
  options.graph.sigma = 0.5;
  SlidingWindow window(start.mean, start, s.recording.gyro.front().stamp_ns, options);
  for (const GyroSample& sample : s.recording.gyro) {
    CHECK(window.AddGyroSample(sample) == AddResult::kAccepted);
  }
  std::vector<TimedPair> pairs = SideBySide(s.recording, SelectPairs(s.recording));
  AddMatches(s.recording, &pairs);
  size_t next = 0;
  const auto step = [&] {
    CHECK_LT(next, pairs.size());
    const TimedPair& pair = pairs[next++];
    CHECK(window.AddPair(s.recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns,
                         s.recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns,
                         pair.matches) == AddResult::kAccepted);
  };
  while (!window.latest().settled) step();
  for (int i = 0; i < 20; ++i) step();
  for (auto _ : state) step();
  state.counters["frames"] =
      static_cast<double>(s.recording.frames.size()) / static_cast<double>(pairs.size());
}
BENCHMARK(WindowStep)->Unit(benchmark::kMillisecond)->Iterations(200);

// One frame of the paper's filter. Argument: N.
void EkfStep(benchmark::State& state) {
  const Simulated s = MakeRecording(20.0);
  EkfOptions options;
  options.triplets = static_cast<int>(state.range(0));
  ImplicitEkf filter(StartAt(s.truth), options);
  const EstimationInput input = MakeEstimationInput(s.recording);
  for (const TimedRate& rate : input.rates) filter.AddReading(rate.time_s, rate.omega_gyro_rad_s);
  size_t next = 0;
  for (auto _ : state) {
    const TimedPair& pair = input.pairs[next++];
    CHECK(filter.Update(pair.time_a_s, pair.time_b_s, pair.matches) ==
          ImplicitEkf::UpdateResult::kUpdated);
  }
}
BENCHMARK(EkfStep)
    ->Arg(30)
    ->Arg(100)
    ->Arg(300)
    ->ArgName("N")
    ->Unit(benchmark::kMillisecond)
    ->Iterations(kSteps);

}  // namespace
}  // namespace camgyro
