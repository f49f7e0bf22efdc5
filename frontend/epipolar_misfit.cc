#include "frontend/epipolar_misfit.h"

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "core/robust_statistics.h"

namespace camgyro {
namespace {

constexpr size_t kLeastMatches = 20;  // two and a half times what the eight-point method needs
constexpr double kInlierSigmas = 2.5;

std::optional<Eigen::Matrix3d> FundamentalMatrix(const std::vector<cv::Point2d>& a,
                                                 const std::vector<cv::Point2d>& b, int method) {
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

}  // namespace

std::vector<Eigen::Vector2d> EpipolarCorrections(const std::vector<Match>& matches) {
  if (matches.size() < kLeastMatches) return {};
  std::vector<cv::Point2d> a, b;
  for (const Match& match : matches) {
    a.emplace_back(match.px_a.x(), match.px_a.y());
    b.emplace_back(match.px_b.x(), match.px_b.y());
  }
  const auto rough = FundamentalMatrix(a, b, cv::FM_LMEDS);
  if (!rough) return {};
  std::vector<double> lengths;
  for (const Eigen::Vector2d& correction : CorrectionsBy(*rough, matches)) {
    lengths.push_back(correction.norm());
  }
  const double limit = kInlierSigmas * kSigmaOfMedian * MedianOr(lengths, 0.0);
  std::vector<cv::Point2d> near_a, near_b;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!(lengths[i] <= limit)) continue;
    near_a.push_back(a[i]);
    near_b.push_back(b[i]);
  }
  if (near_a.size() < kLeastMatches / 2) return {};
  const auto fine = FundamentalMatrix(near_a, near_b, cv::FM_8POINT);
  return CorrectionsBy(fine ? *fine : *rough, matches);
}

}  // namespace camgyro
