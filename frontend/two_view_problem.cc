#include "frontend/two_view_problem.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/robust_statistics.h"
#include "core/so3.h"
#include "core/sphere.h"

namespace camgyro {

double SpreadOf(std::vector<double> squared, int num_parameters) {
  const auto n = static_cast<double>(squared.size());
  return kSigmaOfMedian * std::sqrt(MedianInPlace(&squared) * n / (n - num_parameters));
}

RotationFit FitRotationOnly(const std::vector<RayMatch>& matches, double min_sigma_px,
                            const Eigen::Matrix3d& begin_at) {
  RotationFit fit;
  fit.R_a_b = begin_at;
  std::vector<Eigen::Vector2d> residuals(matches.size());
  std::vector<Eigen::Matrix<double, 2, 3>> jacobians(matches.size());
  std::vector<double> squared(matches.size());
  for (int iteration = 0; iteration < 15; ++iteration) {
    for (size_t i = 0; i < matches.size(); ++i) {
      const RayMatch& match = matches[i];
      const Eigen::Vector3d a = fit.R_a_b.transpose() * match.a;
      const Eigen::Matrix2d J_px_ray = match.J_b_px.topRows<2>().inverse();
      Eigen::Matrix<double, 2, 3> J_ray_a;
      J_ray_a << 1.0, 0.0, -a.x() / a.z(), 0.0, 1.0, -a.y() / a.z();
      residuals[i] = J_px_ray * (a.hnormalized() - match.b.head<2>());
      jacobians[i] = J_px_ray * J_ray_a / a.z() * Hat(a);
      squared[i] = residuals[i].squaredNorm();
    }
    const RobustLoss loss(std::max(min_sigma_px, SpreadOf(squared, 2)));
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero(), information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    double sum_psi_sq = 0.0, sum_slope = 0.0, count = 0.0;
    for (size_t i = 0; i < matches.size(); ++i) {
      const double weight = loss.Weight(squared[i]);
      const Eigen::Matrix3d one = jacobians[i].transpose() * jacobians[i];
      hessian += weight * one;
      gradient += weight * jacobians[i].transpose() * residuals[i];
      if (!loss.IsInlier(squared[i])) continue;
      information += one;
      sum_psi_sq += weight * weight * squared[i];
      sum_slope += 0.5 * (loss.Slope(squared[i]) + weight);  // along and across the residual
      count += 1.0;
    }
    const Eigen::Vector3d step = hessian.ldlt().solve(-gradient);
    if (!step.allFinite()) return {};
    fit.R_a_b = fit.R_a_b * Exp(step).toRotationMatrix();
    const double slope = sum_slope / count;
    const double transfer_variance = sum_psi_sq / (2.0 * count - 3.0) / (slope * slope);
    fit.covariance = transfer_variance * information.inverse();
    fit.variance_px = 0.5 * transfer_variance;  // of two images
    if (step.norm() < 1e-7) break;
  }
  if (!fit.covariance->allFinite()) fit.covariance.reset();
  return fit;
}

TwoViewProblem::TwoViewProblem(const std::vector<RayMatch>& matches, const Eigen::Matrix3d& R_a_b)
    : matches_(matches), noise_(matches.size()) {
  SetNoiseRotation(R_a_b);
}

void TwoViewProblem::SetNoiseRotation(const Eigen::Matrix3d& R_a_b) {
  for (size_t i = 0; i < matches_.size(); ++i) {
    const RayMatch& match = matches_[i];
    noise_[i] = MakeCoplanarityNormal(
        {match.a, R_a_b * match.b, match.J_a_px, R_a_b * match.J_b_px}, MatchNoise::kBothImages);
  }
}

std::vector<double> TwoViewProblem::SquaredResiduals(const TwoViewMotion& motion) const {
  std::vector<double> squared(matches_.size());
  for (size_t i = 0; i < matches_.size(); ++i) squared[i] = SquaredResidual(i, motion);
  return squared;
}

Eigen::Matrix3d TwoViewProblem::SumOfNormals(const Eigen::Matrix3d& R_a_b,
                                             const Eigen::Vector3d& tau,
                                             const std::vector<double>& weights) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < matches_.size(); ++i) {
    const Eigen::Vector3d n = matches_[i].a.cross(R_a_b * matches_[i].b);
    const double variance = weights.empty() ? noise_[i].cov_n.trace() : noise_[i].Variance(tau);
    sum += (weights.empty() ? 1.0 : weights[i]) / variance * n * n.transpose();
  }
  return sum;
}

double TwoViewProblem::ShareBehind(const TwoViewMotion& motion) const {
  double behind = 0.0;
  for (const RayMatch& match : matches_) {
    const Eigen::Vector3d n = match.a.cross(motion.R_a_b * match.b);
    behind += motion.tau.cross(match.a).dot(n) < 0.0 ? 1.0 : 0.0;
  }
  return behind / static_cast<double>(matches_.size());
}

double TwoViewProblem::Cost(const TwoViewMotion& motion, const RobustLoss& loss) const {
  double cost = 0.0;
  for (size_t i = 0; i < matches_.size(); ++i) cost += loss.Loss(SquaredResidual(i, motion));
  return cost;
}

TwoViewProblem::Linearised TwoViewProblem::Linearise(const TwoViewMotion& motion,
                                                     const RobustLoss& loss) const {
  Linearised out;
  out.hessian.setZero();
  out.gradient.setZero();
  out.tangent = TangentsOf(motion.tau);
  for (size_t i = 0; i < matches_.size(); ++i) {
    const Residual one = LineariseOne(i, motion, out.tangent);
    const double weight = loss.Weight(one.Squared());
    out.hessian += one.Square(weight);
    out.gradient += weight * one.value[0] * one.by[0];
    if (one.is_behind) out.gradient += weight * one.value[1] * one.by[1];
  }
  out.hessian = InCameraB(out.hessian, motion);
  out.gradient.head<3>() = (motion.R_a_b.transpose() * out.gradient.head<3>()).eval();
  return out;
}

RotationFit TwoViewProblem::FitWithCovariance(const TwoViewMotion& motion,
                                              const RobustLoss& loss) const {
  RotationFit fit;
  fit.R_a_b = motion.R_a_b;
  const Eigen::Matrix<double, 3, 2> tangent = TangentsOf(motion.tau);
  Eigen::Matrix<double, 5, 5> information = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix2d noise = Eigen::Matrix2d::Zero();
  double sum_psi_sq = 0.0, sum_slope = 0.0, count = 0.0;
  for (size_t i = 0; i < matches_.size(); ++i) {
    const Residual one = LineariseOne(i, motion, tangent);
    const double squared = one.Squared();
    if (!loss.IsInlier(squared)) continue;
    information += one.Square(1.0);
    const double weight = loss.Weight(squared);
    sum_psi_sq += weight * weight * squared;
    sum_slope += loss.Slope(squared);
    count += 1.0;
    // What varies in n while tau . n is held.
    const double variance = noise_[i].Variance(motion.tau);
    const Eigen::Vector3d cov_tau = noise_[i].cov_n * motion.tau;
    noise += tangent.transpose() * (noise_[i].cov_n - cov_tau * cov_tau.transpose() / variance) *
             tangent / variance;
  }
  information = InCameraB(information, motion);
  const double slope = sum_slope / count;
  if (!(count > 5.0) || !(slope > 0.0)) return fit;
  fit.variance_px = sum_psi_sq / (count - 5.0) / (slope * slope);

  // The noise in units of the information, I = L L': its eigenvectors U, and L U in those of I.
  const Eigen::LLT<Eigen::Matrix2d> of_direction(information.bottomRightCorner<2, 2>());
  if (of_direction.info() != Eigen::Success) return fit;
  const Eigen::Matrix2d L = of_direction.matrixL(), L_inverse = L.inverse();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> relative;
  relative.computeDirect(fit.variance_px * L_inverse * noise * L_inverse.transpose());
  const Eigen::Matrix2d basis = L * relative.eigenvectors();
  information.bottomRightCorner<2, 2>() -=
      basis * relative.eigenvalues().cwiseMin(0.5).asDiagonal() * basis.transpose();

  const Eigen::LDLT<Eigen::Matrix<double, 5, 5>> factor(information);
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0.0)) {
    return fit;
  }
  const Eigen::Matrix<double, 5, 5> covariance =
      fit.variance_px * factor.solve(Eigen::Matrix<double, 5, 5>::Identity());
  fit.covariance = covariance.topLeftCorner<3, 3>();
  return fit;
}

void TwoViewProblem::Minimise(const RobustLoss& loss, int max_iterations,
                              TwoViewMotion* motion) const {
  double cost = Cost(*motion, loss);
  double damping = 1e-4;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    Linearised normal = Linearise(*motion, loss);
    normal.hessian.diagonal() *= 1.0 + damping;
    const Eigen::Matrix<double, 5, 1> step = normal.hessian.ldlt().solve(-normal.gradient);
    if (!step.allFinite()) return;
    TwoViewMotion candidate;
    candidate.R_a_b = motion->R_a_b * Exp(Eigen::Vector3d(step.head<3>())).toRotationMatrix();
    candidate.tau = (motion->tau + normal.tangent * step.tail<2>()).normalized();
    const double candidate_cost = Cost(candidate, loss);
    if (candidate_cost < cost) {
      *motion = candidate;
      const bool settled = cost - candidate_cost < 1e-6 * cost;
      cost = candidate_cost;
      damping = std::max(1e-9, 0.1 * damping);
      if (settled) return;
    } else {
      damping *= 10.0;
      if (damping > 1e3) return;
    }
  }
}

Eigen::Matrix<double, 5, 5> TwoViewProblem::InCameraB(const Eigen::Matrix<double, 5, 5>& square,
                                                      const TwoViewMotion& motion) {
  Eigen::Matrix<double, 5, 5> turn = Eigen::Matrix<double, 5, 5>::Identity();
  turn.topLeftCorner<3, 3>() = motion.R_a_b;
  return turn.transpose() * square * turn;
}

double TwoViewProblem::SquaredResidual(size_t i, const TwoViewMotion& motion) const {
  const Eigen::Vector3d& a = matches_[i].a;
  CoplanarityNormal normal = noise_[i];
  normal.n = a.cross(motion.R_a_b * matches_[i].b);
  const double squared = normal.SquaredDistance(motion.tau);
  const Eigen::Vector3d forward = motion.tau.cross(a);
  return forward.dot(normal.n) < 0.0 ? squared + normal.SquaredDistance(forward) : squared;
}

TwoViewProblem::Residual TwoViewProblem::LineariseOne(
    size_t i, const TwoViewMotion& motion, const Eigen::Matrix<double, 3, 2>& tangent) const {
  const Eigen::Vector3d& a = matches_[i].a;
  const Eigen::Vector3d b = motion.R_a_b * matches_[i].b;
  const Eigen::Vector3d n = a.cross(b);
  Residual residual;
  // v . n / sigma(v) with its derivatives, for v = v(tau).
  const auto fill = [&](size_t row, const Eigen::Vector3d& v,
                        const Eigen::Matrix<double, 3, 2>& J_v_tangent) {
    const double variance = noise_[i].Variance(v), inv_sigma = 1.0 / std::sqrt(variance);
    residual.value[row] = v.dot(n) * inv_sigma;
    // v . (a x Exp(d) b) = (v x a) . (b + d x b)
    residual.by[row].head<3>() = inv_sigma * b.cross(v.cross(a));
    residual.by[row].tail<2>() =
        J_v_tangent.transpose() *
        (inv_sigma * n - (residual.value[row] / variance) * (noise_[i].cov_n * v));
  };
  fill(0, motion.tau, tangent);
  const Eigen::Vector3d forward = motion.tau.cross(a);
  residual.is_behind = forward.dot(n) < 0.0;
  if (residual.is_behind) fill(1, forward, -Hat(a) * tangent);
  return residual;
}

}  // namespace camgyro
