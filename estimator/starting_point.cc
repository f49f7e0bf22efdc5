#include "estimator/starting_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "core/known_camera.h"
#include "core/parallel.h"
#include "core/usual_focal.h"
#include "estimator/astray.h"
#include "estimator/gyro_clock.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/gyro_noise.h"
#include "estimator/window/refinement.h"

namespace camgyro {

std::vector<CameraRotation> NeighbourRotations(const Recording& recording) {
  std::vector<CameraRotation> rotations;
  for (const TimedPair& pair : MakeEstimationInput(recording).pairs) {
    rotations.push_back(pair.rotation);
  }
  return rotations;
}

Prior MakePrior(const Recording& recording, const StartResult& start) {
  const CameraGuess& guess = recording.camera;
  Prior result;
  const bool scanned = start.focal && start.focal->determined;
  const double focal = scanned && !guess.focal_px ? start.focal->value_px : FocalToBeginWith(guess);
  Calibration& prior = result.mean = DeclaredCamera(guess, focal);
  const double interval = std::min(1.0 / 30.0, MedianInterval(recording.frames));
  prior.readout_s = guess.readout_s.value_or(0.5 * interval);
  prior.delay_s = start.delay_middle_row_s - 0.5 * prior.readout_s;
  prior.q_gyro_cam = start.q_gyro_cam;

  const StateScales scales{focal, static_cast<double>(guess.width_px),
                           std::hypot(guess.width_px, guess.height_px), interval};
  std::array<bool, kStateSize> declared{};
  declared[kStateFocal] = guess.focal_px.has_value();
  declared[kStateReadout] = guess.readout_s.has_value();
  StateVector& sigma = result.sigma;
  for (size_t i = 0; i < kStateSize; ++i) {
    const StateParameter& parameter = StateTable()[i];
    sigma[static_cast<Eigen::Index>(i)] =
        (declared[i] ? parameter.declared_sigma : parameter.usual_sigma).In(scales);
  }
  if (recording.HasOnlyAttitudes()) {
    // An attitude has neither pixels nor rows: nothing depends on the lens, and the readout is 0.
    prior.readout_s = 0.0;
    prior.delay_s = start.delay_middle_row_s;
    for (size_t i = 0; i < kStateSize; ++i) {
      if (StateTable()[i].needs_pixels) sigma[static_cast<Eigen::Index>(i)] = 1.0;
    }
  }
  auto rotation = sigma.segment<3>(kStateRotation);
  rotation = start.rotation_sigma_rad.cwiseMax(rotation);
  return result;
}

namespace {

void AddEffect(const EffectSetup& setup, const EffectEntry& entry, const std::string& shape,
               const PairResidual& residual, EffectSet* effects) {
  const std::shared_ptr<const Effect> effect = entry.make(setup, shape);
  if (effect == nullptr) return;
  if (effect->frees_frame_times() && !residual.facts().with_frame_times) return;
  effects->Add(&entry, shape, effect);
}

}  // namespace

Status AddStartEffects(const Recording& recording, const StartResult& start,
                       const std::string& list, const PairResidual& residual,
                       Calibration* calibration, std::vector<std::string>* notes) {
  EffectSetup setup = MakeEffectSetup(recording, *calibration);
  setup.clock_skew = start.clock_skew;
  TellOfStabiliser(start, &setup);
  setup.lens_is_held = false;  // what is asked for is fitted
  Result<EffectSet> effects = MakeEffects(list, setup);
  if (!effects) return tl::unexpected(effects.error());
  for (const EffectEntry& entry : EffectCatalogue()) {
    if (!entry.found_at_start || effects->Has(entry.name) || !entry.found_at_start(setup)) continue;
    // What may be, and need not, keeps nobody from a residual that knows no effects.
    if (!entry.start_note.empty() && !residual.facts().with_effects) continue;
    AddEffect(setup, entry, entry.shapes(setup).back(), residual, &*effects);
    if (notes != nullptr && !entry.start_note.empty()) notes->push_back(entry.start_note);
  }
  if (const std::string shape = ShapeOfGyroClock(recording);
      !shape.empty() && !effects->Has("clock_skew") && residual.facts().with_effects) {
    AddEffect(setup, *FindEffect("clock_skew"), shape, residual, &*effects);
  }
  if (effects->items().empty()) return {};
  calibration->effect_values = Eigen::VectorXd::Zero(effects->size());
  for (const EffectSet::Item& item : effects->items()) {
    item.effect->SetStart(calibration->effect_values.data() + item.first);
  }
  calibration->effects = std::make_shared<const EffectSet>(std::move(*effects));
  return {};
}

void TellOfStabiliser(const StartResult& start, EffectSetup* setup) {
  if (!start.stabiliser) return;
  setup->lens_is_held = start.stabiliser->is_held;
  if (!start.stabiliser->follows_turns) return;
  setup->stabiliser = start.stabiliser->stabiliser;
  setup->stabiliser_px_per_rad = start.stabiliser->gain * start.focal->value_px;
}

void AddStabiliser(const Recording& recording, const StartResult& start,
                   const PairResidual& residual, Calibration* calibration) {
  const EffectEntry& entry = *FindEffect("optical_stabilisation");
  EffectSetup setup = MakeEffectSetup(recording, *calibration);
  TellOfStabiliser(start, &setup);
  const EffectSet* const before = calibration->effects.get();
  if (!setup.stabiliser || !residual.facts().with_effects ||
      (before != nullptr && before->Has(entry.name))) {
    return;
  }
  auto effects = std::make_shared<EffectSet>(before != nullptr ? *before : EffectSet());
  const int first = effects->size();
  AddEffect(setup, entry, NameOf(*setup.stabiliser), residual, effects.get());
  calibration->effect_values.conservativeResizeLike(Eigen::VectorXd::Zero(effects->size()));
  effects->items().back().effect->SetStart(calibration->effect_values.data() + first);
  calibration->effects = std::move(effects);
}

PairGraphOptions GraphOptionsFor(const Recording& recording, const StartResult& start,
                                 PairGraphOptions options) {
  options.match_noise = recording.match_noise;
  options.gyro_sigma_rad_s = GyroSigma(recording, start.delay_middle_row_s);
  if (recording.gyro_info.random_walk_rad_s2_rtHz) {
    options.bias_walk_rad_s2_rtHz = std::max(1e-6, *recording.gyro_info.random_walk_rad_s2_rtHz);
  }
  return options;
}

namespace {

constexpr size_t kPairsToTell = 60;  // two steps sideways that look like turns differ in most pairs

// Of two fits of some pairs, from the estimate and from it without a bias: where the second one is
// better, its bias, else that of the estimate.
Eigen::Vector3d BiasWithOrWithout(const Recording& recording, const StartResult& start,
                                  const PairResidual& residual, const StartingPoint& point) {
  const EstimationInput input = OutlineOf(recording, SelectPairs(recording));
  std::vector<TimedPair> pairs;
  const size_t stride = (input.pairs.size() + kPairsToTell - 1) / kPairsToTell;
  for (size_t i = 0; i < input.pairs.size(); i += stride) pairs.push_back(input.pairs[i]);
  AddMatches(recording, &pairs);
  PairGraphOptions graph;
  graph.residual = &residual;
  RefinementOptions options;
  options.graph = GraphOptionsFor(recording, start, graph);
  std::array<std::optional<Refined>, 2> ended;
  ParallelFor(2, [&](size_t k) {
    Calibration from = point.estimate;
    if (k == 1) from.bias_gyro_rad_s.setZero();
    Result<Refined> fit = Refine(input, pairs, from, point.prior, options);
    if (fit && fit->converged && !RanAway(fit->calibration.lens[kFocal], from.lens[kFocal])) {
      ended.at(k) = *std::move(fit);
    }
  });
  const auto noise = [](const std::optional<Refined>& fit) {
    return fit ? fit->quality.noise_px : std::numeric_limits<double>::infinity();
  };
  return noise(ended[1]) < noise(ended[0]) ? ended[1]->calibration.bias_gyro_rad_s
                                           : point.estimate.bias_gyro_rad_s;
}

}  // namespace

Result<StartingPoint> MakeStartingPoint(const Recording& recording, const StartResult& start,
                                        const std::string& effects, const PairResidual& residual) {
  StartingPoint point;
  point.prior = MakePrior(recording, start);
  point.estimate = point.prior.mean;
  point.estimate.bias_gyro_rad_s = start.bias_gyro_rad_s;
  if (start.readout && !recording.camera.readout_s) {
    point.estimate.readout_s = start.readout->value_s;
    point.estimate.delay_s = start.delay_middle_row_s - 0.5 * point.estimate.readout_s;
  }
  if (start.focal && start.focal->determined) point.estimate.lens[kFocal] = start.focal->value_px;
  if (const Status added =
          AddStartEffects(recording, start, effects, residual, &point.estimate, &point.notes);
      !added) {
    return tl::unexpected(added.error());
  }
  const auto large = point.prior.sigma.segment<3>(kStateBias).array();
  if (!recording.HasOnlyAttitudes() && (start.bias_gyro_rad_s.array().abs() > large).any()) {
    point.estimate.bias_gyro_rad_s = BiasWithOrWithout(recording, start, residual, point);
  }
  return point;
}

}  // namespace camgyro
