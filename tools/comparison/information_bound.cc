#include "tools/comparison/information_bound.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/linear_algebra.h"
#include "core/pair_model.h"
#include "core/rotation_chain.h"
#include "core/sphere.h"
#include "core/time.h"

namespace camgyro::comparison {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

struct RayPair {
  Bearing a, b;
  Vector3d n;  // cross product
};

// First-order variance of tau . n [rays have z = 1].
double Variance(const RayPair& rays, const Vector3d& tau, double variance_a, double variance_b) {
  const Vector3d by_a = rays.b.ray_ref.cross(tau), by_b = tau.cross(rays.a.ray_ref);
  return variance_a * (rays.a.J_ray_px.transpose() * by_a).squaredNorm() +
         variance_b * (rays.b.J_ray_px.transpose() * by_b).squaredNorm();
}

// Directions to take the information at: the one that all n are perpendicular to, or three
// orthogonal ones where all n vanish.
std::vector<Vector3d> Directions(const std::vector<RayPair>& rays, double variance_a,
                                 double variance_b) {
  constexpr double kNoParallax = 1e-3;  // rms of n, in sigmas
  Matrix3d basis = Matrix3d::Identity();
  Vector3d tau = Vector3d::UnitZ();
  double parallax_sq = 0.0;
  for (int round = 0; round < 3; ++round) {  // weights need tau, tau needs weights
    Matrix3d scatter = Matrix3d::Zero();
    for (const RayPair& r : rays) {
      scatter += r.n * r.n.transpose() / Variance(r, tau, variance_a, variance_b);
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter);
    basis = eigen.eigenvectors();
    tau = basis.col(0);
    parallax_sq = eigen.eigenvalues()[2] / static_cast<double>(rays.size());
  }
  if (parallax_sq > kNoParallax * kNoParallax) return {tau};
  return {basis.col(0), basis.col(1), basis.col(2)};
}

// A S A' with the 2 x 2 matrix S pseudo-inverted: what a free tau takes away.
MatrixXd Explained(const MatrixXd& cross, const Eigen::Matrix2d& information) {
  const SymmetricSpectrum eigen = SpectrumOfSymmetric(information);
  MatrixXd result = MatrixXd::Zero(cross.rows(), cross.rows());
  for (int i = 0; i < 2; ++i) {
    if (eigen.values[i] < 1e-6) continue;  // [1 / rad^2], of a direction: knows nothing
    const VectorXd v = cross * eigen.vectors.col(i);
    result += v * v.transpose() / eigen.values[i];
  }
  return result;
}

class Accumulator {
 public:
  Accumulator(const Calibration& truth, const StateVector& prior_sigma, double gyro_sigma)
      : truth_(truth), gyro_information_(1.0 / (gyro_sigma * gyro_sigma)) {
    information_ = prior_sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  }

  // The state becomes the calibration and the rates of readings [first, last].
  void MoveTo(int first, int last) {
    first = std::max(first, first_);
    const int drop = std::min(first - first_, count_);
    if (drop > 0) {
      const Eigen::Index cut = 3 * drop;
      // Rates that leave come right after the calibration.
      std::vector<Eigen::Index> stay;
      for (Eigen::Index i = 0; i < kStateSize; ++i) stay.push_back(i);
      for (Eigen::Index i = kStateSize + cut; i < information_.rows(); ++i) stay.push_back(i);
      const MatrixXd leaving = information_.block(kStateSize, kStateSize, cut, cut);
      const MatrixXd cross = information_(stay, Eigen::seqN(kStateSize, cut));
      const MatrixXd kept = information_(stay, stay);
      information_ = kept - cross * SymmetricSolver(leaving).Solve(cross.transpose());
      information_ = MatrixXd(0.5 * (information_ + information_.transpose()));
      count_ -= drop;
      first_ += drop;
    }
    if (count_ == 0) first_ = first;
    for (; first_ + count_ <= last; ++count_) {
      const Eigen::Index old = information_.rows();
      MatrixXd grown = MatrixXd::Zero(old + 3, old + 3);
      grown.topLeftCorner(old, old) = information_;
      for (int k = 0; k < 3; ++k) {  // (w + b - measured) / sigma
        grown(kStateBias + k, kStateBias + k) += gyro_information_;
        grown(old + k, old + k) += gyro_information_;
        grown(kStateBias + k, old + k) += gyro_information_;
        grown(old + k, kStateBias + k) += gyro_information_;
      }
      information_ = grown;
    }
  }

  void AddPair(const std::vector<RayPair>& rays, const RotationChain& chain, double variance_a,
               double variance_b) {
    const std::vector<Vector3d> directions = Directions(rays, variance_a, variance_b);
    const Eigen::Index size = information_.rows();
    Eigen::Matrix3Xd by_rates(3, chain.size());
    for (const Vector3d& tau : directions) {
      const Eigen::Matrix<double, 3, 2> tangents = TangentsOf(tau);
      MatrixXd sum = MatrixXd::Zero(size, size), cross = MatrixXd::Zero(size, 2);
      Eigen::Matrix2d of_tau = Eigen::Matrix2d::Zero();
      for (const RayPair& r : rays) {
        PairGradient gradient;
        by_rates.setZero();
        const Eigen::Matrix<double, 3, 2> none = Eigen::Matrix<double, 3, 2>::Zero();
        Backpropagate(r.a, chain, truth_.height_px, r.b.ray_ref.cross(tau), none, &gradient,
                      by_rates);
        Backpropagate(r.b, chain, truth_.height_px, tau.cross(r.a.ray_ref), none, &gradient,
                      by_rates);
        VectorXd J(size);
        J << gradient.by_lens[kFocal], gradient.by_lens[kCx], gradient.by_lens[kCy],
            gradient.by_shutter[kReadout], gradient.by_shutter[kDelay], Vector3d::Zero(),
            gradient.by_rotation.transpose(),
            Eigen::Map<VectorXd>(by_rates.data(), by_rates.size());
        const double inv_sigma = 1.0 / std::sqrt(Variance(r, tau, variance_a, variance_b));
        J *= inv_sigma;
        const Eigen::RowVector2d J_tau = inv_sigma * r.n.transpose() * tangents;
        sum.noalias() += J * J.transpose();
        cross.noalias() += J * J_tau;
        of_tau += J_tau.transpose() * J_tau;
      }
      information_ += (sum - Explained(cross, of_tau)) / static_cast<double>(directions.size());
    }
  }

  StateCovariance Bound() const {
    return SymmetricSolver(information_).Inverse().topLeftCorner<kStateSize, kStateSize>();
  }

 private:
  const Calibration& truth_;
  const double gyro_information_;
  MatrixXd information_;
  int first_ = 0, count_ = 0;  // readings whose rates are in the state
};

}  // namespace

std::vector<StateCovariance> InformationBound(const std::vector<FramePair>& exact,
                                              const Recording& recording, const Calibration& truth,
                                              const StateVector& prior_sigma, double noise_px,
                                              double gyro_sigma_rad_s) {
  const int64_t origin_ns = recording.gyro.front().stamp_ns;
  std::vector<double> times;
  for (const GyroSample& sample : recording.gyro) {
    times.push_back(SecondsSince(origin_ns, sample.stamp_ns));
  }
  const double variance_b = noise_px * noise_px;
  const double variance_a = recording.match_noise == MatchNoise::kBothImages ? variance_b : 0.0;
  const ShutterParameters shutter = ShutterOf(truth);
  const Matrix3d R_gyro_cam = truth.q_gyro_cam.toRotationMatrix();
  const Lens& lens = GetLens(truth.distortion_model);
  Accumulator accumulator(truth, prior_sigma, gyro_sigma_rad_s);
  std::vector<StateCovariance> bounds;
  for (const FramePair& pair : exact) {
    const auto stamp = [&](int frame) {
      return SecondsSince(origin_ns, recording.frames[static_cast<size_t>(frame)].stamp_ns);
    };
    const double time_a = stamp(pair.frame_a), time_b = stamp(pair.frame_b);
    const double from = time_a + truth.delay_s + std::min(0.0, truth.readout_s);
    const double to = time_b + truth.delay_s + std::max(0.0, truth.readout_s);
    const auto after = std::upper_bound(times.begin(), times.end(), from);
    const auto end = std::lower_bound(times.begin(), times.end(), to);
    if (after != times.begin() && end != times.end()) {
      const int first = static_cast<int>(after - times.begin()) - 1;
      const int last = static_cast<int>(end - times.begin());
      accumulator.MoveTo(first, last);
      Eigen::Matrix3Xd rates(3, last - first + 1);
      for (int i = first; i <= last; ++i) {
        rates.col(i - first) =
            recording.gyro[static_cast<size_t>(i)].omega_gyro_rad_s - truth.bias_gyro_rad_s;
      }
      const RotationChain chain({times.begin() + first, times.begin() + last + 1}, rates);
      std::vector<RayPair> rays;
      for (const Match& match : pair.matches) {
        RayPair r;
        if (EvaluateBearing(lens, truth.lens, shutter, R_gyro_cam, chain, time_a, truth.height_px,
                            match.px_a, &r.a) &&
            EvaluateBearing(lens, truth.lens, shutter, R_gyro_cam, chain, time_b, truth.height_px,
                            match.px_b, &r.b)) {
          r.n = r.a.ray_ref.cross(r.b.ray_ref);
          rays.push_back(r);
        }
      }
      if (rays.size() >= 3) accumulator.AddPair(rays, chain, variance_a, variance_b);
    }
    bounds.push_back(accumulator.Bound());
  }
  return bounds;
}

}  // namespace camgyro::comparison
