#include "estimator/window/refinement.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/robust_statistics.h"
#include "estimator/window/pair_view.h"
#include "factors/robust.h"

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

// Makes those effects anew that depend on the calibration; false if there are none.
bool RemakeEffects(const Recording& recording, Calibration* calibration) {
  if (calibration->effects == nullptr) return false;
  auto set = std::make_shared<EffectSet>();
  bool remade = false;
  const EffectSetup setup = MakeEffectSetup(recording, *calibration);
  for (const auto& item : calibration->effects->items()) {
    std::shared_ptr<const Effect> effect = item.effect;
    if (effect->depends_on_calibration()) {
      effect = item.entry->make(setup, item.shape);
      remade = true;
    }
    set->Add(item.entry, item.shape, effect);
  }
  calibration->effects = set;
  return remade;
}

// How well matches fit.
class FitSum {
 public:
  FitSum(const PairGraphOptions& options, int per_match)
      : options_(options), per_match_(per_match) {}
  // Independent residuals of some matches, in sigmas, without loss.
  void Add(const std::vector<double>& residuals) {
    for (size_t i = 0; i < residuals.size(); i += static_cast<size_t>(per_match_)) {
      const double length = Eigen::Map<const Eigen::VectorXd>(&residuals[i], per_match_).norm();
      const double bounded = Robustify(length, options_.robust_threshold).value;
      sum_sq_ += bounded * bounded;
      inliers_ += length <= options_.inlier_sigmas() ? 1 : 0;
      ++matches_;
    }
  }
  int matches() const { return matches_; }
  // Per residual.
  double rms() const { return std::sqrt(sum_sq_ / std::max(1, per_match_ * matches_)); }
  double inlier_ratio() const { return static_cast<double>(inliers_) / std::max(1, matches_); }

 private:
  const PairGraphOptions& options_;
  const int per_match_;
  double sum_sq_ = 0.0;
  int inliers_ = 0, matches_ = 0;
};

// The noise of the pairs [px, rad of attitudes] from residuals of which the rates, fitted as well,
// have taken a part.
class NoiseScale {
 public:
  // Attitudes that follow the gyro itself agree with it far better than its noise: less than this
  // share of it is never believed of them. It makes the variance of a turn 11 % larger. Smaller
  // scales say no more, and the factorisation of the information fails.
  static constexpr double kLeastShareOfGyro = 1.0 / 3.0;
  // Exact pixels, of simulations: no tracker comes near [px].
  static constexpr double kLeastPx = 1e-3;

  // sigma: of a gyro sample [rad/s]; lost: degrees of freedom of a pair that are its own.
  NoiseScale(const EstimationInput& input, const std::vector<TimedPair>& pairs,
             const Eigen::Vector3d& gyro_sigma_rad_s, bool rotations, int lost)
      : lost_(lost), least_(kLeastPx) {
    if (!rotations || input.rates.size() < 2) return;
    std::vector<double> gaps;
    for (const TimedPair& pair : pairs) gaps.push_back(pair.time_b_s - pair.time_a_s);
    const double interval_s = (input.rates.back().time_s - input.rates.front().time_s) /
                              static_cast<double>(input.rates.size() - 1);
    gyro_variance_ = gyro_sigma_rad_s.squaredNorm() / 3.0 * interval_s * MedianInPlace(&gaps);
    least_ = kLeastShareOfGyro * std::sqrt(gyro_variance_);
  }

  // residuals: in sigmas of `scale`, after a solve. Attitudes keep the share s^2 / (s^2 + g) of a
  // misfit with the variance s^2 + g, s being the scale and g the gyro's variance of a turn.
  double Next(const std::vector<std::vector<double>>& residuals, double scale) const {
    const double kept = scale * RobustScale(residuals, lost_);
    const double misfit = kept * (1.0 + gyro_variance_ / (scale * scale));
    const double variance = misfit * misfit - gyro_variance_;
    return std::max({1e-3 * scale, least_, std::sqrt(std::max(0.0, variance))});
  }

 private:
  int lost_;
  double least_;
  double gyro_variance_ = 0.0;  // of a turn between attitudes, per axis [rad^2]; 0 with pixels
};

// The spread of the frames' own times, if they have any, for the next solve. True if it has
// settled: within 3 %, as the scale of the noise, or so small that no match shows it.
bool UpdateFrameTimes(PairGraph* graph, std::vector<FrameOffset>* offsets) {
  if (!graph->has_frame_times()) return true;
  constexpr double kNothingS = 1e-5;
  const std::vector<PairTimes> times = graph->FrameTimes();
  const Spread spread = MostLikelySpread(times);
  const double before_s = graph->frame_time_spread_s();
  *offsets = OffsetsOf(times, spread.value_s);
  graph->SetFrameTimeSpread(spread);
  return std::abs(spread.value_s - before_s) < std::max(kNothingS, 0.03 * before_s);
}

// A tenth of a sigma. Robust weights and strong correlations (f and k1) make steps fall short.
constexpr double kCostTolerance = 0.005;

}  // namespace

Result<Refined> Refine(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                       const Calibration& start, const Prior& prior,
                       const RefinementOptions& options) {
  Refined result;
  result.calibration = start;
  PairGraphOptions graph_options = options.graph;
  const bool rotations = !pairs.empty() && pairs.front().matches.empty();
  const ResidualCounts counts = rotations ? ResidualCounts{1, 0} : CountsOf(graph_options.residual);
  const int lost = counts.lost_per_pair;
  std::unique_ptr<PairGraph> graph;
  std::vector<int64_t> ids;
  const auto all_residuals = [&](bool search) {
    std::vector<std::vector<double>> residuals;
    for (const int64_t id : ids) residuals.push_back(graph->Residuals(id, search));
    return residuals;
  };
  const NoiseScale noise(input, pairs, graph_options.gyro_sigma_rad_s, rotations, lost);
  double scale = rotations ? options.sigma_rad : graph_options.sigma_px;
  const auto set_scale = [&](double next) {
    scale = next;
    for (const int64_t id : ids) graph->SetSigma(id, scale);
  };
  Calibration built_at;
  double last_cost = 0.0;
  for (result.rounds = 1; result.rounds <= options.max_rounds; ++result.rounds) {
    const Calibration before = result.calibration;
    // Rates are kept around the pairs as the delay was when they were added.
    if (graph == nullptr ||
        LargestShift(pairs, before, built_at) > 0.5 * graph_options.rate_margin_s) {
      graph_options.sigma_px = scale;
      built_at = before;
      graph = std::make_unique<PairGraph>(before, prior, graph_options);
      for (const TimedRate& rate : input.rates) graph->AddRate(rate);
      result.skipped_pairs = 0;
      for (const TimedPair& pair : pairs) {
        const AddPairResult added =
            rotations ? graph->AddRotation(pair.id, pair.first(), pair.second(),
                                           pair.rotation.q_a_b, scale)
                      : graph->AddPair(pair.id, pair.first(), pair.second(), pair.matches);
        if (added != AddPairResult::kAdded) ++result.skipped_pairs;
      }
      if (graph->num_pairs() < 10) {
        return CannotEstimate("only " + std::to_string(graph->num_pairs()) +
                              " pairs of frames can be used (at least 10 are needed): the others "
                              "lack matches or gyro samples");
      }
      ids = graph->pair_ids();
    }
    if (result.rounds == 1) {
      // The scale at the start, misfit included, so that a poor start is not cut off by the loss;
      // directions depend on it.
      set_scale(noise.Next(all_residuals(false), scale));
      if (!rotations) set_scale(noise.Next(all_residuals(true), scale));
    }
    // Every round searches the directions anew: with the calibration of the round before, another
    // minimum may be the right one (little parallax has several).
    if (!rotations && result.rounds > 1) all_residuals(/*search=*/true);
    const SolveReport report = graph->Solve({30, 1e-5, kCostTolerance});
    if (!report.usable) return CannotEstimate("the solver failed: " + report.message);

    const bool spread_settled = UpdateFrameTimes(graph.get(), &result.frame_times);
    const auto residuals = all_residuals(/*search=*/false);
    const double next_scale = noise.Next(residuals, scale);
    result.calibration = graph->Estimate();
    const StateVector moved = Difference(result.calibration, before);
    const bool last = result.rounds == options.max_rounds;
    if ((std::abs(next_scale / scale - 1.0) > 0.03 || !spread_settled) && !last) {
      set_scale(next_scale);
      continue;
    }
    // Where the next round would start from is not worth a covariance; the end is.
    const bool costs_settled = std::abs(report.final_cost - last_cost) < 2e-4 * report.final_cost;
    last_cost = report.final_cost;
    if (!costs_settled && !last) continue;
    CrossFit cross_fit;
    for (const int64_t id : ids) cross_fit += graph->CrossFitOf(id);
    if (!graph->EstimateCovariance(options.cluster_s, cross_fit.inflation(), &result.calibration)) {
      return CannotEstimate("the information matrix is singular");
    }
    FitQuality& q = result.quality;
    q = FitQuality();
    q.pairs = graph->num_pairs();
    q.noise_px = scale;
    FitSum sum(graph_options, counts.per_match);
    for (const auto& pair : residuals) sum.Add(pair);
    q.matches = sum.matches();
    q.rms_px = scale * sum.rms();
    q.inlier_ratio = sum.inlier_ratio();
    result.converged = (moved.cwiseAbs().array() < 0.3 * result.calibration.sigma().array()).all();
    if (result.converged) break;
  }
  return result;
}

Refined SettleEffects(const Recording& recording, Refined fit, const Refit& refit) {
  constexpr int kMostTimes = 5;
  for (int i = 0; i < kMostTimes && RemakeEffects(recording, &fit.calibration); ++i) {
    Result<Refined> better = refit(fit.calibration, fit.quality.noise_px);
    if (!better) break;
    const Calibration& c = better->calibration;
    const StateVector moved = Difference(c, fit.calibration).cwiseQuotient(c.sigma());
    const Eigen::VectorXd effects_moved =
        (c.effect_values - fit.calibration.effect_values)
            .cwiseQuotient(c.effect_covariance.diagonal().cwiseSqrt());
    fit = *std::move(better);
    if (std::max(moved.cwiseAbs().maxCoeff(), effects_moved.cwiseAbs().maxCoeff()) < 0.1) break;
  }
  return fit;
}

UnseenFit EvaluateUnseen(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                         const Calibration& calibration, double noise_px,
                         const PairGraphOptions& options) {
  UnseenFit fit;
  FitSum sum(options, CountsOf(options.residual).per_match);
  PairView view;
  for (const TimedPair& pair : pairs) {
    if (options.residual == ResidualKind::kSymmetricTransfer) {
      if (!ViewPair(input, pair, calibration, noise_px, options, &view)) continue;
      if (view.bearings.a.size() < PairGraph::kMinMatches) continue;
      ++fit.pairs;
      sum.Add(TransferResiduals(view, calibration));
      continue;
    }
    PairPlane plane;
    if (!FitPair(input, pair, calibration, noise_px, options, &view, &plane, 0, 2)) continue;
    ++fit.pairs;
    std::vector<double> residuals;
    for (size_t i = 1; i < view.bearings.a.size(); i += 2) {
      residuals.push_back(ResidualOf(view, plane, i).value);
    }
    sum.Add(residuals);
  }
  fit.matches = sum.matches();
  fit.rms_px = noise_px * sum.rms();
  return fit;
}

}  // namespace camgyro
