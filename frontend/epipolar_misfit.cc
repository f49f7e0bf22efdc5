#include "frontend/epipolar_misfit.h"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "core/robust_statistics.h"

namespace camgyro {
namespace {

constexpr size_t kLeastMatches = 20;  // two and a half times what the eight-point method needs
constexpr double kInlierSigmas = 2.5;

std::optional<Eigen::Matrix3d> FundamentalMatrix(const std::vector<Match>& matches, int method) {
  std::vector<cv::Point2d> a, b;
  for (const Match& match : matches) {
    a.emplace_back(match.px_a.x(), match.px_a.y());
    b.emplace_back(match.px_b.x(), match.px_b.y());
  }
  const cv::Mat F = cv::findFundamentalMat(a, b, method);
  if (F.rows != 3 || F.cols != 3) return std::nullopt;
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) matrix(i, j) = F.at<double>(i, j);
  }
  if (!matrix.allFinite()) return std::nullopt;
  return matrix;
}

std::vector<Eigen::Vector2d> CorrectionsBy(const Eigen::Matrix3d& F,
                                           const std::vector<Match>& matches) {
  std::vector<Eigen::Vector2d> corrections;
  for (const Match& match : matches) {
    const Eigen::Vector3d line = F * match.px_a.homogeneous();
    const Eigen::Vector2d across = line.head<2>();
    corrections.push_back(-line.dot(match.px_b.homogeneous()) / across.squaredNorm() * across);
  }
  return corrections;
}

std::vector<size_t> InliersOf(const std::vector<Eigen::Vector2d>& corrections, double sigmas) {
  std::vector<double> lengths;
  for (const Eigen::Vector2d& correction : corrections) lengths.push_back(correction.norm());
  const double limit = sigmas * kSigmaOfMedian * MedianOr(lengths, 0.0);
  std::vector<size_t> inliers;
  for (size_t i = 0; i < lengths.size(); ++i) {
    if (lengths[i] <= limit) inliers.push_back(i);
  }
  return inliers;
}

std::vector<Match> Chosen(const std::vector<Match>& matches, const std::vector<size_t>& indices) {
  std::vector<Match> chosen;
  for (const size_t i : indices) chosen.push_back(matches[i]);
  return chosen;
}

}  // namespace

std::vector<Eigen::Vector2d> EpipolarCorrections(const std::vector<Match>& matches) {
  if (matches.size() < kLeastMatches) return {};
  const auto rough = FundamentalMatrix(matches, cv::FM_LMEDS);
  if (!rough) return {};
  const std::vector<size_t> inliers = InliersOf(CorrectionsBy(*rough, matches), kInlierSigmas);
  if (inliers.size() < kLeastMatches / 2) return {};
  const auto fine = FundamentalMatrix(Chosen(matches, inliers), cv::FM_8POINT);
  return CorrectionsBy(fine ? *fine : *rough, matches);
}

std::vector<size_t> EpipolarInliers(const std::vector<Match>& matches, double sigmas) {
  if (matches.size() < kLeastMatches) return {};
  const auto rough = FundamentalMatrix(matches, cv::FM_LMEDS);
  return rough ? InliersOf(CorrectionsBy(*rough, matches), sigmas) : std::vector<size_t>();
}

std::vector<Eigen::Vector2d> LinearEpipolarCorrections(const std::vector<Match>& matches) {
  if (matches.size() < kLeastMatches / 2) return {};
  const auto F = FundamentalMatrix(matches, cv::FM_8POINT);
  return F ? CorrectionsBy(*F, matches) : std::vector<Eigen::Vector2d>();
}

}  // namespace camgyro
