#include "estimator/moving_tracks.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "core/parallel.h"
#include "estimator/window/pair_view.h"

namespace camgyro {
namespace {

// A match's residual, as far as the test believes it.
struct BoundedResidual {
  int64_t track_id = 0;
  double size = 0.0;                                 // >= 0
  Eigen::Vector2d across = Eigen::Vector2d::Zero();  // unit, on the residual's side
};

std::vector<BoundedResidual> BoundedResidualsOf(const EstimationInput& input, const TimedPair& pair,
                                                const Calibration& calibration, double noise,
                                                const PairGraphOptions& options) {
  std::vector<BoundedResidual> bounded;
  PairView view;
  std::vector<MatchMisfit> misfits;
  if (!ResidualOf(pair, options)
           .Explain(input, pair, calibration, noise, options, &view, &misfits)) {
    return bounded;
  }
  for (size_t i = 0; i < misfits.size(); ++i) {
    const int64_t track_id = view.measurement.matches[i].track_id;
    const double length = misfits[i].correction_px.norm();
    if (track_id == Match::kNoTrack || !(length > 0.0)) continue;
    bounded.push_back({track_id,
                       std::min(std::abs(misfits[i].residual_px) / noise, TrackLean::kBound),
                       misfits[i].correction_px / length});
  }
  return bounded;
}

struct Sums {
  int matches = 0;
  Eigen::Vector2d residuals = Eigen::Vector2d::Zero();
  Eigen::Matrix2d directions = Eigen::Matrix2d::Zero();
};

// Of chi-square with two degrees of freedom.
double PValue(double chi2) { return std::exp(-0.5 * chi2); }
double Quantile(double share) { return -2.0 * std::log(1.0 - share); }

// Sets of ascending ids. What comes and goes at the threshold is not worth another fit.
bool AlmostTheSame(const std::vector<int64_t>& a, const std::vector<int64_t>& b) {
  constexpr double kShare = 0.1;
  std::vector<int64_t> differ;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(differ));
  return static_cast<double>(differ.size()) <=
         kShare * static_cast<double>(std::max(a.size(), b.size()));
}

}  // namespace

std::vector<TrackLean> LeanOfTracks(const EstimationInput& input,
                                    const std::vector<TimedPair>& pairs,
                                    const Calibration& calibration, double noise,
                                    const PairGraphOptions& options) {
  std::vector<std::vector<BoundedResidual>> of_pairs(pairs.size());
  ParallelFor(pairs.size(), [&](size_t i) {
    of_pairs[i] = BoundedResidualsOf(input, pairs[i], calibration, noise, options);
  });
  std::map<int64_t, Sums> tracks;
  double sum_sq = 0.0, count = 0.0;
  for (const auto& of_pair : of_pairs) {
    for (const BoundedResidual& residual : of_pair) {
      Sums& sums = tracks[residual.track_id];
      ++sums.matches;
      sums.residuals += residual.size * residual.across;
      sums.directions += residual.across * residual.across.transpose();
      sum_sq += residual.size * residual.size;
      count += 1.0;
    }
  }
  std::vector<TrackLean> leans;
  constexpr double kAlmostNothing = 1e-9;  // lines that are all parallel: no division by zero
  for (const auto& [track_id, sums] : tracks) {
    if (sums.matches < TrackLean::kLeastMatches) continue;
    const Eigen::Matrix2d covariance =
        sum_sq / count * (sums.directions + kAlmostNothing * Eigen::Matrix2d::Identity());
    leans.push_back(
        {track_id, sums.matches, sums.residuals.dot(covariance.ldlt().solve(sums.residuals))});
  }
  return leans;
}

std::vector<int64_t> MovingTracks(const std::vector<TrackLean>& leans) {
  if (leans.empty()) return {};
  std::vector<double> sorted;
  for (const TrackLean& lean : leans) sorted.push_back(lean.chi2);
  std::sort(sorted.begin(), sorted.end());
  const double model = std::max(1.0, sorted[sorted.size() / 4] / Quantile(0.25));
  // The k most leaning ones, for the largest k whose least p-value is below k / n of the share.
  const auto n = static_cast<double>(sorted.size());
  size_t named = 0;
  for (size_t k = 1; k <= sorted.size(); ++k) {
    const double p = PValue(sorted[sorted.size() - k] / model);
    if (p <= kFalseDiscoveries * static_cast<double>(k) / n) named = k;
  }
  if (named == 0 || static_cast<double>(named) > kMostMoving * n) return {};
  const double least = sorted[sorted.size() - named];
  std::vector<int64_t> moving;
  for (const TrackLean& lean : leans) {
    if (lean.chi2 >= least) moving.push_back(lean.track_id);
  }
  return moving;
}

std::vector<TimedPair> WithoutTracks(const std::vector<TimedPair>& pairs,
                                     const std::vector<int64_t>& track_ids) {
  std::vector<TimedPair> kept = pairs;
  for (TimedPair& pair : kept) {
    const auto left_out = [&](const Match& match) {
      return std::binary_search(track_ids.begin(), track_ids.end(), match.track_id);
    };
    pair.matches.erase(std::remove_if(pair.matches.begin(), pair.matches.end(), left_out),
                       pair.matches.end());
  }
  return kept;
}

Result<StillFit> FitWhatIsStill(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                                const PairGraphOptions& options, const FitOfPairs& fit) {
  Result<Refined> first = fit(pairs, nullptr);
  if (!first) return tl::unexpected(first.error());
  StillFit still;
  still.fit = *std::move(first);
  if (pairs.empty() || !ResidualOf(pairs.front(), options).facts().has_direction ||
      options.robust_threshold <= 0.0) {
    return still;
  }
  std::vector<int64_t> left_out;
  for (int test = 0; test < kMostTests; ++test) {
    const std::vector<TrackLean> leans =
        LeanOfTracks(input, pairs, still.fit.calibration, still.fit.quality.noise_px, options);
    std::vector<int64_t> moving = MovingTracks(leans);
    if (AlmostTheSame(moving, left_out)) break;
    std::vector<TimedPair> at_rest = WithoutTracks(pairs, moving);
    Result<Refined> next = fit(at_rest, &still.fit);
    if (!next) break;
    left_out = std::move(moving);
    still = {*std::move(next), std::move(at_rest), static_cast<int>(leans.size()),
             static_cast<int>(left_out.size())};
  }
  return still;
}

}  // namespace camgyro
