#include "estimator/start/start_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "core/robust_statistics.h"
#include "core/rotation_chain.h"
#include "core/so3.h"

namespace camgyro {
namespace {

constexpr int kSize = StartFit::kSize;
constexpr int kMaxIterations = 30;
constexpr double kCauchy = 2.4;         // of the scale: 95 % efficient on normal residuals
constexpr double kMedianNorm3 = 1.538;  // median norm of 3 normal variables of sigma 1
// A wrong lens makes residuals in proportion to the rate. Without this tolerance
// a minute of rest with one turn in it would take the turn for an outlier.
constexpr double kModelError = 0.05;
constexpr double kInlierNorm3 = 3.37;        // 99 % of them
constexpr double kUnexcitedSigmaRad = 1.0;   // see the header
constexpr double kMaxStepS = 0.02;           // the linearisation holds within a lobe only
constexpr double kSmallDecrement = 1e-6;     // Newton decrement, in sigmas squared
constexpr double kHarmlessDecrement = 1e-2;  // after all iterations
constexpr int kBlocks = 30;                  // of the sandwich
constexpr int kMinPairsPerBlock = 10;

struct Linearized {
  Eigen::Matrix<double, 3, kSize> J;
  Eigen::Vector3d residual;
  Eigen::Vector3d gyro_rate;  // bias removed
  bool covered = false;
};

// The gyro's rotations over one stretch of samples after the other: those of an hour would take 220
// MB at once, most of it for derivatives.
class RotationsByStretch {
 public:
  RotationsByStretch(const GyroRates& gyro, const Eigen::Vector3d& bias_gyro_rad_s)
      : gyro_(gyro), bias_gyro_rad_s_(bias_gyro_rad_s) {}

  // Sees to it that a stretch covers both times. True if it is another one than before: states of
  // that one have nothing to do with those to come.
  bool Cover(double from_s, double to_s) {
    if (chain_ && begin_s_ <= from_s && to_s <= end_s_) return false;
    const std::vector<double>& times_s = gyro_.times_s;
    const auto before = [&](double time_s) {  // the last sample that is not later; the first one
      const auto after = std::upper_bound(times_s.begin(), times_s.end(), time_s);
      return std::max<ptrdiff_t>(0, after - times_s.begin() - 1);
    };
    const auto size = static_cast<ptrdiff_t>(times_s.size());
    const ptrdiff_t first = std::min(before(from_s), size - 2);
    const ptrdiff_t last = std::min(size - 1, std::max(first + kSamples, before(to_s) + 1));
    chain_.emplace(
        std::vector<double>(times_s.begin() + first, times_s.begin() + last + 1),
        gyro_.omega_gyro_rad_s.middleCols(first, last - first + 1).colwise() - bias_gyro_rad_s_);
    // Outside of all samples, the rate of the first or the last is held.
    constexpr double kForever = std::numeric_limits<double>::infinity();
    begin_s_ = first == 0 ? -kForever : times_s[static_cast<size_t>(first)];
    end_s_ = last == size - 1 ? kForever : times_s[static_cast<size_t>(last)];
    return true;
  }

  RotationChain::State At(double time_s) const { return chain_->At(time_s); }

 private:
  static constexpr ptrdiff_t kSamples = 4096;  // 1 MB

  const GyroRates& gyro_;
  const Eigen::Vector3d bias_gyro_rad_s_;
  std::optional<RotationChain> chain_;
  double begin_s_ = 0.0, end_s_ = 0.0;
};

std::vector<Linearized> Linearize(const RateAlignment& alignment, const StartFit& at) {
  const CameraRates& camera = alignment.camera();
  RotationsByStretch rotations(alignment.gyro(), at.bias_gyro_rad_s);
  Eigen::Matrix3Xd unused;
  std::vector<char> covered;
  alignment.MeanGyroRates(at.lag_s, &unused, &covered);

  const Eigen::Matrix3d R = at.q_gyro_cam.toRotationMatrix();
  std::vector<Linearized> all(static_cast<size_t>(camera.size()));
  RotationChain::State state_a, state_b;
  int frame_of_b = -1;
  for (int i = 0; i < camera.size(); ++i) {
    if (!covered[i]) continue;
    const int a = camera.frame_a[i], b = camera.frame_b[i];
    const double time_a_s = camera.frame_times_s[a] + at.lag_s;
    const double time_b_s = camera.frame_times_s[b] + at.lag_s;
    if (rotations.Cover(time_a_s, time_b_s)) frame_of_b = -1;
    // Neighbouring pairs share a frame.
    state_a = a == frame_of_b ? state_b : rotations.At(time_a_s);
    state_b = rotations.At(time_b_s);
    frame_of_b = b;
    const double interval_s = camera.interval_s(i);
    const Eigen::Quaterniond q_a_b(
        Eigen::Matrix3d(state_a.R_ref_gyro.transpose() * state_b.R_ref_gyro));
    const Eigen::Vector3d angle = Log(q_a_b);
    const Eigen::Vector3d c = camera.omega_cam_rad_s.col(i);
    Linearized& out = all[i];
    out.covered = true;
    out.gyro_rate = angle / interval_s;
    out.residual = out.gyro_rate - at.rate_ratio * (R * c);
    out.J.col(0) = (RightJacobianInverse(angle) * state_b.omega_gyro_rad_s -
                    LeftJacobianInverse(angle) * state_a.omega_gyro_rad_s) /
                   interval_s;
    // By the rate that the gyro predicts for the camera, not by the camera's own: that one's noise
    // would pose as rotation about axes about which nothing turns.
    out.J.block<3, 3>(0, 1) = R * Hat(R.transpose() * out.gyro_rate);
    // The mean of the bias' effect over the interval is minus identity to first order in the angle.
    out.J.block<3, 3>(0, 4) = -Eigen::Matrix3d::Identity();
    out.J.col(7) = -out.gyro_rate / at.rate_ratio;
  }
  return all;
}

// Mean squared rate of the gyro about its mean [rad^2/s^2].
double GyroPower(const std::vector<Linearized>& lines, const Eigen::VectorXd& weight,
                 const Eigen::VectorXd& robust_weight) {
  double sum_w = 0.0, sum_squares = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < lines.size(); ++i) {
    if (!lines[i].covered) continue;
    const double w = weight[i] * robust_weight[i];
    sum_w += w;
    sum += w * lines[i].gyro_rate;
    sum_squares += w * lines[i].gyro_rate.squaredNorm();
  }
  return sum_w > 0.0 ? sum_squares / sum_w - (sum / sum_w).squaredNorm() : 0.0;
}

// Part of the gyro's power that is in residuals which one pair passes on to the next: not noise but
// a model that does not fit (lens, focal length, translation taken for rotation). White noise up to
// two sigma of the correlation does not count.
double SystematicFraction(const std::vector<Linearized>& lines, const Eigen::VectorXd& weight,
                          const Eigen::VectorXd& robust_weight) {
  double squares = 0.0, products = 0.0, sum_w = 0.0, count = 0.0;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (!lines[i].covered) continue;
    const double w = weight[i] * robust_weight[i];
    sum_w += w;
    squares += w * lines[i].residual.squaredNorm();
    if (i == 0 || !lines[i - 1].covered) continue;
    const double w_before = weight[i - 1] * robust_weight[i - 1];
    products += std::sqrt(w * w_before) * lines[i].residual.dot(lines[i - 1].residual);
    count += 1.0;
  }
  const double power = GyroPower(lines, weight, robust_weight);
  if (!(squares > 0.0) || !(power > 0.0)) return 0.0;
  const double correlation = products / squares - 2.0 / std::sqrt(std::max(1.0, count));
  return std::clamp(correlation, 0.0, 1.0) * squares / sum_w / power;
}

// The larger of the classical covariance and the sandwich over blocks of consecutive pairs, per
// parameter; a systematic residual widens orientation and bias besides.
StartFit::Covariance CovarianceOf(const CameraRates& camera, const std::vector<Linearized>& lines,
                                  const StartFit& fit, const StartFit::Covariance& normal,
                                  double unit_variance) {
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Matrix = StartFit::Covariance;
  const Eigen::VectorXd& weight = camera.weight;
  const Matrix inverse = normal.ldlt().solve(Matrix::Identity());
  const Matrix classical = unit_variance * inverse;
  // Sandwich over blocks of consecutive pairs.
  const int blocks = std::clamp(camera.size() / kMinPairsPerBlock, 1, kBlocks);
  Matrix meat = Matrix::Zero();
  for (int block = 0; block < blocks; ++block) {
    Vector score = Vector::Zero();
    const int end = (block + 1) * camera.size() / blocks;
    for (int i = block * camera.size() / blocks; i < end; ++i) {
      if (lines[i].covered) {
        score += weight[i] * fit.robust_weight[i] * lines[i].J.transpose() * lines[i].residual;
      }
    }
    meat += score * score.transpose();
  }
  const Matrix sandwich = (blocks > 1 ? blocks / (blocks - 1.0) : 0.0) * inverse * meat * inverse;
  Vector variance = sandwich.diagonal().cwiseMax(classical.diagonal());
  const double systematic = SystematicFraction(lines, weight, fit.robust_weight);
  const double systematic_sq = systematic * systematic;
  variance.segment<3>(1).array() += systematic_sq;
  variance.segment<3>(4).array() += systematic_sq * GyroPower(lines, weight, fit.robust_weight);
  const Vector stretch = (variance.array() / classical.diagonal().array()).sqrt();
  return stretch.asDiagonal() * classical * stretch.asDiagonal();
}

}  // namespace

StartFit FitStart(const RateAlignment& alignment, double lag_s,
                  const Eigen::Quaterniond& q_gyro_cam, const Eigen::Vector3d& bias_gyro_rad_s,
                  double rate_ratio) {
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Matrix = StartFit::Covariance;
  const CameraRates& camera = alignment.camera();
  const Eigen::VectorXd& weight = camera.weight;

  StartFit fit;
  fit.lag_s = lag_s;
  fit.q_gyro_cam = q_gyro_cam;
  fit.bias_gyro_rad_s = bias_gyro_rad_s;
  fit.rate_ratio = rate_ratio;
  fit.robust_weight = Eigen::VectorXd::Zero(camera.size());
  Matrix normal;
  std::vector<Linearized> lines;
  double unit_variance = 0.0;  // of residual * sqrt(weight)
  double decrement = 0.0;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    lines = Linearize(alignment, fit);
    std::vector<double> norms, rates;
    for (int i = 0; i < camera.size(); ++i) {
      if (!lines[i].covered) continue;
      norms.push_back(std::sqrt(weight[i]) * lines[i].residual.norm());
      rates.push_back(lines[i].residual.norm());
    }
    // The floor is for data without any noise.
    const double scale = std::max(MedianOr(norms, 0.0) / kMedianNorm3, 1e-9);
    unit_variance = scale * scale;
    fit.noise_rad_s = MedianOr(rates, 0.0) / kMedianNorm3;

    normal.setZero();
    Vector gradient = Vector::Zero();
    double inliers = 0.0, count = 0.0;
    for (int i = 0; i < camera.size(); ++i) {
      fit.robust_weight[i] = 0.0;
      if (!lines[i].covered) continue;
      const double tolerated =
          std::hypot(scale, kModelError * std::sqrt(weight[i]) * lines[i].gyro_rate.norm());
      const double x = std::sqrt(weight[i]) * lines[i].residual.norm() / tolerated;
      fit.robust_weight[i] = 1.0 / (1.0 + x * x / (kCauchy * kCauchy));
      inliers += x < kInlierNorm3 ? 1.0 : 0.0;
      count += 1.0;
      const double w = weight[i] * fit.robust_weight[i];
      normal.noalias() += w * lines[i].J.transpose() * lines[i].J;
      gradient.noalias() += w * lines[i].J.transpose() * lines[i].residual;
    }
    fit.inliers = count > 0.0 ? inliers / count : 0.0;
    // A weak prior on the orientation given: holds what no motion excites.
    const double prior = unit_variance / (kUnexcitedSigmaRad * kUnexcitedSigmaRad);
    normal.block<3, 3>(1, 1).diagonal().array() += prior;
    gradient.segment<3>(1) += prior * Log(q_gyro_cam.conjugate() * fit.q_gyro_cam);
    Vector step = -normal.ldlt().solve(gradient);
    if (!step.allFinite()) return fit;
    if (std::abs(step[0]) > kMaxStepS) step *= kMaxStepS / std::abs(step[0]);
    fit.lag_s += step[0];
    fit.q_gyro_cam = (fit.q_gyro_cam * Exp<double>(step.segment<3>(1))).normalized();
    fit.bias_gyro_rad_s += step.segment<3>(4);
    fit.rate_ratio += step[7];
    if (!(fit.rate_ratio > 0.0)) return fit;
    decrement = -gradient.dot(step) / unit_variance;
    if ((std::abs(step[0]) < 1e-8 && step.tail<7>().norm() < 1e-7) || decrement < kSmallDecrement) {
      fit.converged = true;
      break;
    }
  }
  // Along a direction that hardly anything excites, steps shrink slowly; they no longer matter.
  fit.converged = fit.converged || decrement < kHarmlessDecrement;

  fit.covariance = CovarianceOf(camera, lines, fit, normal, unit_variance);
  return fit;
}

}  // namespace camgyro
