#include "estimator/window/pair_selection.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/linear_algebra.h"
#include "core/robust_statistics.h"

namespace camgyro {
namespace {

constexpr int NumTerms(int degree) { return (degree + 1) * (degree + 2) / 2; }

// Variance of both coordinates together, robust, of pairs all over the recording [px^2]; negative
// if none has enough matches.
double UnsmoothVariance(const Recording& recording, int gap) {
  constexpr size_t kPairs = 100;
  if (recording.tracks.size() <= static_cast<size_t>(gap)) return -1.0;
  const Eigen::Vector2d size_px(recording.camera.width_px, recording.camera.height_px);
  const size_t usable = recording.tracks.size() - static_cast<size_t>(gap);
  const size_t step = std::max<size_t>(1, usable / kPairs);
  std::vector<double> of_pairs;
  for (size_t a = 0; a < usable; a += step) {
    const double variance = UnsmoothVariance(
        MatchesBetween(recording.tracks[a], recording.tracks[a + static_cast<size_t>(gap)]),
        size_px);
    if (variance >= 0.0) of_pairs.push_back(variance);
  }
  return MedianOr(of_pairs, -1.0);
}

}  // namespace

double UnsmoothVariance(const std::vector<Match>& matches, const Eigen::Vector2d& size_px) {
  constexpr int kHighest = 3, kMatchesPerTerm = 3;
  const auto n = static_cast<Eigen::Index>(matches.size());
  int degree = kHighest;
  while (degree >= 0 && n < kMatchesPerTerm * NumTerms(degree)) --degree;
  if (degree < 0) return -1.0;
  Eigen::MatrixXd A(n, NumTerms(degree));
  Eigen::MatrixX2d moved(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Match& match = matches[static_cast<size_t>(i)];
    const Eigen::Vector2d at = match.px_a.cwiseQuotient(size_px) - Eigen::Vector2d(0.5, 0.5);
    int term = 0;
    for (int p = 0; p <= degree; ++p) {
      for (int q = 0; p + q <= degree; ++q) {
        A(i, term++) = std::pow(at.x(), p) * std::pow(at.y(), q);
      }
    }
    moved.row(i) = match.px_b - match.px_a;
  }
  // Least squares with Huber's weights: what is near, and wrong matches, pull by their direction.
  constexpr int kIterations = 5;
  constexpr double kHuber = 1.5;  // of the scale
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(n);
  Eigen::MatrixX2d rest;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Eigen::MatrixXd WA = weights.asDiagonal() * A;
    rest = moved - A * SymmetricSolver(A.transpose() * WA).Solve(WA.transpose() * moved);
    const Eigen::VectorXd lengths = rest.rowwise().norm();
    std::vector<double> sorted(lengths.data(), lengths.data() + n);
    const double limit = kHuber * MedianInPlace(&sorted);
    weights = (limit * lengths.cwiseMax(1e-9).cwiseInverse()).cwiseMin(1.0);
  }
  double variance = 0.0;
  for (int k = 0; k < 2; ++k) {
    const Eigen::VectorXd magnitudes = rest.col(k).cwiseAbs();
    std::vector<double> sorted(magnitudes.data(), magnitudes.data() + n);
    variance += std::pow(kSigmaOfMedian * MedianInPlace(&sorted), 2);
  }
  return variance * static_cast<double>(n) / static_cast<double>(n - NumTerms(degree));
}

double ParallaxPerFrame(const Recording& recording, int gap) {
  const double near = UnsmoothVariance(recording, 1), far = UnsmoothVariance(recording, gap);
  if (near < 0.0 || far < 0.0) return std::numeric_limits<double>::infinity();
  // near = noise + p^2, far = noise + (gap p)^2, and a coordinate has half of the noise.
  const double of_frame = std::max(0.0, far - near) / (gap * gap - 1.0);
  const double noise = 0.5 * std::max(1e-12, near - of_frame);
  return std::sqrt(of_frame / noise);
}

double NoiseOfSmoothMotion(const Recording& recording, const PairSelection& selection) {
  const double variance = UnsmoothVariance(recording, 1);
  if (variance < 0.0) return std::numeric_limits<double>::infinity();
  // Of two coordinates; where a tracker re-anchors, errors add up from frame to frame, else both
  // observations have theirs.
  return std::sqrt(recording.match_noise == MatchNoise::kSecondImage
                       ? selection.gap * variance / 2.0
                       : variance / 4.0);
}

PairSelection SelectPairs(const Recording& recording, const GapLimits& limits) {
  // A little more than 0.1 s, so that 3 frames of a camera of 29.95 Hz are not too long.
  constexpr double kLongestS = 0.2, kLongestReanchoredS = 0.101;
  PairSelection selection;
  if (!recording.matches.empty() || recording.tracks.empty()) return selection;
  const bool reanchored = recording.match_noise == MatchNoise::kSecondImage;
  const double interval_s = MedianInterval(recording.frames);
  const int frames = static_cast<int>(recording.tracks.size());
  const auto matches = [&](int gap) {
    size_t count = 0;
    for (size_t b = static_cast<size_t>(gap); b < recording.tracks.size(); ++b) {
      count += CountMatches(recording.tracks[b - static_cast<size_t>(gap)], recording.tracks[b]);
    }
    return static_cast<double>(count);
  };
  const double neighbours = matches(1);
  // Takes the gap if the limits allow it.
  const auto take = [&](int gap, double longest_s) {
    const int stride = reanchored ? gap : 2;
    if (gap > limits.gap || gap * interval_s > longest_s ||
        frames < limits.least_pairs * stride + gap ||
        matches(gap) < kLeastMatchesOfGap * neighbours) {
      return false;
    }
    selection = {gap, stride};
    return true;
  };
  if (reanchored) {
    int gap = 2;
    while (take(gap, kLongestReanchoredS)) ++gap;
    return selection;
  }
  int gap = 3;
  while (take(gap, kLongestS)) gap += 2;
  if (selection.gap < 3) return selection;
  const double parallax = ParallaxPerFrame(recording, selection.gap);
  gap = selection.gap;
  const bool far = gap * parallax < kLeastParallax;
  if (far) {
    const int farthest = std::min(limits.gap, static_cast<int>(limits.far_s / interval_s));
    const bool turns = limits.turn_s < limits.far_s && farthest > gap &&
                       farthest * ParallaxPerFrame(recording, farthest) < kLeastFarParallax;
    const double longest_s = turns ? limits.turn_s : limits.far_s;
    while (gap * parallax < kLeastParallax && take(gap + 2, longest_s)) gap += 2;
  }
  selection.far = far;
  return selection;
}

}  // namespace camgyro
