// The estimation problem of camgyro as a factor graph: one set of global parameters, a translation
// direction per pair of frames, rates and biases along the gyro's time. The sliding window and the
// refinement are two ways to fill and empty it.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_H_

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/calibration.h"
#include "core/result.h"
#include "estimator/window/cross_fit.h"
#include "estimator/window/factor_graph.h"
#include "estimator/window/frame_times.h"
#include "estimator/window/kept_cost.h"
#include "estimator/window/pair_graph_options.h"
#include "estimator/window/pair_view.h"
#include "estimator/window/rate_groups.h"
#include "estimator/window/timed_pair.h"
#include "estimator/window/track_lean.h"
#include "factors/coplanarity_plane.h"
#include "factors/pair_bearings.h"

namespace camgyro {

// What a graph has found for each pair and frame: where another fit of them begins.
struct PairLatents {
  // In the gyro frame at a time that the rates of another graph have, too: a graph's own reference,
  // the frame at the first rate of a pair, depends on what it adds before that pair, and on how far
  // around it.
  struct Plane {
    PairPlane plane;
    double time_s = 0.0;  // in the middle of the pair's rates
  };
  std::map<int64_t, Plane> planes;          // by pair
  std::map<int64_t, double> frame_times_s;  // by PairGraph::FrameNumber
  RatesFound rates;

  // Of the two frames; none where one of them has none.
  std::optional<Eigen::Vector2d> TimesOf(const TimedPair& pair) const;
};

class PairGraph {
 public:
  static constexpr int kMinMatches = 8;

  // start: values with effects. prior: of the values without effects (zero bias, guess of the
  // files, ...); its sigmas are positive (CHECKed). Each effect brings a prior of its own.
  // latents: where pairs start that it has; it is read while pairs are added. null: directions are
  // searched, and frames' times start at zero.
  PairGraph(const Calibration& start, const Prior& prior, const PairGraphOptions& options,
            std::shared_ptr<const PairLatents> latents = nullptr);

  // Samples in time order (CHECKed).
  void AddRate(const TimedRate& rate) { rates_.Add(rate); }
  // Adds a pair: its matches, or the rotation between its attitudes if that is the residual. Pairs
  // come in the order of their first frame; times are recorded stamps in seconds from the graph's
  // origin. A pair that is not added changes nothing.
  AddPairResult AddPair(const TimedPair& pair);

  SolveReport Solve(const SolveOptions& options);

  // Marginalises the oldest pair with its direction and the rates and biases that only it needs.
  // skew_walk_rtHz: the clocks' rates walk (effect clock_skew): by that in a second [1/sqrt(s)],
  // from the oldest pair to the next. What was likely before is then marginalised, too, so that it
  // is forgotten with the rest. Errors: those of FactorGraph::Marginalize; then nothing has
  // changed.
  Status MarginalizeOldest(double skew_walk_rtHz = 0.0);
  // Drops the samples before a time on the gyro clock that no pair in the graph needs.
  void ForgetOldRates(double before_s) { rates_.Forget(before_s); }

  int num_pairs() const { return static_cast<int>(pairs_.size()); }
  std::vector<int64_t> pair_ids() const;

  // Those that have a residual, in its order.
  const std::vector<Match>& MatchesOf(int64_t id) const {
    return pairs_.at(id).measurement->matches;
  }
  // PairResidual::Independent of a pair at the present estimate. With `search`, its direction is
  // first searched anew, and stored if it is better. Empty if a ray is missing.
  std::vector<double> Residuals(int64_t id, bool search) {
    return Residuals(id, search, /*least_gain=*/0.0, &bearings_);
  }
  // Without a search; adds how far each match is to one side of its plane, where pairs have a
  // direction. While a pair keeps its linearisation, these are those of before: they have changed
  // by less than the bounds of KeptCost.
  std::vector<double> ResidualsWithLeans(int64_t id, TrackLeans* leans);
  // Takes the matches of these tracks (ascending ids) out of the pairs, where kMinMatches are left.
  void LeaveOutTracks(const std::vector<int64_t>& track_ids);
  // Of all pairs, in the order of pair_ids. With `search`, a direction is stored if its cost is
  // less by more than least_gain [sigmas^2].
  std::vector<std::vector<double>> AllResiduals(bool search, double least_gain = 0.0);
  // The same residuals under the pair's own direction, and each under the direction that fits the
  // other half of the matches: see CrossFit.
  CrossFit CrossFitOf(int64_t id) { return CrossFitOf(id, &bearings_); }
  CrossFit CrossFitOfAll();
  // Sets the noise of a pair already in the graph: pixels, or radians of a rotation.
  void SetSigma(int64_t id, double sigma);
  PairGraphOptions* options() { return &options_; }

  // Column of effect clock_skew among the effects' values; -1: it is not in the model.
  int skew_column() const;

  // Whether frames have times of their own here (frame_stamp_jitter).
  bool has_frame_times() const { return frame_time_spread_s_ != nullptr; }
  // What each pair says of them at the present estimate of everything else; frames are named by
  // FrameNumber. Less by the factor that widens a covariance (CrossFit::inflation): directions have
  // taken noise for themselves there, too.
  std::vector<PairTimes> FrameTimes(double inflation = 1.0) const;
  static int64_t FrameNumber(double stamp_s);  // [ns]
  // Searches the times of frames where they may be caught in a minimum that is not the deepest: a
  // frame that is late by so much that most of its matches look wrong pulls no solve to its time,
  // since the loss is bounded. Sets what is better, and then which frames are late. Does nothing
  // where frames have no times of their own. alone: what a pair tells by itself (TimesOfPairAlone),
  // if it is known; it is asked by several threads. With it, the pairs are of frames that follow
  // each other, in their order.
  using TimesAlone = std::function<bool(int64_t id, PairTimes* times)>;
  void SearchFrameTimes(const TimesAlone& alone = {});
  // Their law, for the solves to come and for Estimate, where the spread is an effect's parameter,
  // which no residual depends on.
  void SetFrameTimeLaw(const FrameTimeLaw& law);
  FrameTimeLaw frame_time_law() const {
    return {{*frame_time_spread_s_, frame_time_spread_sigma_s_}, late_frames_};
  }
  double frame_time_spread_s() const { return *frame_time_spread_s_; }
  const LateFrames& late_frames() const { return late_frames_; }
  // Sets the most likely law of the times that the frames have now; offsets: the times by it. True
  // if the spread has settled: within a share, as the scale of the noise, or so small that no match
  // shows it. Where frames have no times of their own it has, and nothing is set.
  bool UpdateFrameTimes(double settled, std::vector<FrameOffset>* offsets);
  // What frames' own times may share, beyond what their spread allows for: it is in the covariance
  // of the delay from now on [s^2].
  void SetSharedFrameTime(double variance_s2) { shared_frame_time_s2_ = variance_s2; }
  std::map<int64_t, double> OwnTimes() const;  // [s], by FrameNumber
  PairLatents Latents() const;

  // The estimate. With covariance: of the present graph, inflated by the clustered (sandwich)
  // covariance where that is larger; `cluster_s` is the length of a cluster, and there must be at
  // least 8 of them. The bias is the mean over its blocks.
  Calibration Estimate() const;
  // `inflation` (>= 1): of the graph's covariance, before that.
  // Errors: those of FactorGraph::Covariance, and kCannotEstimate without pairs.
  // `at`: the delay is that of a frame, as DelayOf has it, instead of the parameter.
  Status EstimateCovariance(double cluster_s, double inflation, Calibration* calibration,
                            const std::optional<FrameTime>& at = std::nullopt) const;

  // Of state and effects, in this order, as the factors alone have it: not widened. Errors: those
  // of EstimateCovariance.
  Result<Eigen::MatrixXd> NoiseCovariance() const;

  const FactorGraph& graph() const { return graph_; }

 private:
  struct Pair {
    std::shared_ptr<PairMeasurement> measurement;  // the factor reads its noise at every evaluation
    std::shared_ptr<KeptCost> kept;                // the factor's cost, if it is one
    std::vector<int64_t> groups;
    FactorGraph::FactorKey factor = 0;
    double time_s = 0.0;
    BendVector bend_sigma_rad;              // prior
    FactorGraph::FactorKey bend_prior = 0;  // of pairs that have a bend
    std::vector<int64_t> frame_times;       // blocks of its two frames' times, if they have any
    // Of ResidualsWithLeans, while the linearisation is still the one that it was then.
    struct {
      int64_t linearisation = 0;
      std::vector<double> residuals;
      TrackLeans leans;
    } last;
  };

  const PairResidual& residual() const { return *options_.residual; }
  // The pair's factor, new or in place of the one before.
  void MakeFactor(int64_t id, Pair* pair);
  // A pair with these bearings, at the present estimate; a copy.
  PairView ViewOf(const Pair& pair, const PairBearings& bearings) const;
  // Beside each other for different pairs, with bearings of their own to work in.
  std::vector<double> Residuals(int64_t id, bool search, double least_gain, PairBearings* bearings);
  CrossFit CrossFitOf(int64_t id, PairBearings* bearings);
  // body(place in the order of pair_ids, id, bearings to work in), beside each other.
  void ForAllPairs(const std::function<void(size_t, int64_t, PairBearings*)>& body);
  void AddStatePrior(const Prior& prior);
  void AddEffectsPrior();
  PairEffects EffectsNow() const;
  // First and last exposure of a pair with the present estimate [s].
  std::pair<double, double> Exposures(const FrameTime& frame_a, const FrameTime& frame_b) const;
  // The pair without its rates.
  std::shared_ptr<PairMeasurement> Measure(const TimedPair& pair) const;
  // Drops the matches without a residual: a pair is solved as a whole. False if too few are left.
  [[nodiscard]] bool KeepMatches(const RateGroups::Cover& cover, PairMeasurement* pair) const;
  void AddDirection(int64_t id, Pair* pair);
  // R_ref_gyro at a time, by the rates of now.
  Eigen::Matrix3d ReferenceFrom(const Pair& pair, double time_s) const;
  void SetLateFrames(LateFrames late);
  // The frames' own times, if they have any.
  void AddFrameTimes(const TimedPair& timed, Pair* pair);
  // The blocks of a pair's factor.
  std::vector<BlockId> BlocksOf(int64_t id, const Pair& pair) const;
  // Of lens, shutter, rotation and effects.
  PairParameters SharedParameters() const;
  PairParameters ParametersOf(int64_t id, const Pair& pair) const;
  PairTimes FrameTimesOf(const Pair& pair) const;
  // Share of a pair's matches that are within the loss.
  double RightShare(int64_t id, PairBearings* bearings);
  // What SearchFrameTimes makes small: bounded residuals with the priors of all that is the pair's
  // own. residuals: of the pair.
  double CostOfTimes(int64_t id, const Pair& pair, const std::vector<double>& residuals) const;
  // Sets frames' times to those that are most likely by what pairs with enough right matches tell
  // where they are, and the others tell alone, where that is better for the pairs together. A chain
  // of pairs that a very late frame has put under tension is as it should be only when all of them
  // move. The pairs are chains of frames that follow each other.
  void TakeTimesOfPairsAlone(const std::vector<double>& shares, double right_share,
                             const TimesAlone& alone);
  // Of a pair that has fewer right matches than `right_share`; touched: the pairs that have one of
  // its frames. False if nothing better was found.
  bool SearchFrameTimesOf(int64_t id, const std::vector<int64_t>& touched, double right_share);
  // Moves times, direction and bend of a pair down to a minimum, at first without the loss.
  void DescendWithoutLoss(int64_t id, Pair* pair, PairBearings* bearings);
  // State and effects as functionals of the blocks. Errors: kCannotEstimate without pairs.
  Result<std::vector<FactorGraph::Functional>> StateFunctionals(
      const std::optional<FrameTime>& at = std::nullopt) const;
  // Derivatives of the delay of a frame's first row and column by the effects [s].
  Eigen::VectorXd DelayByEffects(const FrameTime& frame) const;
  // Of the clocks' rates since the oldest pair, if they are in the model.
  std::optional<FactorGraph::Walk> SkewWalk(double skew_walk_rtHz) const;
  // Beyond the exposures of a pair [s].
  double RateMargin() const;

  PairGraphOptions options_;
  std::shared_ptr<const PairLatents> start_;
  Calibration prior_mean_;                    // with the effects of the start
  const Eigen::VectorXd effect_prior_sigma_;  // Prior::effect_sigma
  std::shared_ptr<const EffectSet> effects_;  // null without effects that have parameters
  FactorGraph graph_;
  RateGroups rates_;
  double turn_sigma_rad_s_ = 0.0;  // of the options or, if wider, of the effects
  FactorGraph::FactorKey state_prior_ = 0, effects_prior_ = 0;
  // Null: frames have no times of their own. Shared with their priors.
  std::shared_ptr<double> frame_time_spread_s_;
  double frame_time_spread_sigma_s_ = 0.0, shared_frame_time_s2_ = 0.0;
  std::map<int64_t, FactorGraph::FactorKey> frame_time_priors_;  // by frame
  const std::shared_ptr<double> late_spread_s_ = std::make_shared<double>(kMostSpreadS);
  LateFrames late_frames_;  // those whose prior has late_spread_s_
  // By pair, the share of right matches when SearchFrameTimes found nothing better.
  std::map<int64_t, double> searched_in_vain_;
  std::map<int64_t, Pair> pairs_;
  PairBearings bearings_;  // of Residuals, which are called often: kept allocated
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_H_
