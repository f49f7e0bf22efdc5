#include "frontend/outliers.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <random>

#include "core/so3.h"
#include "core/sphere.h"

namespace camgyro {
namespace {

cv::Point2d ToPoint(const Eigen::Vector2d& px) { return {px.x(), px.y()}; }

// Marks the matches of `members` that their RANSAC homography does not predict. OpenCV's RANSAC
// starts from a fixed seed; its own mask is that of four noisy matches, so the homography refined
// over that mask judges once more.
void MarkByHomography(const std::vector<Match>& matches, const std::vector<size_t>& members,
                      double threshold_px, std::vector<bool>* rejected) {
  std::vector<cv::Point2d> from, to, predicted;
  for (const size_t i : members) {
    from.push_back(ToPoint(matches[i].px_a));
    to.push_back(ToPoint(matches[i].px_b));
  }
  const cv::Mat homography = cv::findHomography(from, to, cv::RANSAC, threshold_px);
  if (!homography.empty()) cv::perspectiveTransform(from, predicted, homography);
  for (size_t k = 0; k < members.size(); ++k) {
    (*rejected)[members[k]] =
        homography.empty() || !(cv::norm(predicted[k] - to[k]) <= threshold_px);
  }
}

double TruncatedCost(const std::vector<CoplanarityNormal>& normals, const Eigen::Vector3d& tau,
                     double max_sq) {
  double cost = 0.0;
  for (const CoplanarityNormal& normal : normals) {
    cost += std::min(normal.SquaredDistance(tau), max_sq);
  }
  return cost;
}

// Gauss-Newton on the inliers, with the derivative of the denominator: without it the iteration
// runs to a point that is no minimum (docs/architecture.md, traps).
Eigen::Vector3d RefineTranslation(const std::vector<CoplanarityNormal>& normals, double max_sq,
                                  Eigen::Vector3d tau) {
  double cost = TruncatedCost(normals, tau, max_sq);
  for (int iteration = 0; iteration < 5; ++iteration) {
    const Eigen::Matrix<double, 3, 2> tangent = TangentsOf(tau);
    Eigen::Matrix2d hessian = Eigen::Matrix2d::Zero();
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
    for (const CoplanarityNormal& normal : normals) {
      const double variance = normal.Variance(tau);
      const double residual = tau.dot(normal.n) / std::sqrt(variance);
      if (residual * residual > max_sq) continue;
      const Eigen::Vector3d by_tau =
          normal.n / std::sqrt(variance) - residual / variance * (normal.cov_n * tau);
      const Eigen::Vector2d jacobian = tangent.transpose() * by_tau;
      hessian += jacobian * jacobian.transpose();
      gradient += jacobian * residual;
    }
    hessian.diagonal() *= 1.0 + 1e-6;
    const Eigen::Vector2d step = hessian.ldlt().solve(-gradient);
    if (!step.allFinite()) break;
    const Eigen::Vector3d candidate = (tau + tangent * step).normalized();
    const double candidate_cost = TruncatedCost(normals, candidate, max_sq);
    if (!(candidate_cost < cost)) break;
    tau = candidate;
    cost = candidate_cost;
  }
  return tau;
}

}  // namespace

int RejectByBinHomography(FramePair& pair, int width_px, int height_px,
                          const BinHomographyOptions& options) {
  std::vector<Match>& matches = pair.matches;
  const auto min_matches = static_cast<size_t>(std::max(options.min_bin_matches, 5));
  if (matches.size() < min_matches) return 0;

  std::vector<std::vector<size_t>> bins(static_cast<size_t>(options.bins * options.bins));
  std::vector<size_t> all(matches.size());
  for (size_t i = 0; i < matches.size(); ++i) {
    all[i] = i;
    const auto index = [&](double px, int size) {
      return std::clamp(static_cast<int>(px * options.bins / size), 0, options.bins - 1);
    };
    bins[static_cast<size_t>(index(matches[i].px_a.y(), height_px) * options.bins +
                             index(matches[i].px_a.x(), width_px))]
        .push_back(i);
  }
  std::vector<bool> rejected(matches.size());
  if (std::any_of(bins.begin(), bins.end(),
                  [&](const auto& bin) { return bin.size() < min_matches; })) {
    MarkByHomography(matches, all, options.threshold_px, &rejected);
  }
  for (const std::vector<size_t>& bin : bins) {
    if (bin.size() >= min_matches) {
      MarkByHomography(matches, bin, options.threshold_px, &rejected);
    }
  }

  size_t kept = 0;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!rejected[i]) matches[kept++] = matches[i];
  }
  const auto num_rejected = static_cast<int>(matches.size() - kept);
  matches.resize(kept);
  return num_rejected;
}

CoplanarityNormal MakeCoplanarityNormal(const RotatedMatch& match, MatchNoise noise) {
  CoplanarityNormal normal;
  normal.n = match.a.cross(match.b);
  const Eigen::Matrix<double, 3, 2> by_b = Hat(match.a) * match.J_b_px;
  normal.cov_n = by_b * by_b.transpose();
  if (noise == MatchNoise::kBothImages) {
    const Eigen::Matrix<double, 3, 2> by_a = Hat(match.b) * match.J_a_px;
    normal.cov_n += by_a * by_a.transpose();
  }
  return normal;
}

TranslationConsensus FindTranslationConsensus(const std::vector<RotatedMatch>& matches,
                                              const TranslationConsensusOptions& options) {
  TranslationConsensus consensus;
  consensus.inliers.assign(matches.size(), true);
  consensus.num_inliers = static_cast<int>(matches.size());
  if (matches.size() < 3) return consensus;

  std::vector<CoplanarityNormal> normals;
  normals.reserve(matches.size());
  for (const RotatedMatch& match : matches) {
    normals.push_back(MakeCoplanarityNormal(match, options.noise));
  }
  const double max_distance_px = options.threshold_sigma * options.sigma_px;
  const double max_sq = max_distance_px * max_distance_px;

  std::mt19937 generator(0);  // % instead of a distribution: the same on every library
  double best_cost = TruncatedCost(normals, consensus.tau, max_sq);
  for (int sample = 0; sample < options.samples; ++sample) {
    const size_t i = generator() % normals.size(), j = generator() % normals.size();
    const Eigen::Vector3d direction = normals[i].n.cross(normals[j].n);
    const double length = direction.norm();
    if (!(length > 1e-12 * normals[i].n.norm() * normals[j].n.norm())) continue;  // parallel
    const Eigen::Vector3d tau = direction / length;
    const double cost = TruncatedCost(normals, tau, max_sq);
    if (cost < best_cost) {
      best_cost = cost;
      consensus.tau = tau;
    }
  }
  consensus.tau = RefineTranslation(normals, max_sq, consensus.tau);

  // Displacement along the epipolar line, in sigmas. From depth_a a = depth_b b + tau follows
  // depth_b = (tau x a) . n / |n|^2 and depth_a = (tau x b) . n / |n|^2: positive before the
  // camera. The sign of tau is the one that the majority votes for.
  std::vector<double> forwards(matches.size());
  double vote = 0.0;
  for (size_t i = 0; i < matches.size(); ++i) {
    const Eigen::Vector3d along = consensus.tau.cross(matches[i].a);
    forwards[i] =
        along.dot(normals[i].n) / (options.sigma_px * std::sqrt(normals[i].Variance(along)));
    if (normals[i].SquaredDistance(consensus.tau) <= max_sq) {
      vote += std::clamp(forwards[i], -options.threshold_sigma, options.threshold_sigma);
    }
  }
  const double sign = vote < 0.0 ? -1.0 : 1.0;
  consensus.tau *= sign;
  consensus.num_inliers = 0;
  for (size_t i = 0; i < matches.size(); ++i) {
    consensus.inliers[i] = normals[i].SquaredDistance(consensus.tau) <= max_sq &&
                           sign * forwards[i] >= -options.threshold_sigma;
    consensus.num_inliers += consensus.inliers[i] ? 1 : 0;
  }
  return consensus;
}

}  // namespace camgyro
