#include "estimator/calibrate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <future>

#include "core/format.h"
#include "core/so3.h"
#include "core/usual_focal.h"

namespace camgyro {
namespace {

constexpr int kMinPairsForUnseen = 60;  // below, setting frames aside costs more than it tells

class StageClock {
 public:
  explicit StageClock(std::vector<StageTime>* times) : times_(times) {}
  void Finish(const std::string& stage) {
    const auto now = std::chrono::steady_clock::now();
    times_->push_back({stage, std::chrono::duration<double>(now - begin_).count()});
    begin_ = now;
  }

 private:
  std::vector<StageTime>* times_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

std::vector<CameraRotation> NeighbourRotations(const Recording& recording) {
  std::vector<CameraRotation> rotations;
  for (const TimedPair& pair : MakeEstimationInput(recording).pairs) {
    rotations.push_back(pair.rotation);
  }
  return rotations;
}

// The start with the field of view scanned; where the scan finds none that it can trust, at the
// usual one that explains the gyro best, with the focal length left open. Errors: of the scan.
Result<StartResult> StartFromPictures(const Recording& recording,
                                      const CameraRotationsAtFocal& rotations_at,
                                      const CalibrateOptions& options) {
  const Result<StartResult> scanned =
      FindStartAndFocal(recording, rotations_at, options.start, options.focal_scan);
  if (scanned || scanned.error().kind != ErrorKind::kCannotEstimate) return scanned;
  Result<StartResult> best = scanned;
  for (const double focal : {0.55, 0.65, 0.8, 1.0}) {  // of the picture's width
    const Result<StartResult> start =
        FindStart(recording, rotations_at(focal * recording.camera.width_px), options.start);
    if (start && (!best || start->explained > best->explained)) best = start;
  }
  if (best) {
    best->notes.push_back("no focal length could be found for the start: a usual one is used");
  }
  return best;
}

// How the two halves of a recording disagree, in view of their covariances: chi-square per
// parameter of the difference. 1 for a right model; what a constant model leaves out, and moves,
// shows here.
double HalvesChi2(const Calibration& first, const Calibration& second) {
  const StateVector d = Difference(first, second);
  const StateCovariance sum = first.covariance + second.covariance;
  // Unit diagonal before the factorisation: the units differ by orders of magnitude.
  const StateVector scale = sum.diagonal().cwiseSqrt().cwiseInverse();
  const StateCovariance correlation = scale.asDiagonal() * sum * scale.asDiagonal();
  const StateVector z = scale.cwiseProduct(d);
  return z.dot(correlation.ldlt().solve(z)) / kStateSize;
}

// The disagreement that right models exceed once in a thousand recordings: the 99.9 % quantile of
// chi-square with 11 degrees of freedom is 31.3.
constexpr double kHalvesLimit = 31.3 / kStateSize;

struct Halves {
  double chi2 = 0.0;  // HalvesChi2, 0 if a half cannot be fitted
  std::optional<UnseenFit> unseen;
};

// Each half of the pairs is fitted alone, and the other one tells how well. The pairs across the
// middle belong to neither, so that no frame is in both.
Halves FitHalves(const EstimationInput& input, const Calibration& from, const Prior& prior,
                 const RefinementOptions& refinement) {
  const auto middle = input.pairs.begin() + static_cast<std::ptrdiff_t>(input.pairs.size() / 2);
  std::array<std::vector<TimedPair>, 2> halves;
  halves[0].assign(input.pairs.begin(), middle);
  for (auto pair = middle; pair != input.pairs.end(); ++pair) {
    if (pair->time_a_s > halves[0].back().time_b_s) halves[1].push_back(*pair);
  }
  RefinementOptions options = refinement;
  options.max_rounds = std::min(4, refinement.max_rounds);
  options.cluster_s = 0.5 * refinement.cluster_s;
  std::array<Calibration, 2> fits;
  UnseenFit unseen;
  bool both = true;
  for (size_t h = 0; h < 2; ++h) {
    const Result<Refined> half = Refine(input, halves[h], from, prior, options);
    if (!half) {
      both = false;
      continue;
    }
    fits[h] = half->calibration;
    if (halves[1 - h].empty() || halves[1 - h].front().matches.empty()) continue;  // attitudes
    const UnseenFit other = EvaluateUnseen(input, halves[1 - h], half->calibration,
                                           half->quality.noise_px, refinement.graph);
    unseen.rms_px = std::sqrt((unseen.matches * unseen.rms_px * unseen.rms_px +
                               other.matches * other.rms_px * other.rms_px) /
                              std::max(1, unseen.matches + other.matches));
    unseen.matches += other.matches;
    unseen.pairs += other.pairs;
  }
  Halves result;
  if (unseen.matches > 0) result.unseen = unseen;
  if (both) result.chi2 = HalvesChi2(fits[0], fits[1]);
  return result;
}

// A parameter is determined if the data shrank its prior and the result is of practical use.
void MarkDetermined(bool attitudes, const Prior& prior, Calibration* c) {
  StateScales scales;
  scales.focal_px = c->lens[kFocal];
  scales.width_px = c->width_px;
  const StateVector sigma = c->sigma();
  for (int i = 0; i < kStateSize; ++i) {
    const StateParameter& parameter = StateTable()[static_cast<size_t>(i)];
    c->determined[static_cast<size_t>(i)] = !(attitudes && parameter.needs_pixels) &&
                                            sigma[i] < parameter.useful_sigma.In(scales) &&
                                            sigma[i] < 0.5 * prior.sigma[i];
  }
  // Rows are timed by the angles between them: without a focal length there are none.
  if (!c->determined[kStateFocal]) c->determined[kStateReadout] = false;
}

void AddDoubts(const Recording& recording, CalibrationReport* report) {
  const Calibration& c = report->calibration;
  const StateVector sigma = c.sigma();
  const auto determined = [&](int i) { return c.determined[static_cast<size_t>(i)]; };
  if (!report->converged) {
    report->doubts.push_back("the refinement had not settled when it was stopped");
  }
  const double centre_off =
      std::hypot(c.lens[kCx] - 0.5 * c.width_px, c.lens[kCy] - 0.5 * c.height_px);
  if (determined(kStateCx) && determined(kStateCy) &&
      centre_off > 0.05 * std::hypot(c.width_px, c.height_px)) {
    report->doubts.push_back(Format(
        "the principal point is %.0f px off the centre of the picture: real lenses stay within "
        "3 %% of the diagonal, so another effect may hide there",
        centre_off));
  }
  if (determined(kStateReadout) && c.readout_s < -3.0 * sigma[kStateReadout]) {
    report->notes.push_back("the readout is negative: rows are read from bottom to top");
  }
  const double interval = MedianInterval(recording.frames);
  if (determined(kStateReadout) && std::abs(c.readout_s) > 1.05 * interval) {
    report->doubts.push_back(
        Format("the readout time of %.1f ms is longer than the frame interval of %.1f ms",
               1e3 * c.readout_s, 1e3 * interval));
  }
  if (report->unseen && report->unseen->rms_px > 1.3 * report->quality.rms_px) {
    report->doubts.push_back(
        Format("frames that the fit has not seen fit worse: %.3f px against %.3f px",
               report->unseen->rms_px, report->quality.rms_px));
  }
  if (report->online) {
    StateVector gap = Difference(*report->online, c).cwiseAbs();
    const StateVector scale = (report->online->sigma().cwiseAbs2() + sigma.cwiseAbs2()).cwiseSqrt();
    for (const int i : {kStateFocal, kStateReadout, kStateDelay}) {
      if (determined(i) && gap[i] > 6.0 * scale[i]) {
        report->doubts.push_back(StateNames()[static_cast<size_t>(i)] +
                                 Format(": online pass and refinement differ by %.1f of their "
                                        "sigmas",
                                        gap[i] / scale[i]));
      }
    }
  }
}

}  // namespace

Prior MakePrior(const Recording& recording, const StartResult& start) {
  const CameraGuess& guess = recording.camera;
  Prior result;
  Calibration& prior = result.mean;
  prior.width_px = guess.width_px;
  prior.height_px = guess.height_px;
  prior.distortion_model = guess.distortion_model;
  const Eigen::Vector2d centre(0.5 * (guess.width_px - 1), 0.5 * (guess.height_px - 1));
  const bool scanned = start.focal && start.focal->determined;
  const double focal = scanned && !guess.focal_px ? start.focal->value_px : FocalToBeginWith(guess);
  prior.lens = MakePinhole(focal, guess.principal_px.value_or(centre), guess.aspect_ratio);
  for (size_t i = 0; i < guess.distortion.size() && i < 4; ++i) {
    prior.lens[FirstCoefficient(guess.distortion_model) + static_cast<int>(i)] =
        guess.distortion[i];
  }
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

Status AddStartEffects(const Recording& recording, const StartResult& start,
                       const std::string& list, Calibration* calibration) {
  EffectSetup setup = MakeEffectSetup(recording, *calibration);
  setup.clock_skew = start.clock_skew;
  Result<EffectSet> effects = MakeEffects(list, setup);
  if (!effects) return tl::unexpected(effects.error());
  for (const EffectEntry& entry : EffectCatalogue()) {
    if (!entry.found_at_start || effects->Has(entry.name) || !entry.found_at_start(setup)) continue;
    const std::string shape = entry.shapes(setup).back();
    effects->Add(&entry, shape, entry.make(setup, shape));
  }
  if (effects->items().empty()) return {};
  calibration->effect_values = Eigen::VectorXd::Zero(effects->size());
  for (const EffectSet::Item& item : effects->items()) {
    item.effect->SetStart(calibration->effect_values.data() + item.first);
  }
  calibration->effects = std::make_shared<const EffectSet>(std::move(*effects));
  return {};
}

PairGraphOptions GraphOptionsFor(const Recording& recording, const StartResult& start,
                                 const CalibrateOptions& options) {
  PairGraphOptions graph_options = options.window.graph;
  graph_options.residual = options.residual;
  graph_options.match_noise = recording.match_noise;
  graph_options.gyro_sigma_rad_s = GyroSigma(recording, start.delay_middle_row_s);
  if (recording.gyro_info.random_walk_rad_s2_rtHz) {
    graph_options.bias_walk_rad_s2_rtHz =
        std::max(1e-6, *recording.gyro_info.random_walk_rad_s2_rtHz);
  }
  return graph_options;
}

Result<CalibrationReport> CalibrateRecording(const Recording& recording,
                                             const CameraRotationsAtFocal& rotations_at,
                                             const CalibrateOptions& options,
                                             const Progress& progress) {
  const auto tell = [&](const std::string& stage, double done) {
    if (progress) progress(stage, done);
  };
  CalibrationReport report;
  report.residual = options.residual;
  StageClock clock(&report.times);
  const bool attitudes = recording.HasOnlyAttitudes();
  const EstimationInput input = MakeEstimationInput(recording, SelectPairs(recording));

  tell("start", 0.0);
  const Result<StartResult> start =
      options.given_start ? Result<StartResult>(*options.given_start)
      : attitudes         ? FindStart(recording, NeighbourRotations(recording), options.start)
                          : StartFromPictures(recording, rotations_at, options);
  if (!start) return tl::unexpected(start.error());
  report.start = *start;
  for (const std::string& note : start->notes) report.notes.push_back("at the start: " + note);
  clock.Finish("start");

  const Prior prior = MakePrior(recording, *start);
  report.prior = prior;
  Calibration estimate = prior.mean;
  estimate.bias_gyro_rad_s = start->bias_gyro_rad_s;
  if (start->focal && start->focal->determined) estimate.lens[kFocal] = start->focal->value_px;
  if (options.from) {
    estimate = *options.from;
  } else if (const Status added = AddStartEffects(recording, *start, options.effects, &estimate);
             !added) {
    return tl::unexpected(added.error());
  }
  if (estimate.effects && estimate.effects->frame_time_spread() >= 0 &&
      options.residual != ResidualKind::kPlane) {
    return BadUsage("--effects: frames have times of their own with --residual=plane only");
  }
  const PairGraphOptions graph_options = GraphOptionsFor(recording, *start, options);
  const Calibration from_start = estimate;

  if (!attitudes && options.online) {
    SlidingWindowOptions window_options = options.window;
    window_options.graph = graph_options;
    SlidingWindow window(estimate, prior, input.origin_ns, window_options);
    window.SetListener([&](const WindowUpdate& update) { report.trace.push_back(update); });
    // In the order of real time: a sample is known when its time has come, a frame at its stamp.
    size_t next_sample = 0;
    const std::vector<TimedPair> pairs = SideBySide(input.pairs);
    for (size_t i = 0; i < pairs.size(); ++i) {
      const TimedPair& pair = pairs[i];
      const double known_s = pair.time_b_s + DelayOf(estimate, pair.second());
      for (; next_sample < input.rates.size() && input.rates[next_sample].time_s <= known_s;
           ++next_sample) {
        if (window.AddGyroSample(recording.gyro[next_sample], input.rates[next_sample].saturated) !=
            AddResult::kAccepted) {
          return BadInput("gyro sample " + std::to_string(next_sample) +
                          ": the stamp repeats or goes back, or a rate is not finite");
        }
      }
      if (window.AddPair(recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns,
                         recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns, pair.matches,
                         pair.exposure_a_s, pair.exposure_b_s) != AddResult::kAccepted) {
        return BadInput("frames " + std::to_string(pair.frame_a) + " and " +
                        std::to_string(pair.frame_b) +
                        ": the stamp repeats or goes back, or a pixel is not finite");
      }
      if (i % 20 == 0) tell("window", static_cast<double>(i) / static_cast<double>(pairs.size()));
    }
    for (; next_sample < input.rates.size(); ++next_sample) {
      if (window.AddGyroSample(recording.gyro[next_sample], input.rates[next_sample].saturated) !=
          AddResult::kAccepted) {
        return BadInput("gyro sample " + std::to_string(next_sample) +
                        ": the stamp repeats or goes back, or a rate is not finite");
      }
    }
    report.pairs_used_online = window.num_used_pairs();
    report.skipped_pairs = window.num_skipped_pairs();
    if (!report.trace.empty()) {
      estimate = window.latest().estimate;
      report.online = estimate;
      MarkDetermined(attitudes, prior, &*report.online);
    }
    clock.Finish("window");
  }

  if (options.refine || !report.online) {
    RefinementOptions refinement = options.refinement;
    refinement.graph = graph_options;
    if (!report.trace.empty()) refinement.graph.sigma_px = report.trace.back().noise_px;
    Calibration from = estimate;
    const double duration = input.pairs.back().time_b_s - input.pairs.front().time_a_s;
    refinement.cluster_s = std::clamp(duration / 12.0, 0.2, refinement.cluster_s);
    tell("refinement", 0.0);
    const auto refine = [&](const Calibration& again_from, double noise) {
      RefinementOptions again = refinement;
      (attitudes ? again.sigma_rad : again.graph.sigma_px) = noise;
      return Refine(input, input.pairs, again_from, prior, again);
    };
    if (from.effects != nullptr &&
        std::any_of(from.effects->items().begin(), from.effects->items().end(),
                    [](const auto& item) { return item.effect->depends_on_calibration(); })) {
      const Result<Refined> first = Refine(input, input.pairs, from, prior, refinement);
      if (!first) return tl::unexpected(first.error());
      from = SettleEffects(recording, *first, refine).calibration;
    }
    RefinementOptions dropping = refinement;
    dropping.graph.drop_without_ray = true;
    // Beside the fit of all pairs, each half alone.
    std::future<Halves> halves_fit;
    const auto begin_halves = [&](const RefinementOptions& with) {
      if (static_cast<int>(input.pairs.size()) < kMinPairsForUnseen) return;
      halves_fit = std::async(std::launch::async, FitHalves, std::cref(input), std::cref(from),
                              std::cref(prior), std::cref(with));
    };
    begin_halves(refinement);
    Result<Refined> refined = Refine(input, input.pairs, from, prior, refinement);
    if (!refined && report.online) {  // a window that has run away, to a lens without rays
      refined = refine(from_start, options.refinement.graph.sigma_px);
      report.notes.push_back("the online estimate leads nowhere; all frames fitted from the start");
    }
    if (!refined && from.effects != nullptr) {
      refined = Refine(input, input.pairs, from, prior, dropping);
      begin_halves(dropping);
      if (refined) {
        report.notes.push_back(
            "matches where the lens of the start has no ray, at the edge of the picture, are left "
            "out");
      }
    }
    if (!refined) return tl::unexpected(refined.error());
    report.calibration = refined->calibration;
    report.quality = refined->quality;
    report.skipped_pairs = refined->skipped_pairs;
    report.frame_times = refined->frame_times;
    report.converged = refined->converged;
    tell("refinement", 0.6);
    const Halves halves = halves_fit.valid() ? halves_fit.get() : Halves();
    report.unseen = halves.unseen;
    report.halves_chi2 = halves.chi2;
    if (halves.chi2 > kHalvesLimit) {
      report.calibration.covariance *= halves.chi2;
      report.calibration.effect_covariance *= halves.chi2;
      report.doubts.push_back(Format(
          "the two halves of the recording disagree beyond their noise (chi2 per parameter %.0f "
          "instead of 1): something moves that the model holds constant, or the scene is "
          "degenerate; all sigmas are multiplied by %.1f",
          halves.chi2, std::sqrt(halves.chi2)));
    }
    clock.Finish("refinement");
  } else {
    report.calibration = estimate;
    report.quality.pairs = report.pairs_used_online;
    report.quality.noise_px = report.trace.back().noise_px;
    report.converged = true;
  }
  MarkDetermined(attitudes, prior, &report.calibration);
  if (!report.converged) {  // delay and bias come from rates; the rest needs the fit
    for (size_t i = 0; i < kStateSize; ++i) {
      if (StateTable()[i].needs_fit) report.calibration.determined[i] = false;
    }
  }
  AddDoubts(recording, &report);
  tell("refinement", 1.0);
  return report;
}

}  // namespace camgyro
