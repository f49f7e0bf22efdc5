#include "estimator/start/start_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/rotation_chain.h"
#include "core/so3.h"

namespace camgyro {
namespace {

constexpr int kSize = StartFit::kSize;
constexpr int kMaxIterations = 30;
constexpr double kCauchy = 2.4;             // of the scale: 95 % efficient on normal residuals
constexpr double kMedianNorm3 = 1.538;      // median norm of 3 normal variables of sigma 1
constexpr double kInlierNorm3 = 3.37;       // 99 % of them
constexpr double kUnexcitedSigmaRad = 1.0;  // see the header
constexpr double kMaxStepS = 0.02;          // the linearisation holds within a lobe only
constexpr double kMaxDecrement = 1e-6;      // Newton decrement, in sigmas squared
constexpr int kBlocks = 30;                 // of the sandwich
constexpr int kMinPairsPerBlock = 10;

struct Linearized {
  Eigen::Matrix<double, 3, kSize> J;
  Eigen::Vector3d residual;
  bool covered = false;
};

std::vector<Linearized> Linearize(const RateAlignment& alignment, const StartFit& at) {
  const GyroRates& gyro = alignment.gyro();
  const CameraRates& camera = alignment.camera();
  const RotationChain chain(gyro.times_s, gyro.omega_gyro_rad_s.colwise() - at.bias_gyro_rad_s);
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
    // Neighbouring pairs share a frame.
    state_a = a == frame_of_b ? state_b : chain.At(camera.frame_times_s[a] + at.lag_s);
    state_b = chain.At(camera.frame_times_s[b] + at.lag_s);
    frame_of_b = b;
    const double interval_s = camera.interval_s(i);
    const Eigen::Quaterniond q_a_b(
        Eigen::Matrix3d(state_a.R_ref_gyro.transpose() * state_b.R_ref_gyro));
    const Eigen::Vector3d angle = Log(q_a_b);
    const Eigen::Vector3d c = camera.omega_cam_rad_s.col(i);
    Linearized& out = all[i];
    out.covered = true;
    out.residual = angle / interval_s - R * c;
    out.J.col(0) = (RightJacobianInverse(angle) * state_b.omega_gyro_rad_s -
                    LeftJacobianInverse(angle) * state_a.omega_gyro_rad_s) /
                   interval_s;
    // By the rate that the gyro predicts for the camera, not by the camera's own: that one's noise
    // would pose as rotation about axes about which nothing turns.
    out.J.block<3, 3>(0, 1) = R * Hat(R.transpose() * (angle / interval_s));
    // The mean of the bias' effect over the interval is minus identity to first order in the angle.
    out.J.block<3, 3>(0, 4) = -Eigen::Matrix3d::Identity();
  }
  return all;
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

StartFit FitStart(const RateAlignment& alignment, double lag_s,
                  const Eigen::Quaterniond& q_gyro_cam, const Eigen::Vector3d& bias_gyro_rad_s) {
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Matrix = StartFit::Covariance;
  const CameraRates& camera = alignment.camera();
  const Eigen::VectorXd& weight = camera.weight;

  StartFit fit;
  fit.lag_s = lag_s;
  fit.q_gyro_cam = q_gyro_cam;
  fit.bias_gyro_rad_s = bias_gyro_rad_s;
  fit.robust_weight = Eigen::VectorXd::Zero(camera.size());
  Matrix normal;
  std::vector<Linearized> lines;
  double unit_variance = 0.0;  // of residual * sqrt(weight)
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    lines = Linearize(alignment, fit);
    std::vector<double> norms, rates;
    for (int i = 0; i < camera.size(); ++i) {
      if (!lines[i].covered) continue;
      norms.push_back(std::sqrt(weight[i]) * lines[i].residual.norm());
      rates.push_back(lines[i].residual.norm());
    }
    // The floor is for data without any noise.
    const double scale = std::max(Median(norms) / kMedianNorm3, 1e-9);
    unit_variance = scale * scale;
    fit.noise_rad_s = Median(rates) / kMedianNorm3;

    normal.setZero();
    Vector gradient = Vector::Zero();
    double inliers = 0.0, count = 0.0;
    for (int i = 0; i < camera.size(); ++i) {
      fit.robust_weight[i] = 0.0;
      if (!lines[i].covered) continue;
      const double x = std::sqrt(weight[i]) * lines[i].residual.norm() / (kCauchy * scale);
      fit.robust_weight[i] = 1.0 / (1.0 + x * x);
      inliers += x * kCauchy < kInlierNorm3 ? 1.0 : 0.0;
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
    // The second: steps far below the sigmas.
    if ((std::abs(step[0]) < 1e-8 && step.tail<6>().norm() < 1e-7) ||
        -gradient.dot(step) < kMaxDecrement * unit_variance) {
      fit.converged = true;
      break;
    }
  }

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
  const Vector stretch =
      (sandwich.diagonal().cwiseMax(classical.diagonal()).array() / classical.diagonal().array())
          .sqrt();
  fit.covariance = stretch.asDiagonal() * classical * stretch.asDiagonal();
  return fit;
}

}  // namespace camgyro
