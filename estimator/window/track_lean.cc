#include "estimator/window/track_lean.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

namespace camgyro {
namespace {

// Of chi-square with two degrees of freedom.
double PValueOfLean(double chi2) { return std::exp(-0.5 * chi2); }
double QuantileOfLean(double share) { return -2.0 * std::log(1.0 - share); }

}  // namespace

void TrackLeans::Add(int64_t track_id, double sigmas, const Eigen::Vector2d& correction_px) {
  const double length = correction_px.norm();
  if (track_id == Match::kNoTrack || !(length > 0.0)) return;
  const double size = std::min(std::abs(sigmas), TrackLean::kBound);
  const Eigen::Vector2d across = correction_px / length;
  Sums& sums = tracks_[track_id];
  ++sums.matches;
  sums.squares += size * size;
  sums.residuals += size * across;
  sums.directions += across * across.transpose();
}

void TrackLeans::Add(const TrackLeans& other) {
  for (const auto& [track_id, of_other] : other.tracks_) {
    Sums& sums = tracks_[track_id];
    sums.matches += of_other.matches;
    sums.squares += of_other.squares;
    sums.residuals += of_other.residuals;
    sums.directions += of_other.directions;
  }
}

void TrackLeans::KeepOnly(const TrackLeans& others) {
  for (auto track = tracks_.begin(); track != tracks_.end();) {
    track = others.tracks_.count(track->first) > 0 ? std::next(track) : tracks_.erase(track);
  }
}

std::vector<TrackLean> TrackLeans::All() const {
  double squares = 0.0, count = 0.0;
  for (const auto& entry : tracks_) {
    squares += entry.second.squares;
    count += entry.second.matches;
  }
  std::vector<TrackLean> leans;
  constexpr double kAlmostNothing = 1e-9;  // lines that are all parallel: no division by zero
  for (const auto& [track_id, sums] : tracks_) {
    if (sums.matches < TrackLean::kLeastMatches) continue;
    const Eigen::Matrix2d covariance =
        squares / count * (sums.directions + kAlmostNothing * Eigen::Matrix2d::Identity());
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
  const double model = std::max(1.0, sorted[sorted.size() / 4] / QuantileOfLean(0.25));
  // The k most leaning ones, for the largest k whose least p-value is below k / n of the share.
  const auto n = static_cast<double>(sorted.size());
  size_t named = 0;
  for (size_t k = 1; k <= sorted.size(); ++k) {
    const double p = PValueOfLean(sorted[sorted.size() - k] / model);
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

void EraseMatchesOf(const std::vector<int64_t>& track_ids, std::vector<Match>* matches) {
  const auto is_of_them = [&](const Match& match) {
    return std::binary_search(track_ids.begin(), track_ids.end(), match.track_id);
  };
  matches->erase(std::remove_if(matches->begin(), matches->end(), is_of_them), matches->end());
}

}  // namespace camgyro
