#include "estimator/calibrate.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/format.h"
#include "core/parallel.h"
#include "estimator/astray.h"
#include "estimator/doubts.h"
#include "estimator/gyro_clock.h"
#include "estimator/halves.h"
#include "estimator/informative_pairs.h"
#include "estimator/moving_tracks.h"
#include "estimator/online_pass.h"
#include "estimator/times_between.h"
#include "estimator/window/settle_effects.h"

namespace camgyro {
namespace {

// The stages of CalibrateRecording, one after the other.
class CalibrationJob {
 public:
  CalibrationJob(const Recording& recording, const CalibrateOptions& options,
                 const Progress& progress)
      : recording_(recording),
        options_(options),
        progress_(progress),
        attitudes_(recording.HasOnlyAttitudes()),
        input_(OutlineOf(recording, SelectPairs(recording))),
        clock_(&report_.times) {
    report_.residual = options.window.graph.residual;
  }

  Result<CalibrationReport> Run(const CameraRotationsAt& rotations_at) {
    if (const Status found = Start(rotations_at); !found) return tl::unexpected(found.error());
    if (recording_.camera.division_lambda != 0.0 && MayTryWhatLeadsAstray()) {
      if (auto better = TryWhatLeadsAstray(rotations_at, {})) return *std::move(better);
    }
    if (!attitudes_ && options_.online) {
      if (const Status done = Window(); !done) return tl::unexpected(done.error());
      // What a fit of all pairs makes of an online estimate that is astray would take minutes.
      if (online_noise_ && FocalIsAstray(estimate_)) {
        if (auto better = TryWhatLeadsAstray(rotations_at,
                                             AstrayFit{estimate_.lens[kFocal], *online_noise_,
                                                       OverSmooth(estimate_, *online_noise_)})) {
          return *std::move(better);
        }
      }
    }
    if (!options_.refine) {
      if (const Status done = FinishWindow(); !done) return tl::unexpected(done.error());
    }
    if (options_.refine || !report_.online) {
      if (const Status done = Refinement(); !done) return tl::unexpected(done.error());
      LookThroughFittedLens(recording_, options_, rotations_at, &report_);
      const double noise = report_.quality.noise_px;
      report_.noise_over_smooth = OverSmooth(report_.calibration, noise);
      if (FocalIsAstray(report_.calibration) || NoiseIsAstray()) {
        if (auto better = TryWhatLeadsAstray(
                rotations_at,
                AstrayFit{report_.calibration.lens[kFocal], noise, report_.noise_over_smooth})) {
          return *std::move(better);
        }
      }
    } else {
      report_.calibration = *report_.online;
      report_.quality.pairs = report_.pairs_used_online;
      report_.quality.noise_px = report_.trace.back().noise_px;
      report_.noise_over_smooth = OverSmooth(report_.calibration, report_.quality.noise_px);
      report_.converged = true;
    }
    AddGyroClock(recording_, &report_.calibration);
    MarkDetermined(attitudes_, report_.prior, &report_.calibration);
    // Delay and bias come from rates; the rest needs a fit that has settled, at a lens like the
    // start's.
    const double focal_px = report_.calibration.lens[kFocal];
    const bool ran_away =
        !report_.calibration.determined[kStateFocal] && RanAway(focal_px, from_start_.lens[kFocal]);
    if (ran_away || !report_.converged || IsFarFromRotations(focal_px, report_.start.focal)) {
      DisbelieveFit(ran_away, &report_);
    }
    if (!ran_away && report_.noise_over_smooth > kNoiseOfAstray) DisbelievePulledFit(&report_);
    AddDoubts(recording_, &report_);
    Tell("refinement", 1.0);
    return std::move(report_);
  }

 private:
  static double SecondsOf(const std::vector<StageTime>& times) {
    double sum = 0.0;
    for (const StageTime& time : times) sum += time.seconds;
    return sum;
  }

  void Tell(const std::string& stage, double done) const {
    if (progress_) progress_(stage, done);
  }

  Status Start(const CameraRotationsAt& rotations_at) {
    Tell("start", 0.0);
    const Result<StartResult> start =
        options_.given_start ? Result<StartResult>(*options_.given_start)
        : attitudes_
            ? FindStart(recording_, NeighbourRotations(recording_), options_.start)
            : FindStartFromPictures(recording_, rotations_at, options_.start, options_.focal_scan);
    if (!start) return tl::unexpected(start.error());
    report_.start = *start;
    for (const std::string& note : start->notes) report_.notes.push_back("at the start: " + note);
    clock_.Finish("start");

    if (options_.from) {
      report_.prior = MakePrior(recording_, *start);
      estimate_ = *options_.from;
    } else {
      Result<StartingPoint> point =
          MakeStartingPoint(recording_, *start, options_.effects, *report_.residual);
      if (!point) return tl::unexpected(point.error());
      report_.prior = std::move(point->prior);
      estimate_ = std::move(point->estimate);
      for (const std::string& note : point->notes) report_.notes.push_back(note);
      if (options_.take_stabiliser) {
        AddStabiliser(recording_, *start, *report_.residual, &estimate_);
      }
    }
    from_start_ = estimate_;
    graph_options_ = GraphOptionsFor(recording_, *start, options_.window.graph);
    return CheckEffects();
  }

  // Can what is to be fitted be fitted?
  Status CheckEffects() const {
    const EffectSet* const effects = estimate_.effects.get();
    const PairResidual::Facts& chosen = report_.residual->facts();
    if (effects == nullptr || effects->size() == 0) return {};
    if (!attitudes_ && !chosen.with_effects) {
      return BadUsage(
          std::string("--residual=") + chosen.name + " knows no effects, but " +
          effects->items().front().entry->name +
          " is in this recording, or asked for: use --residual=" + ByPlane().facts().name);
    }
    if (effects->frame_time_spread() >= 0 && !chosen.with_frame_times) {
      return BadUsage("--effects: frames have times of their own with --residual=plane only");
    }
    return {};
  }

  void MakePass(const PairSelection& of, const Calibration& start,
                std::optional<OnlinePass>* pass) const {
    SlidingWindowOptions window_options = options_.window;
    window_options.graph = graph_options_;
    pass->emplace(recording_, input_, of, start, report_.prior, window_options);
  }

  // The online pass, so far that the refinement can start from it, or to its end.
  Status Window() {
    const PairSelection selection = SelectPairs(recording_, kGapLimitsOnline);
    MakePass(selection, estimate_, &online_);
    // From a poor start, as with a strong lens that nothing declares, a few short pairs find the
    // way more often than many long ones.
    std::optional<OnlinePass> short_pass;
    if (selection.far) {
      MakePass(SelectPairs(recording_, kGapLimitsOfPoorStart).near(), estimate_, &short_pass);
    }
    OnlinePass& first = short_pass ? *short_pass : *online_;
    if (const Status done = first.RunUntilSettled(progress_); !done) return done;
    if (first.has_estimate()) {
      estimate_ = first.window().latest().estimate;
      online_noise_ = first.window().latest().noise_px;
    }
    clock_.Finish("window");
    return {};
  }

  bool MayTryWhatLeadsAstray() const {
    return options_.try_what_leads_astray && options_.online && options_.refine && !attitudes_ &&
           !tried_what_leads_astray_;
  }

  // The focal length has left that of the start, and nothing else was tried yet.
  bool FocalIsAstray(const Calibration& fit) const {
    return MayTryWhatLeadsAstray() && (IsFarFromRotations(fit.lens[kFocal], report_.start.focal) ||
                                       RanAway(fit.lens[kFocal], from_start_.lens[kFocal]));
  }
  bool NoiseIsAstray() const {
    return MayTryWhatLeadsAstray() && report_.noise_over_smooth > kNoiseOfAstray;
  }
  double OverSmooth(const Calibration& fit, double noise_px) const {
    return NoiseOverSmooth(recording_, input_, fit, noise_px, graph_options_);
  }

  // FitWithWhatLeadsAstray, from the start.
  std::optional<CalibrationReport> TryWhatLeadsAstray(const CameraRotationsAt& rotations_at,
                                                      const std::optional<AstrayFit>& astray) {
    tried_what_leads_astray_ = astray.has_value();
    if (!report_.residual->facts().with_effects) return std::nullopt;
    std::optional<CalibrationReport> best = FitWithWhatLeadsAstray(
        recording_, report_.start, from_start_, astray, [&](const std::string& effect) {
          CalibrateOptions with = options_;
          with.effects += (with.effects.empty() ? "" : ",") + effect;
          with.given_start = report_.start;
          with.try_what_leads_astray = false;
          return CalibrationJob(recording_, with, nullptr).Run(rotations_at);
        });
    if (!best) return best;
    clock_.Finish("other fits");
    best->times.insert(best->times.begin(),
                       {"other fits", SecondsOf(report_.times) - SecondsOf(best->times)});
    return best;
  }

  // All of the online pass.
  Status FinishWindow() {
    if (!online_) return {};
    if (const Status done = online_->Finish(); !done) return done;
    const SlidingWindow& window = online_->window();
    report_.trace = online_->TakeTrace();
    report_.pairs_used_online = window.num_used_pairs();
    report_.skipped_pairs = window.num_skipped_pairs();
    if (!window.failure().empty()) {
      report_.notes.push_back("the online pass ended without a result: " + window.failure());
    }
    if (!report_.trace.empty()) {
      report_.online = window.latest().estimate;
      MarkDetermined(attitudes_, report_.prior, &*report_.online);
    }
    return {};
  }

  RefinementOptions OptionsOfRefinement() const {
    RefinementOptions refinement = options_.refinement;
    refinement.graph = graph_options_;
    if (online_noise_) refinement.graph.sigma = online_noise_;
    const double duration = input_.pairs.back().time_b_s - input_.pairs.front().time_a_s;
    refinement.cluster_s = std::clamp(duration / 12.0, 0.2, refinement.cluster_s);
    refinement.is_lost = [from_px = from_start_.lens[kFocal]](const Calibration& before,
                                                              const Calibration& now, double) {
      return IsRunningAway(before.lens[kFocal], now.lens[kFocal], from_px);
    };
    return refinement;
  }

  Result<Refined> RefineWith(const RefinementOptions& options, const Calibration& from,
                             std::optional<double> noise) const {
    RefinementOptions with = options;
    with.graph.sigma = noise;
    return Refine(input_, refined_pairs_, from, report_.prior, with);
  }

  // From where another fit ended.
  Result<Refined> RefineFrom(const Refined& fit, const std::vector<TimedPair>& pairs,
                             const RefinementOptions& options) const {
    RefinementOptions with = options;
    with.graph.sigma = fit.quality.noise_px;
    with.latents = fit.latents;
    return Refine(input_, pairs, fit.calibration, report_.prior, with);
  }

  Status Refinement() {
    Tell("refinement", 0.0);
    const double left =
        std::max(options_.least_refined_bytes, options_.most_bytes - BytesOf(recording_));
    refined_pairs_ = InformativePairs(input_, estimate_.delay_s,
                                      {options_.most_refined_pairs, left}, graph_options_);
    AddMatches(recording_, &refined_pairs_);
    RefinementOptions refinement = OptionsOfRefinement();
    if (refined_pairs_.size() < input_.pairs.size()) {
      refinement.most_kept_bytes = 0.0;  // there is no memory to spare
      report_.notes.push_back(
          Format("the recording is long: %zu of %zu pairs, those that tell most, are refined",
                 refined_pairs_.size(), input_.pairs.size()));
    }
    Status online;
    Beside rest_of_window([&] { online = FinishWindow(); });
    Result<Refined> refined = RefineWith(refinement, estimate_, refinement.graph.sigma);
    rest_of_window.Wait();
    if (!online) return online;
    if (!refined && report_.online) {  // a window that has run away, to a lens without rays
      refined = RefineWith(refinement, from_start_, std::nullopt);
      report_.online.reset();  // nothing to hold the fit against
      report_.notes.push_back(
          "the online estimate leads nowhere; all frames fitted from the start");
    }
    if (!refined && estimate_.effects != nullptr) {
      refinement.graph.drop_without_ray = true;
      refined = RefineWith(refinement, estimate_, refinement.graph.sigma);
      if (refined) {
        report_.notes.push_back(
            "matches where the lens of the start has no ray, at the edge of the picture, are left "
            "out");
      }
    }
    if (!refined) return tl::unexpected(refined.error());
    if (HasToSettle(refined->calibration)) {
      refined = SettleEffects(recording_, *refined, [&](const Refined& fit) {
        return RefineFrom(fit, refined_pairs_, refinement);
      });
      // The online pass with these effects, not with those of the start.
      Calibration again = from_start_;
      again.effects = refined->calibration.effects;
      if (online_) MakePass(SelectPairs(recording_, kGapLimitsOnline), again, &online_);
      if (const Status done = FinishWindow(); !done) return done;
    }
    TakeNoiseFactors(refined->noise_factors, &refined_pairs_);
    const Halves halves = LeaveOutWhatMoves(refinement, &*refined);
    report_.noise_factors = refined->noise_factors;
    report_.calibration = refined->calibration;
    report_.quality = refined->quality;
    report_.skipped_pairs = refined->skipped_pairs;
    report_.frame_times = refined->frame_times;
    if (options_.times_between) TakeTimesOfAllFrames(recording_, refinement.graph, &report_);
    if (!refined->late_frames.empty()) {
      report_.notes.push_back(Describe(refined->late_frames, refined->frame_times));
    }
    if (refined->frame_wander.slow_s > 0.0) {
      report_.notes.push_back(Describe(refined->frame_wander));
    }
    report_.converged = refined->converged;
    Tell("refinement", 0.6);
    TakeHalves(halves);
    clock_.Finish("refinement");
    return {};
  }

  // Refits without the tracks that move, if there are any. Returns the halves of the fit that is
  // taken: that of all tracks also where the halves disagree without the movers as well, since what
  // contradicts itself then is the model, and leaving out what it does not explain would hide it.
  // A fit that is lost knows nothing of tracks, and its refits take longest.
  Halves LeaveOutWhatMoves(const RefinementOptions& options, Refined* refined) {
    if (!refined->converged ||
        RanAway(refined->calibration.lens[kFocal], from_start_.lens[kFocal])) {
      return FitHalves(input_, refined_pairs_, *refined, report_.prior, options);
    }
    const Result<StillFit> still = FitWhatIsStill(
        input_, refined_pairs_, options.graph,
        [&](const std::vector<TimedPair>& pairs, const Refined* before) -> Result<Refined> {
          return before == nullptr ? Result<Refined>(*refined)
                                   : RefineFrom(*before, pairs, options);
        });
    if (still && still->moving > 0) {
      const Halves halves = FitHalves(input_, still->pairs, still->fit, report_.prior, options);
      if (!(halves.chi2 > kHalvesLimit)) {
        *refined = still->fit;
        report_.moving_tracks = still->moving;
        report_.notes.push_back(
            Format("%d of %d tracks keep to one side, as of things that move: left out",
                   still->moving, still->tracks));
        return halves;
      }
    }
    return FitHalves(input_, refined_pairs_, *refined, report_.prior, options);
  }

  void TakeHalves(const Halves& halves) {
    report_.unseen = halves.unseen;
    report_.halves_chi2 = halves.chi2;
    if (!(halves.chi2 > kHalvesLimit)) return;
    report_.calibration.covariance *= halves.chi2;
    report_.calibration.effect_covariance *= halves.chi2;
    report_.doubts.push_back(
        Format("%s (chi2 per parameter %.0f instead of 1): something moves that the model holds "
               "constant, or the scene is degenerate; all sigmas are multiplied by %.1f",
               kHalvesDoubt, halves.chi2, std::sqrt(halves.chi2)));
  }

  const Recording& recording_;
  const CalibrateOptions& options_;
  const Progress& progress_;
  const bool attitudes_;
  const EstimationInput input_;  // an outline: matches are made where they are used
  CalibrationReport report_;
  StageClock clock_;
  Calibration estimate_, from_start_;
  bool tried_what_leads_astray_ = false;
  std::optional<OnlinePass> online_;
  std::optional<double> online_noise_;  // [px], where the refinement starts
  std::vector<TimedPair> refined_pairs_;
  PairGraphOptions graph_options_;
};

}  // namespace

Result<CalibrationReport> CalibrateRecording(const Recording& recording,
                                             const CameraRotationsAt& rotations_at,
                                             const CalibrateOptions& options,
                                             const Progress& progress) {
  return CalibrationJob(recording, options, progress).Run(rotations_at);
}

}  // namespace camgyro
