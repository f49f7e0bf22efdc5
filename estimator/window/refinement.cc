#include "estimator/window/refinement.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "core/free_memory.h"
#include "core/parallel.h"
#include "estimator/window/fit_pair.h"
#include "estimator/window/noise_scale.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/yardstick.h"

namespace camgyro {
namespace {

// How far two calibrations with the same effects differ in the times of exposure, at the middle
// row, over some pairs [s].
double LargestShift(const std::vector<TimedPair>& pairs, const Calibration& a,
                    const Calibration& b) {
  if (a.pair_effects().set == nullptr) return std::abs(a.delay_s - b.delay_s);
  double largest = 0.0;
  EffectSet::Change change;
  const Eigen::Vector2d size(a.width_px, a.height_px);
  for (const TimedPair& pair : pairs) {
    a.effects->ChangeObservation({0.5 * size, size, pair.first()}, &change);
    const double shift =
        a.delay_s - b.delay_s + change.time.row(0).dot(a.effect_values - b.effect_values);
    largest = std::max(largest, std::abs(shift));
  }
  return largest;
}

// By how much of the readout two calibrations differ in what is read, columns or rows.
double TurnOfScan(const TimedPair& pair, const Calibration& a, const Calibration& b) {
  if (a.pair_effects().set == nullptr) return 0.0;
  const auto shares = [&](const Calibration& c) {
    return ScanOf(ShutterOf(c), Eigen::Vector2d(c.width_px, c.height_px), c.pair_effects(),
                  pair.first())
        .shares;
  };
  return (shares(a) - shares(b)).cwiseAbs().maxCoeff();
}

// How far the frames' own times wander together, for the covariance of the delay.
FrameWander FindWander(const std::vector<PairTimes>& times, PairGraph* graph) {
  const LateFrames& late = graph->late_frames();
  FrameWander white;
  white.white_s = graph->frame_time_spread_s();
  const FrameWander wander = MostLikelyWander(times, white.white_s, late);
  graph->SetSharedFrameTime(wander.slow_s > 0.0
                                ? std::max(0.0, VarianceOfShift(times, wander, late) -
                                                    VarianceOfShift(times, white, late))
                                : 0.0);
  return wander;
}

// A tenth of a sigma. Robust weights and strong correlations (f and k1) make steps fall short.
constexpr double kCostTolerance = 0.005;

// Before the noise scale has settled, a solve is there for the scale, and the next one goes on. A
// step that lowers the cost by less than this fraction changes it by half of that.
constexpr double kRoughly = 1e-4;

constexpr int kLeastPairs = 10;

// A frame that is later than this is not found [s]: the next one has come by then.
constexpr double kLatestS = 0.03;

// The first solve has a scale of the noise that is the misfit of the start; the second one shows
// where a fit goes.
constexpr int kRoundsToGetLost = 2;

// Without parallax many directions fit a pair equally well; which one fits best changes with every
// step of the state, and the state with them: it may wander for ever, by half a sigma to a whole
// one in each round (Refinement.SettlesWhereDirectionsMeanNothing). After two rounds that move it
// by no more than this (Mahalanobis distance), a direction is left only for one that saves what a
// wrong match costs, then twice as much, and so on. Not while the state still goes somewhere, by
// more in a round: other directions are what it takes then
// (docs/lab/pairs.md#directions-that-wander).
constexpr double kWandering = 1.5;
constexpr int kRoundsOfWandering = 2;

double KeptBytes(const std::vector<TimedPair>& pairs, const PairGraphOptions& options) {
  double bytes = 0.0;
  for (const TimedPair& pair : pairs) {
    // Lens, shutter, mounting, direction, bend; rates at both ends and a few for the readout.
    const double rates = 4.0 + (pair.time_b_s - pair.time_a_s) / options.rate_step_s;
    const double columns = kLensSize + kShutterSize + 4 + 3 + 6 + 3.0 * rates;
    bytes += sizeof(double) * columns * static_cast<double>(pair.matches.size());
  }
  return bytes;
}

// Noise scale, directions and solve in turns.
class Refinement {
 public:
  Refinement(const EstimationInput& input, const std::vector<TimedPair>& pairs,
             const Calibration& start, const Prior& prior, const RefinementOptions& options)
      : input_(input),
        pairs_(pairs),
        prior_(prior),
        options_(options),
        graph_options_(options.graph),
        facts_((pairs.empty() ? *options.graph.residual : ResidualOf(pairs.front(), options.graph))
                   .facts()),
        noise_(facts_, input, pairs, options.graph.gyro_sigma_rad_s) {
    if (!pairs.empty()) graph_options_.residual = &ResidualOf(pairs.front(), options.graph);
    noise_now_.scale = graph_options_.first_sigma();
    graph_options_.late_margin_s = kLatestS;
    result_.calibration = start;
  }

  Result<Refined> Run() {
    for (result_.rounds = 1; result_.rounds <= options_.max_rounds; ++result_.rounds) {
      const Calibration before = result_.calibration;
      if (graph_ == nullptr || IsBuiltForOthers(before)) {
        if (const Status built = Build(); !built) return tl::unexpected(built.error());
      }
      // Every round searches the directions anew: with the calibration of the round before, another
      // minimum may be the right one (little parallax has several).
      if (result_.rounds == 1) {
        FindFirstScale();
      } else if (facts_.has_direction) {
        graph_->AllResiduals(/*search=*/true, LeastGainOfDirection());
      }
      // A fit that has settled has done so, and it takes long.
      if (options_.latents == nullptr || options_.latents->planes.empty()) {
        graph_->SearchFrameTimes(options_.frame_times_alone ? TimesAlone() : nullptr);
      }
      const SolveReport report = Solve();
      if (!report.usable) return CannotEstimate("the solver failed: " + report.message);

      const bool spread_settled =
          graph_->UpdateFrameTimes(options_.settled_scale, &result_.frame_times);
      const auto residuals = graph_->AllResiduals(/*search=*/false);
      const Noise next = NextNoise(residuals);
      result_.calibration = graph_->Estimate();
      std::optional<double> moved;
      if (yardstick_) moved = yardstick_->Distance(before, result_.calibration);
      if (moved) wandering_rounds_ = *moved < kWandering ? wandering_rounds_ + 1 : 0;
      const bool lost = IsLost(before, next.scale);
      const bool last = lost || result_.rounds == options_.max_rounds;
      scale_settled_ = SameNoise(next) && spread_settled;
      if (!scale_settled_ && !last) {
        SetNoise(next);
        continue;
      }
      // Where the next round would start from is not worth a covariance; the end is.
      const bool settled =
          options_.frame_times_alone ? solved_finely_ : moved && *moved < options_.settled_round;
      if (!settled && !last) continue;
      if (const Status judged = Judge(before, residuals); !judged) {
        return tl::unexpected(judged.error());
      }
      if (result_.converged || lost) break;
    }
    result_.latents = std::make_shared<PairLatents>(graph_->Latents());
    for (size_t i = 0; i < ids_.size(); ++i) result_.noise_factors[ids_[i]] = noise_now_.factors[i];
    return std::move(result_);
  }

 private:
  // Rates are kept around the pairs as the delay and the spread of the frames' times were when they
  // were added, the pairs' directions bend along what was read then, and the rates of the samples
  // of one value differ as they did with the effects of then.
  bool IsBuiltForOthers(const Calibration& now) const {
    constexpr double kTurnedScan = 0.2;  // of the readout: bends are small
    if (LargestShift(pairs_, now, built_at_) > 0.5 * graph_options_.rate_margin_s) return true;
    if (TurnOfScan(pairs_.front(), now, built_at_) > kTurnedScan) return true;
    constexpr double kGrownSpread = 1.5;  // of six spreads, four are left then (RateMargin)
    if (graph_->has_frame_times() &&
        graph_->frame_time_spread_s() > kGrownSpread * built_at_spread_s_) {
      return true;
    }
    if (now.effects == nullptr || facts_.of_attitudes) return false;
    return NeglectedPx(input_.rates, graph_options_, built_at_.lens[kFocal], *now.effects,
                       built_at_.effect_values, now.effect_values) > graph_options_.rate_step_px;
  }

  // The graph at the present calibration.
  Status Build() {
    std::map<int64_t, double> factors;
    for (const TimedPair& pair : pairs_) factors[pair.id] = pair.noise_factor;
    for (size_t i = 0; i < ids_.size(); ++i) factors[ids_[i]] = noise_now_.factors[i];
    graph_options_.sigma = noise_now_.scale;
    // Where little is asked for, derivatives by all the rest cost more than what is kept saves.
    const bool keep = !graph_options_.hold_shared &&
                      KeptBytes(pairs_, graph_options_) <= options_.most_kept_bytes;
    graph_options_.keep_within_sigmas = keep ? 0.0 : -1.0;
    built_at_ = result_.calibration;
    std::shared_ptr<const PairLatents> latents = options_.latents;
    if (graph_ != nullptr) {  // directions and rates have come with what was wrong
      latents = std::make_shared<PairLatents>(PairLatents{{}, graph_->OwnTimes(), {}});
    }
    graph_ = std::make_unique<PairGraph>(built_at_, prior_, graph_options_, std::move(latents));
    if (graph_->has_frame_times()) built_at_spread_s_ = graph_->frame_time_spread_s();
    for (const TimedRate& rate : input_.rates) graph_->AddRate(rate);
    result_.skipped_pairs = 0;
    for (const TimedPair& pair : pairs_) {
      if (graph_->AddPair(pair) != AddPairResult::kAdded) ++result_.skipped_pairs;
    }
    if (graph_->num_pairs() < kLeastPairs) {
      return CannotEstimate("only " + std::to_string(graph_->num_pairs()) +
                            " pairs of frames can be used (at least " +
                            std::to_string(kLeastPairs) +
                            " are needed): the others lack matches or gyro samples");
    }
    ids_ = graph_->pair_ids();
    noise_now_.factors.clear();
    for (const int64_t id : ids_) noise_now_.factors.push_back(factors.at(id));
    SetNoise(noise_now_);
    return {};
  }

  bool IsLost(const Calibration& before, double noise) const {
    return result_.rounds >= kRoundsToGetLost && options_.is_lost &&
           options_.is_lost(before, result_.calibration, noise);
  }

  // The scale at the start, misfit included, so that a poor start is not cut off by the loss;
  // directions depend on it.
  void FindFirstScale() {
    const Noise searched_at = noise_now_;  // as the pairs were added
    SetScale(noise_.Next(graph_->AllResiduals(/*search=*/false), noise_now_.scale));
    const bool same = SameNoise(searched_at);
    scale_settled_ = same && options_.latents != nullptr;
    if (facts_.of_attitudes || same) return;
    SetScale(noise_.Next(graph_->AllResiduals(/*search=*/true), noise_now_.scale));
  }

  struct Noise {  // of a pair: scale * factor
    double scale = 1.0;
    std::vector<double> factors;  // as ids_
  };

  // After a solve.
  Noise NextNoise(std::vector<std::vector<double>> residuals) const {
    Noise next;
    next.factors = noise_now_.factors;
    if (options_.find_noise_factors && facts_.has_direction) {
      std::vector<std::vector<double>> differences(residuals.size());
      ParallelFor(residuals.size(), [&](size_t i) {
        differences[i] = NeighbourDifferences(graph_->MatchesOf(ids_[i]), residuals[i]);
      });
      next.factors = noise_.FactorsOfPairs(differences, next.factors);
    }
    for (size_t i = 0; i < residuals.size(); ++i) {
      for (double& r : residuals[i]) r *= noise_now_.factors[i] / next.factors[i];
    }
    next.scale = noise_.Next(residuals, noise_now_.scale);
    return next;
  }

  bool SameNoise(const Noise& other) const {
    const double settled = options_.settled_scale;
    double changes_sq = 0.0;
    for (size_t i = 0; i < ids_.size(); ++i) {
      const double change = std::abs(std::log(other.factors[i] / noise_now_.factors[i]));
      changes_sq += std::pow(std::min(change, 3.0 * settled), 2);
    }
    return std::abs(other.scale / noise_now_.scale - 1.0) < settled &&
           changes_sq < settled * settled * static_cast<double>(ids_.size());
  }

  void SetNoise(const Noise& noise) {
    noise_now_ = noise;
    for (size_t i = 0; i < ids_.size(); ++i) {
      graph_->SetSigma(ids_[i], noise_now_.scale * noise_now_.factors[i]);
    }
  }
  void SetScale(double scale) { SetNoise({scale, noise_now_.factors}); }

  // Where the noise scale has settled, the state decides when to stop: the directions of pairs that
  // hardly determine theirs creep along flat valleys, for dozens of steps that move nothing else.
  // Before, what is a sigma may still change a lot: with a lens that is far off, for example.
  SolveReport Solve() {
    SolveOptions options{30, kRoughly};
    solved_finely_ = scale_settled_ || result_.rounds == options_.max_rounds;
    if (solved_finely_) options = {30, 1e-5, kCostTolerance};
    yardstick_.reset();
    if (scale_settled_ && !options_.frame_times_alone) {
      if (const auto covariance = graph_->NoiseCovariance()) yardstick_.emplace(*covariance);
    }
    Calibration last = graph_->Estimate();
    if (options_.frame_times_alone && !result_.frame_times.empty()) {  // from the second round on
      options.settled = [this, last_s = graph_->OwnTimes()]() mutable {
        auto now_s = graph_->OwnTimes();
        const bool settled = FrameTimesHaveSettled(result_.frame_times, last_s, now_s);
        last_s = std::move(now_s);
        return settled;
      };
    } else if (yardstick_) {
      options.settled = [&] {
        const Calibration now = graph_->Estimate();
        const double step = yardstick_->Distance(last, now);
        last = now;
        return step < kSettledStep;
      };
    }
    GiveBackFreeMemory();  // of the covariances, before the Jacobian takes as much again
    return graph_->Solve(options);
  }

  PairGraph::TimesAlone TimesAlone() const {
    return [this, now = graph_->Estimate()](int64_t id, PairTimes* times) {
      const auto pair = std::find_if(pairs_.begin(), pairs_.end(),
                                     [id](const TimedPair& p) { return p.id == id; });
      return TimesOfPairAlone(input_, *pair, now, noise_now_.scale, graph_options_, times);
    };
  }

  // By how much another direction has to fit a pair better [sigmas^2].
  double LeastGainOfDirection() const {
    const int more = wandering_rounds_ - kRoundsOfWandering;
    return more < 0 ? 0.0 : std::ldexp(std::pow(graph_options_.inlier_sigmas(), 2), more);
  }

  // Covariance, quality, and whether the last round has moved the estimate.
  Status Judge(const Calibration& before, const std::vector<std::vector<double>>& residuals) {
    const StateVector moved = Difference(result_.calibration, before);
    const CrossFit cross_fit = graph_->CrossFitOfAll();
    if (graph_->has_frame_times()) {
      const std::vector<PairTimes> times = graph_->FrameTimes(cross_fit.inflation());
      result_.frame_wander = FindWander(times, graph_.get());
      result_.late_frames = graph_->late_frames();
      result_.frame_times = result_.frame_wander.slow_s > 0.0
                                ? OffsetsOf(times, result_.frame_wander, result_.late_frames)
                                : OffsetsOf(times, graph_->frame_time_law());
    }
    if (options_.frame_times_alone) {
      result_.converged = true;
      return {};
    }
    if (const Status known = graph_->EstimateCovariance(options_.cluster_s, cross_fit.inflation(),
                                                        &result_.calibration);
        !known) {
      return known;
    }
    FitSum sum(graph_options_, facts_.per_match, facts_.lost_per_pair);
    for (size_t i = 0; i < residuals.size(); ++i) sum.Add(residuals[i], noise_now_.factors[i]);
    FitQuality& q = result_.quality = FitQuality();
    q.pairs = graph_->num_pairs();
    q.noise_px = noise_now_.scale;
    double scatter_sq = 0.0;
    for (const double factor : noise_now_.factors) scatter_sq += std::pow(std::log(factor), 2);
    q.noise_scatter = std::sqrt(scatter_sq / static_cast<double>(noise_now_.factors.size()));
    q.design_effect = cross_fit.neighbours.DesignEffect();
    q.matches = sum.matches();
    q.rms_px = noise_now_.scale * sum.rms();
    q.usual_rms_px = noise_now_.scale * sum.usual_rms();
    q.inlier_ratio = sum.inlier_ratio();
    result_.converged =
        (moved.cwiseAbs().array() < options_.settled_round * result_.calibration.sigma().array())
            .all();
    return {};
  }

  const EstimationInput& input_;
  const std::vector<TimedPair>& pairs_;
  const Prior& prior_;
  const RefinementOptions& options_;
  PairGraphOptions graph_options_;
  const PairResidual::Facts& facts_;
  const NoiseScale noise_;
  std::unique_ptr<PairGraph> graph_;
  std::vector<int64_t> ids_;
  Calibration built_at_;
  double built_at_spread_s_ = 0.0;
  Noise noise_now_;
  bool scale_settled_ = false, solved_finely_ = false;
  std::optional<Yardstick> yardstick_;
  int wandering_rounds_ = 0;  // in a row, as far as rounds have a yardstick
  Refined result_;
};

}  // namespace

Result<Refined> Refine(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                       const Calibration& start, const Prior& prior,
                       const RefinementOptions& options) {
  Result<Refined> refined = Refinement(input, pairs, start, prior, options).Run();
  GiveBackFreeMemory();
  return refined;
}

void TakeNoiseFactors(const std::map<int64_t, double>& factors, std::vector<TimedPair>* pairs) {
  for (TimedPair& pair : *pairs) {
    const auto known = factors.find(pair.id);
    if (known != factors.end()) pair.noise_factor = known->second;
  }
}

}  // namespace camgyro
