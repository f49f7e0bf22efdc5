#include "estimator/start/rate_alignment.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/gyro_gap.h"
#include "core/robust_statistics.h"
#include "core/time.h"

namespace camgyro {

GyroRates::GyroRates(const std::vector<GyroSample>& gyro)
    : omega_gyro_rad_s(3, static_cast<Eigen::Index>(gyro.size())) {
  times_s.reserve(gyro.size());
  for (size_t k = 0; k < gyro.size(); ++k) {
    times_s.push_back(SecondsSince(gyro.front().stamp_ns, gyro[k].stamp_ns));
    omega_gyro_rad_s.col(static_cast<Eigen::Index>(k)) = gyro[k].omega_gyro_rad_s;
  }
}

double GyroRates::Noise(double interval_s) const {
  const auto n = static_cast<Eigen::Index>(times_s.size());
  if (n < 3) return 0.0;
  const Eigen::Matrix3Xd& w = omega_gyro_rad_s;
  const double squares =
      (w.rightCols(n - 2) - 2.0 * w.middleCols(1, n - 2) + w.leftCols(n - 2)).squaredNorm();
  const double variance = squares / (3.0 * 6.0 * static_cast<double>(n - 2));
  const double samples =
      std::max(1.0, interval_s * static_cast<double>(n - 1) / (times_s.back() - times_s.front()));
  return std::sqrt(variance / samples);
}

RateAlignment::RateAlignment(GyroRates gyro, CameraRates camera)
    : gyro_(std::move(gyro)), camera_(std::move(camera)) {
  const size_t n = gyro_.times_s.size();
  std::vector<double> intervals;
  for (size_t k = 1; k < n; ++k) intervals.push_back(gyro_.times_s[k] - gyro_.times_s[k - 1]);
  const double hole_s = LongestGyroStep(MedianOr(intervals, 0.0));

  integral_ = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(n));
  gaps_.assign(n, 0);
  for (size_t k = 1; k < n; ++k) {
    const auto col = static_cast<Eigen::Index>(k);
    integral_.col(col) = integral_.col(col - 1) + 0.5 * intervals[k - 1] *
                                                      (gyro_.omega_gyro_rad_s.col(col - 1) +
                                                       gyro_.omega_gyro_rad_s.col(col));
    gaps_[k] = gaps_[k - 1] + (intervals[k - 1] > hole_s ? 1 : 0);
  }

  used_frames_ = camera_.frame_a;
  used_frames_.insert(used_frames_.end(), camera_.frame_b.begin(), camera_.frame_b.end());
  std::sort(used_frames_.begin(), used_frames_.end());
  used_frames_.erase(std::unique(used_frames_.begin(), used_frames_.end()), used_frames_.end());
}

void RateAlignment::MeanGyroRates(double lag_s, Eigen::Matrix3Xd* omega_gyro_rad_s,
                                  std::vector<char>* covered) const {
  const std::vector<double>& times = gyro_.times_s;
  const size_t n = times.size();
  // The integral at every frame, in one pass: both lists ascend.
  std::vector<Eigen::Vector3d> at_frame(camera_.frame_times_s.size());
  std::vector<int> gaps_before(camera_.frame_times_s.size(), -1);  // -1: outside the gyro
  const auto first = std::upper_bound(
      times.begin(), times.end(),
      used_frames_.empty() ? 0.0 : camera_.frame_times_s[used_frames_.front()] + lag_s);
  size_t k = first == times.begin() ? 0 : static_cast<size_t>(first - times.begin()) - 1;
  for (const int frame : used_frames_) {
    const double t = camera_.frame_times_s[frame] + lag_s;
    if (t < times.front()) continue;
    while (k + 1 < n && times[k + 1] <= t) ++k;
    if (k + 1 >= n && t > times.back()) break;
    const auto col = static_cast<Eigen::Index>(k);
    at_frame[frame] = integral_.col(col);
    gaps_before[frame] = gaps_[k];
    if (k + 1 < n) {
      const double elapsed = t - times[k];
      const double weight_next = elapsed / (times[k + 1] - times[k]);
      at_frame[frame] += elapsed * ((1.0 - 0.5 * weight_next) * gyro_.omega_gyro_rad_s.col(col) +
                                    0.5 * weight_next * gyro_.omega_gyro_rad_s.col(col + 1));
      // A frame inside a hole belongs to neither side.
      if (elapsed > 0.0 && gaps_[k + 1] > gaps_[k]) gaps_before[frame] = -1;
    }
  }
  omega_gyro_rad_s->resize(3, camera_.size());
  covered->assign(static_cast<size_t>(camera_.size()), 0);
  for (int i = 0; i < camera_.size(); ++i) {
    const int a = camera_.frame_a[i], b = camera_.frame_b[i];
    if (gaps_before[a] < 0 || gaps_before[a] != gaps_before[b]) {
      omega_gyro_rad_s->col(i).setZero();
      continue;
    }
    (*covered)[i] = 1;
    omega_gyro_rad_s->col(i) = (at_frame[b] - at_frame[a]) / camera_.interval_s(i);
  }
}

RateAlignment::Fit RateAlignment::At(double lag_s, const Eigen::VectorXd& pair_weight) const {
  Eigen::Matrix3Xd gyro_rates;
  std::vector<char> covered;
  MeanGyroRates(lag_s, &gyro_rates, &covered);

  Fit fit;
  double sum_w = 0.0;
  Eigen::Vector3d sum_g = Eigen::Vector3d::Zero(), sum_c = Eigen::Vector3d::Zero();
  for (int i = 0; i < camera_.size(); ++i) {
    if (!covered[i]) continue;
    const double w = camera_.weight[i] * (pair_weight.size() > 0 ? pair_weight[i] : 1.0);
    ++fit.pairs;
    sum_w += w;
    sum_g += w * gyro_rates.col(i);
    sum_c += w * camera_.omega_cam_rad_s.col(i);
  }
  if (!(sum_w > 0.0)) {
    fit.pairs = 0;
    return fit;
  }
  const Eigen::Vector3d mean_g = sum_g / sum_w, mean_c = sum_c / sum_w;
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // sum w g c^T
  double power_g = 0.0, power_c = 0.0;
  for (int i = 0; i < camera_.size(); ++i) {
    if (!covered[i]) continue;
    const double w = camera_.weight[i] * (pair_weight.size() > 0 ? pair_weight[i] : 1.0);
    const Eigen::Vector3d g = gyro_rates.col(i) - mean_g;
    const Eigen::Vector3d c = camera_.omega_cam_rad_s.col(i) - mean_c;
    cross.noalias() += w * g * c.transpose();
    power_g += w * g.squaredNorm();
    power_c += w * c.squaredNorm();
  }
  fit.gyro_rms_rad_s = std::sqrt(power_g / sum_w);
  fit.cam_rms_rad_s = std::sqrt(power_c / sum_w);

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& s = svd.singularValues();
  const bool proper = (svd.matrixU() * svd.matrixV().transpose()).determinant() > 0.0;
  const Eigen::Vector3d flip(1.0, 1.0, -1.0);
  const Eigen::Matrix3d same = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Matrix3d other = svd.matrixU() * flip.asDiagonal() * svd.matrixV().transpose();
  fit.R_gyro_cam = proper ? same : other;
  fit.mirrored = proper ? other : same;
  const double trace_same = s.sum(), trace_other = s.dot(flip);
  const double trace = proper ? trace_same : trace_other;
  const double trace_mirrored = proper ? trace_other : trace_same;
  if (power_g > 0.0 && power_c > 0.0) {
    fit.explained = trace * trace / (power_g * power_c);
    fit.explained_mirrored = trace_mirrored * trace_mirrored / (power_g * power_c);
    // Regression of the camera on the gyro: noise of the camera does not pull it towards zero.
    fit.rate_ratio = trace > 0.0 ? power_g / trace : 0.0;
  }
  fit.bias_gyro_rad_s = mean_g - fit.R_gyro_cam * mean_c;
  return fit;
}

}  // namespace camgyro
