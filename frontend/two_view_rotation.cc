#include "frontend/two_view_rotation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/robust_statistics.h"
#include "core/so3.h"
#include "frontend/outliers.h"

namespace camgyro {
namespace {

// Rays of a match in their own cameras, third component 1.
struct RayMatch {
  Eigen::Vector3d a, b;
  Eigen::Matrix<double, 3, 2> J_a_px, J_b_px;
};

// Median absolute residual as a standard deviation, corrected for the parameters fitted.
double SpreadOf(std::vector<double> squared, int num_parameters) {
  const auto n = static_cast<double>(squared.size());
  return kSigmaOfMedian * std::sqrt(MedianInPlace(&squared) * n / (n - num_parameters));
}

// Loss of a squared residual s: c^2 u / (1 + u), u = s / c^2 (Geman and McClure). Bounded, because
// a wrong match has leverage: its normal is long, and turns tau towards it even at Cauchy's weight
// (20 % of wrong matches: 2.2 mrad with Cauchy, 1.1 mrad with this).
class RobustLoss {
 public:
  explicit RobustLoss(double sigma) : c_sq_(9.0 * sigma * sigma) {}
  double Loss(double squared) const { return squared / (1.0 + squared / c_sq_); }
  double Weight(double squared) const {
    const double root = 1.0 / (1.0 + squared / c_sq_);
    return root * root;
  }
  bool IsInlier(double squared) const { return squared <= c_sq_; }
  // Derivative of psi = Weight * residual by the residual.
  double Slope(double squared) const {
    const double u = squared / c_sq_;
    return (1.0 - 3.0 * u) / ((1.0 + u) * (1.0 + u) * (1.0 + u));
  }

 private:
  double c_sq_;
};

// A rotation R_a_b with the covariance of its right perturbation [rad^2].
struct RotationFit {
  Eigen::Matrix3d R_a_b = Eigen::Matrix3d::Identity();
  std::optional<Eigen::Matrix3d> covariance;  // nothing: the matches do not determine it
  double variance_px = 0.0;                   // of one observation, per axis [px^2]
};

// Rotation alone, as if there were no translation. Iteratively re-weighted Gauss-Newton on the
// transfer error of a into the second image [px].
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

Eigen::Matrix<double, 3, 2> TangentOf(const Eigen::Vector3d& unit) {
  Eigen::Matrix<double, 3, 2> tangent;
  tangent.col(0) = unit.unitOrthogonal();
  tangent.col(1) = unit.cross(tangent.col(0));
  return tangent;
}

class JointProblem {
 public:
  JointProblem(const std::vector<RayMatch>& matches, const Eigen::Matrix3d& R_a_b)
      : matches_(matches), noise_(matches.size()) {
    SetNoiseRotation(R_a_b);
  }

  struct Linearised {
    Eigen::Matrix<double, 5, 5> hessian;  // rotation (right perturbation), tangent of tau
    Eigen::Matrix<double, 5, 1> gradient;
    Eigen::Matrix<double, 3, 2> tangent;
  };

  void SetNoiseRotation(const Eigen::Matrix3d& R_a_b) {
    for (size_t i = 0; i < matches_.size(); ++i) {
      const RayMatch& match = matches_[i];
      noise_[i] = MakeCoplanarityNormal(
          {match.a, R_a_b * match.b, match.J_a_px, R_a_b * match.J_b_px}, MatchNoise::kBothImages);
    }
  }

  // Squared residuals [px^2] of all matches.
  std::vector<double> SquaredResiduals(const TwoViewMotion& motion) const {
    std::vector<double> squared(matches_.size());
    for (size_t i = 0; i < matches_.size(); ++i) squared[i] = SquaredResidual(i, motion);
    return squared;
  }

  double Cost(const TwoViewMotion& motion, const RobustLoss& loss) const {
    double cost = 0.0;
    for (size_t i = 0; i < matches_.size(); ++i) cost += loss.Loss(SquaredResidual(i, motion));
    return cost;
  }

  Linearised Linearise(const TwoViewMotion& motion, const RobustLoss& loss) const {
    Linearised out;
    out.hessian.setZero();
    out.gradient.setZero();
    out.tangent = TangentOf(motion.tau);
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

  // Of the rotation, right perturbation [rad^2], as an M-estimator's: E psi^2 / (E psi')^2 on the
  // normal equations of the inliers. Nothing if they do not determine it.
  //
  // Noise in the normals looks like parallax and inflates the information on tau (errors in
  // variables: docs/architecture.md, traps). Its expectation is taken off again, up to half: the
  // rest is needed where there is no parallax at all.
  RotationFit FitWithCovariance(const TwoViewMotion& motion, const RobustLoss& loss) const {
    RotationFit fit;
    fit.R_a_b = motion.R_a_b;
    const Eigen::Matrix<double, 3, 2> tangent = TangentOf(motion.tau);
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

    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> relative(
        fit.variance_px * noise, information.bottomRightCorner<2, 2>());
    if (relative.info() != Eigen::Success) return fit;
    // Eigenvectors V have V' I V = 1, so that V^-1 = V' I.
    const Eigen::Matrix2d basis = information.bottomRightCorner<2, 2>() * relative.eigenvectors();
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

  // Levenberg-Marquardt at a fixed loss.
  void Minimise(const RobustLoss& loss, int max_iterations, TwoViewMotion* motion) const {
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

 private:
  // Of one match: distance from the epipolar line and, on its wrong side, from the epipole. [px]
  struct Residual {
    bool is_behind = false;  // on the wrong side; else only the first of the two is there
    std::array<double, 2> value;
    // By a rotation in camera a (left perturbation), and by the tangent of tau.
    std::array<Eigen::Matrix<double, 5, 1>, 2> by;

    double Squared() const { return value[0] * value[0] + (is_behind ? value[1] * value[1] : 0.0); }
    Eigen::Matrix<double, 5, 5> Square(double weight) const {
      Eigen::Matrix<double, 5, 5> square = (weight * by[0]) * by[0].transpose();
      if (is_behind) square += (weight * by[1]) * by[1].transpose();
      return square;
    }
  };

  // What was of a rotation in camera a, for one in camera b.
  static Eigen::Matrix<double, 5, 5> InCameraB(const Eigen::Matrix<double, 5, 5>& square,
                                               const TwoViewMotion& motion) {
    Eigen::Matrix<double, 5, 5> turn = Eigen::Matrix<double, 5, 5>::Identity();
    turn.topLeftCorner<3, 3>() = motion.R_a_b;
    return turn.transpose() * square * turn;
  }

  double SquaredResidual(size_t i, const TwoViewMotion& motion) const {
    const Eigen::Vector3d& a = matches_[i].a;
    CoplanarityNormal normal = noise_[i];
    normal.n = a.cross(motion.R_a_b * matches_[i].b);
    const double squared = normal.SquaredDistance(motion.tau);
    const Eigen::Vector3d forward = motion.tau.cross(a);
    return forward.dot(normal.n) < 0.0 ? squared + normal.SquaredDistance(forward) : squared;
  }

  Residual LineariseOne(size_t i, const TwoViewMotion& motion,
                        const Eigen::Matrix<double, 3, 2>& tangent) const {
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

  const std::vector<RayMatch>& matches_;
  std::vector<CoplanarityNormal> noise_;  // cov_n of each match; n is not used
};

// A motion and the spread of its residuals [px].
struct Candidate {
  double spread_px = 0.0;
  TwoViewMotion motion;
};

double SpreadAt(const JointProblem& problem, const TwoViewMotion& motion, double min_sigma_px) {
  return std::max(min_sigma_px, SpreadOf(problem.SquaredResiduals(motion), 5));
}

// A few steps at the spread of its own residuals.
void Settle(const JointProblem& problem, double min_sigma_px, Candidate* candidate) {
  problem.Minimise(RobustLoss(candidate->spread_px), 4, &candidate->motion);
  candidate->spread_px = SpreadAt(problem, candidate->motion, min_sigma_px);
}

// The best motion from a rotation and six directions. Each at the spread of its own residuals, the
// most promising again; then these compete at the least spread.
Candidate SearchDirections(const JointProblem& problem, const Eigen::Matrix3d& R_a_b,
                           double min_sigma_px) {
  const auto sort = [](std::vector<Candidate>* candidates) {
    std::stable_sort(candidates->begin(), candidates->end(),
                     [](const auto& x, const auto& y) { return x.spread_px < y.spread_px; });
  };
  std::vector<Candidate> candidates;
  for (int axis = 0; axis < 6; ++axis) {
    Candidate& next = candidates.emplace_back();
    next.motion.R_a_b = R_a_b;
    next.motion.tau = (axis < 3 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(axis % 3);
    next.spread_px = SpreadAt(problem, next.motion, min_sigma_px);
    Settle(problem, min_sigma_px, &next);
  }
  sort(&candidates);
  candidates.resize(3);
  for (Candidate& candidate : candidates) Settle(problem, min_sigma_px, &candidate);
  sort(&candidates);

  Candidate best = candidates.front();
  const RobustLoss shared_loss(best.spread_px);
  double best_cost = std::numeric_limits<double>::infinity();
  for (Candidate& candidate : candidates) {
    problem.Minimise(shared_loss, 10, &candidate.motion);
    const double cost = problem.Cost(candidate.motion, shared_loss);
    if (cost < best_cost) {
      best_cost = cost;
      best.motion = candidate.motion;
    }
  }
  return best;
}

// Rotation and translation direction together; `motion` as of EstimateCameraRotation.
RotationFit FitRotationAndTranslation(const std::vector<RayMatch>& matches, double min_sigma_px,
                                      std::optional<TwoViewMotion>* motion) {
  RotationFit alone = FitRotationOnly(matches, min_sigma_px,
                                      *motion ? (*motion)->R_a_b : Eigen::Matrix3d::Identity());
  JointProblem problem(matches, *motion ? (*motion)->R_a_b : alone.R_a_b);
  Candidate best;
  if (*motion) {
    best.motion = **motion;
    best.spread_px = SpreadAt(problem, best.motion, min_sigma_px);
  } else {
    best = SearchDirections(problem, alone.R_a_b, min_sigma_px);
  }
  // Wrong matches lose their hold as the spread falls.
  problem.SetNoiseRotation(best.motion.R_a_b);
  for (int round = 0; round < 8; ++round) {
    const double spread_px = best.spread_px;
    Settle(problem, min_sigma_px, &best);
    if (best.spread_px > 0.97 * spread_px) break;
  }
  *motion = best.motion;
  const RotationFit joint = problem.FitWithCovariance(best.motion, RobustLoss(best.spread_px));

  // Where nothing translated, a free translation costs a factor of six in the rotation's error. The
  // rotation alone is preferred if its error is smaller with the bias that parallax suggests. Only
  // what varies of parallax is left in the residuals; the mean, which makes the bias, is taken for
  // sqrt(2) of that: 1 gives up 14 % on ov_handheld_gs, 2 hardly ever chooses the rotation alone.
  if (!alone.covariance || !joint.covariance) return joint;
  double rad_per_px = 0.0;
  for (const RayMatch& match : matches) {
    rad_per_px += std::sqrt(0.5) * match.J_b_px.norm() / static_cast<double>(matches.size());
  }
  const double excess = 2.0 * std::max(0.0, alone.variance_px - joint.variance_px);
  const double bias_sq = 2.0 * excess * rad_per_px * rad_per_px;
  *alone.covariance += bias_sq * Eigen::Matrix3d::Identity();
  return alone.covariance->trace() < joint.covariance->trace() ? alone : joint;
}

}  // namespace

std::optional<CameraRotation> EstimateCameraRotation(const FramePair& pair, const Lens& lens_model,
                                                     const LensParameters& lens,
                                                     const TwoViewOptions& options,
                                                     std::optional<TwoViewMotion>* motion) {
  std::vector<RayMatch> matches;
  matches.reserve(pair.matches.size());
  for (const Match& match : pair.matches) {
    RayJet a, b;
    if (match.px_a.allFinite() && match.px_b.allFinite() &&
        lens_model.Unproject(match.px_a, lens, &a, LensDerivatives::kNone) &&
        lens_model.Unproject(match.px_b, lens, &b, LensDerivatives::kNone)) {
      matches.push_back({a.ray, b.ray, a.J_ray_px, b.J_ray_px});
    }
  }
  if (static_cast<int>(matches.size()) < std::max(options.min_matches, 8)) return std::nullopt;

  std::optional<TwoViewMotion> unknown;
  const RotationFit fit =
      options.with_translation
          ? FitRotationAndTranslation(matches, options.min_sigma_px, motion ? motion : &unknown)
          : FitRotationOnly(matches, options.min_sigma_px, Eigen::Matrix3d::Identity());
  if (!fit.covariance || !(fit.covariance->trace() > 0.0)) return std::nullopt;
  CameraRotation rotation;
  rotation.frame_a = pair.frame_a;
  rotation.frame_b = pair.frame_b;
  rotation.q_a_b = Eigen::Quaterniond(fit.R_a_b).normalized();
  rotation.sigma_rad = std::sqrt(fit.covariance->trace() / 3.0);
  return rotation;
}

std::vector<CameraRotation> CameraRotationsFromAttitudes(
    const std::vector<Eigen::Quaterniond>& q_cam_world, int gap) {
  std::vector<CameraRotation> rotations;
  for (size_t a = 0; a + static_cast<size_t>(gap) < q_cam_world.size(); ++a) {
    const size_t b = a + static_cast<size_t>(gap);
    CameraRotation rotation;
    rotation.frame_a = static_cast<int>(a);
    rotation.frame_b = static_cast<int>(b);
    rotation.q_a_b = (q_cam_world[a] * q_cam_world[b].inverse()).normalized();
    rotations.push_back(rotation);
  }
  return rotations;
}

}  // namespace camgyro
