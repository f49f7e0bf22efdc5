// The estimation problem of camgyro as a factor graph: one set of global parameters, a translation
// direction per pair of frames, rates and biases along the gyro's time. The sliding window and the
// refinement are two ways to fill and empty it.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_H_

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "estimator/window/factor_graph.h"
#include "estimator/window/frame_times.h"
#include "factors/coplanarity_plane.h"
#include "factors/pair_bearings.h"
#include "factors/relative_rotation.h"

namespace camgyro {

// CoplanarityPlane, CoplanarityDeterminant (as in the paper), or SymmetricTransfer, which neglects
// translation and knows no effects.
enum class ResidualKind { kPlane, kDeterminant, kSymmetricTransfer };

// What PairGraph::Residuals holds.
struct ResidualCounts {
  int per_match = 1;
  // Degrees of freedom that a pair's own direction and its turn take; the rest of the turn lies
  // along the direction, where it changes nothing.
  int lost_per_pair = 4;
};
inline ResidualCounts CountsOf(ResidualKind kind) {
  return kind == ResidualKind::kSymmetricTransfer ? ResidualCounts{2, 0} : ResidualCounts{};
}

struct PairGraphOptions {
  ResidualKind residual = ResidualKind::kPlane;
  MatchNoise match_noise = MatchNoise::kBothImages;
  double sigma_px = 1.0;          // of the pairs added from now on
  double robust_threshold = 2.5;  // in sigmas; 0: none
  // Within so many sigmas a match counts as an inlier, also without loss.
  double inlier_sigmas() const { return robust_threshold > 0.0 ? robust_threshold : 2.5; }
  // Prior of the bend of the path: how fast the direction of motion changes [rad/s]. Steps turn it
  // in phase with the rotation, so that what the prior takes from a turn becomes a bias of t_r, t_d
  // and b_g; much wider than the turns are, directions follow the noise, which biases, too.
  double turn_sigma_rad_s = 8.0;
  // Matches without a ray through the lens as the effects make it at the start are left out, for
  // good; else such a start has no solution. (Without effects, they always are.)
  bool drop_without_ray = false;
  // White noise of one gyro sample per axis (Jia & Evans section V.C); see GyroSigma.
  Eigen::Vector3d gyro_sigma_rad_s = Eigen::Vector3d::Constant(0.003);
  double bias_walk_rad_s2_rtHz = 1e-4;
  double bias_interval_s = 1.0;  // one bias block for each interval
  // Samples kept on both sides of a pair, so that delay and readout can move in a solve. Beyond,
  // rates are held.
  double rate_margin_s = 0.004;
  // Noise of the gyro is estimated as its mean over so long, or less where what that neglects, a
  // random walk of the angle within the step, would turn the picture by more than so many pixels
  // (rms); one value per sample where effects change the rates.
  double rate_step_s = 0.025;
  double rate_step_px = 0.05;
  // That many samples.
  int RateStep(double interval_s, double focal_px) const;
};

// One gyro sample of the graph's clock: seconds from the graph's origin.
struct TimedRate {
  double time_s = 0.0;
  Eigen::Vector3d omega_gyro_rad_s = Eigen::Vector3d::Zero();
  bool saturated = false;  // at the gyro's full scale: no pair may need it
};

// Sums of squared residuals, bounded as by the loss, of matches that had a say in their pair's
// direction and of the same matches without one. A direction that is the best of many which all say
// little takes more of the variance than its degrees of freedom, and where it takes noise for a
// direction, the information that is left is too large by as much.
struct CrossFit {
  double own = 0.0;       // under the pair's direction and bend, corrected for degrees of freedom
  double expected = 0.0;  // of the next, where every direction is well determined
  double unseen = 0.0;    // each half of the matches under direction and bend of the other half

  CrossFit& operator+=(const CrossFit& other) {
    own += other.own;
    expected += other.expected;
    unseen += other.unseen;
    return *this;
  }
  CrossFit operator*(double factor) const {
    return {factor * own, factor * expected, factor * unseen};
  }
  // By how much to widen the covariance of what the pairs determine (>= 1).
  double inflation() const {
    return own > 0.0 ? std::max(1.0, unseen / own) * std::max(1.0, unseen / expected) : 1.0;
  }
};

enum class AddPairResult {
  kAdded,
  kGyroTooLate,    // the samples do not reach to the end of the pair yet
  kGyroTooEarly,   // samples at the start of the pair are missing or were dropped
  kGyroGap,        // a hole in the gyro samples inside the pair, or a saturated sample
  kTooFewMatches,  // fewer than PairGraph::kMinMatches with a ray
};

class PairGraph {
 public:
  static constexpr int kMinMatches = 8;

  // start: values with effects. prior: of the values without effects (zero bias, guess of the
  // files, ...); its sigmas are positive (CHECKed). Each effect brings a prior of its own.
  PairGraph(const Calibration& start, const Prior& prior, const PairGraphOptions& options);

  // Samples in time order (CHECKed).
  void AddRate(const TimedRate& rate);
  // Adds the matches of a pair; pairs come in the order of their first frame. Times are
  // recorded stamps in seconds from the graph's origin.
  AddPairResult AddPair(int64_t id, const FrameTime& frame_a, const FrameTime& frame_b,
                        const std::vector<Match>& matches);
  // Adds a rotation between two camera attitudes (no pixels). sigma_rad > 0 per axis.
  AddPairResult AddRotation(int64_t id, const FrameTime& frame_a, const FrameTime& frame_b,
                            const Eigen::Quaterniond& q_a_b, double sigma_rad);

  SolveReport Solve(const SolveOptions& options);

  // Marginalises the oldest pair with its direction and the rates and biases that only it needs.
  void MarginalizeOldest();
  // Drops the samples before a time on the gyro clock that no pair in the graph needs.
  void ForgetOldRates(double before_s);

  int num_pairs() const { return static_cast<int>(pairs_.size()); }
  std::vector<int64_t> pair_ids() const;

  // Whitened independent residuals of a pair at the present estimate, without loss (CountsOf; three
  // of a rotation). With `search`, its direction is first searched anew, and stored if it is
  // better. Empty if a ray is missing.
  std::vector<double> Residuals(int64_t id, bool search);
  // The same residuals under the pair's own direction, and each under the direction that fits the
  // other half of the matches: see CrossFit.
  CrossFit CrossFitOf(int64_t id);
  // Sets the noise of a pair already in the graph: pixels, or radians of a rotation.
  void SetSigma(int64_t id, double sigma);
  PairGraphOptions* options() { return &options_; }

  // Whether frames have times of their own here (frame_stamp_jitter; planes and rotations only).
  bool has_frame_times() const { return frame_time_spread_s_ != nullptr; }
  // What each pair says of them at the present estimate of everything else; frames are named by
  // FrameNumber.
  std::vector<PairTimes> FrameTimes() const;
  static int64_t FrameNumber(double stamp_s);  // [ns]
  // Their spread, for the solves to come and for Estimate: of an effect's parameter, which no
  // residual depends on.
  void SetFrameTimeSpread(const Spread& spread);
  double frame_time_spread_s() const { return *frame_time_spread_s_; }

  // The estimate. With covariance: of the present graph, inflated by the clustered (sandwich)
  // covariance where that is larger; `cluster_s` is the length of a cluster, and there must be at
  // least 8 of them. The bias is the mean over its blocks.
  Calibration Estimate() const;
  // `inflation` (>= 1): of the graph's covariance, before that.
  bool EstimateCovariance(double cluster_s, double inflation, Calibration* calibration) const;

  const FactorGraph& graph() const { return graph_; }

 private:
  struct RateGroup {
    int64_t first_sample = 0;  // absolute sample number
    int count = 0;
    int64_t bias_index = 0;
    FactorGraph::FactorKey factor = 0;
    Eigen::Matrix3Xd base;  // see PairMeasurement::rate_base; empty with a step of 1
  };
  struct Pair {
    // Shared with the factor, which reads the noise at every evaluation. One of the two is null.
    std::shared_ptr<PairMeasurement> measurement;
    std::shared_ptr<RelativeRotation::Measurement> rotation;
    std::vector<int64_t> groups;
    FactorGraph::FactorKey factor = 0;
    double time_s = 0.0;
    BendVector bend_sigma_rad;              // prior
    FactorGraph::FactorKey bend_prior = 0;  // of pairs that have a bend
    std::vector<int64_t> frame_times;       // blocks of its two frames' times, if they have any
  };

  // Null without effects that have parameters.
  std::shared_ptr<const EffectSet> Effects() const {
    return prior_mean_.effects && prior_mean_.effects->size() > 0 ? prior_mean_.effects : nullptr;
  }
  PairEffects EffectsNow() const;
  // First and last exposure of a pair with the present estimate [s].
  std::pair<double, double> Exposures(const FrameTime& frame_a, const FrameTime& frame_b) const;
  // Makes the rate groups that cover [from_s, to_s] on the gyro clock; fills their ids.
  AddPairResult CoverWithRates(double from_s, double to_s, int step, std::vector<int64_t>* groups,
                               std::vector<double>* times, std::vector<int>* sizes);
  // Drops the matches without a transfer: a pair is solved as a whole. False if too few are left.
  [[nodiscard]] bool KeepTransferable(Pair* pair) const;
  // Samples per value of the rates of pairs with pixels.
  int RateStep() const;
  void AddBias(int64_t index);
  // The frames' own times, if they have any: fills Pair::frame_times and appends to `blocks`.
  void AddFrameTimes(const FrameTime& frame_a, const FrameTime& frame_b, Pair* pair,
                     std::vector<BlockId>* blocks);
  void AddEffectsPrior();
  std::array<const double*, 2> OwnTimesOf(const Pair& pair) const;
  PairTimes FrameTimesOf(const Pair& pair) const;
  // Beyond the exposures of a pair [s].
  double RateMargin() const;
  const TimedRate& sample(int64_t number) const {
    return samples_[static_cast<size_t>(number - first_sample_)];
  }
  // The sample as the rotation chain wants it.
  Eigen::Vector3d ChainRateOf(int64_t number) const;

  PairGraphOptions options_;
  Calibration prior_mean_;
  StateVector prior_sigma_;
  Eigen::Vector3d start_bias_ = Eigen::Vector3d::Zero();  // value of the first bias block
  FactorGraph graph_;
  double turn_sigma_rad_s_ = 0.0;  // of the options or, if wider, of the effects
  std::deque<TimedRate> samples_;
  int64_t first_sample_ = 0;  // absolute number of samples_.front()
  double median_interval_s_ = 0.0;
  int num_effects_ = 0;  // parameters of all effects
  FactorGraph::FactorKey effects_prior_ = 0;
  // Null: frames have no times of their own. Shared with their priors.
  std::shared_ptr<double> frame_time_spread_s_;
  double frame_time_spread_sigma_s_ = 0.0;
  std::map<int64_t, FactorGraph::FactorKey> frame_time_priors_;  // by frame
  std::map<int64_t, RateGroup> groups_;                          // by id, in time order
  int64_t next_group_ = 0;
  std::map<int64_t, Pair> pairs_;
  PairBearings bearings_;  // of Residuals, which are called often: kept allocated
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PAIR_GRAPH_H_
