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

// A translation that explains so much of the variance of the residuals of a rotation alone is
// there, and the rotation fitted with it is near the truth. Without one, that rotation is a median
// of 1.1 mrad off, more than three of its sigmas (EstimateCameraRotation.PureRotationWorks).
constexpr double kExplained = 0.5;

// A motion and the spread of its residuals [px].
struct Candidate {
  double spread_px = 0.0;
  TwoViewMotion motion;
};

double SpreadAt(const TwoViewProblem& problem, const TwoViewMotion& motion, double min_sigma_px) {
  return std::max(min_sigma_px, SpreadOf(problem.SquaredResiduals(motion), 5));
}

// A few steps at the spread of its own residuals.
void Settle(const TwoViewProblem& problem, double min_sigma_px, Candidate* candidate) {
  problem.Minimise(RobustLoss(candidate->spread_px), 4, &candidate->motion);
  candidate->spread_px = SpreadAt(problem, candidate->motion, min_sigma_px);
}

// The direction that a rotation leaves, from the normals: the eigenvector of the sum of their
// weighted squares, on the side where the points are in front.
Candidate DirectionNear(const TwoViewProblem& problem, const Eigen::Matrix3d& R_a_b,
                        double min_sigma_px) {
  constexpr int kRounds = 5;
  Candidate found;
  found.motion.R_a_b = R_a_b;
  std::vector<double> weights;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(
        problem.SumOfNormals(R_a_b, found.motion.tau, weights));
    found.motion.tau = eigen.eigenvectors().col(0);
    if (problem.ShareBehind(found.motion) > 0.5) found.motion.tau *= -1.0;
    std::vector<double> squared = problem.SquaredResiduals(found.motion);
    found.spread_px = std::max(min_sigma_px, SpreadOf(squared, 5));
    const RobustLoss loss(found.spread_px);
    weights.clear();
    for (const double one : squared) weights.push_back(loss.Weight(one));
  }
  return found;
}

// The best motion from a rotation and six directions. Each at the spread of its own residuals, the
// most promising again; then these compete at the least spread.
Candidate SearchDirections(const TwoViewProblem& problem, const Eigen::Matrix3d& R_a_b,
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

// Rotation and translation direction together; `motion` as of EstimateCameraRotation; near: the
// rotation, roughly, if that is known.
RotationFit FitRotationAndTranslation(const std::vector<RayMatch>& matches, double min_sigma_px,
                                      const std::optional<Eigen::Matrix3d>& near,
                                      std::optional<TwoViewMotion>* motion) {
  std::optional<Eigen::Matrix3d> begin_at = near;
  if (!near && *motion) begin_at = (*motion)->R_a_b;
  RotationFit alone =
      FitRotationOnly(matches, min_sigma_px, begin_at.value_or(Eigen::Matrix3d::Identity()));
  TwoViewProblem problem(matches, begin_at.value_or(alone.R_a_b));
  Candidate best;
  if (near) {
    best = DirectionNear(problem, *near, min_sigma_px);
  } else if (*motion) {
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
  double bias_sq = 2.0 * excess * rad_per_px * rad_per_px;
  // The mean is more than that where all points are at similar distances, as in a room. It shows in
  // what the two rotations differ by, beyond the noise of that.
  if (joint.variance_px < (1.0 - kExplained) * alone.variance_px) {
    const Eigen::Quaterniond apart(Eigen::Matrix3d(joint.R_a_b.transpose() * alone.R_a_b));
    const double noise_sq = joint.covariance->trace() - alone.covariance->trace();
    bias_sq = std::max(bias_sq, (Log(apart).squaredNorm() - noise_sq) / 3.0);
  }
  *alone.covariance += bias_sq * Eigen::Matrix3d::Identity();
  return alone.covariance->trace() < joint.covariance->trace() ? alone : joint;
}

// The rotation of a pair's rays; `near` and `motion` as above.
std::optional<CameraRotation> RotationOf(const FramePair& pair,
                                         const std::vector<RayMatch>& matches,
                                         const TwoViewOptions& options,
                                         const std::optional<Eigen::Matrix3d>& near,
                                         std::optional<TwoViewMotion>* motion) {
  if (static_cast<int>(matches.size()) < std::max(options.min_matches, 8)) return std::nullopt;
  std::optional<TwoViewMotion> unknown;
  const RotationFit fit = options.with_translation
                              ? FitRotationAndTranslation(matches, options.min_sigma_px, near,
                                                          motion ? motion : &unknown)
                              : FitRotationOnly(matches, options.min_sigma_px,
                                                near.value_or(Eigen::Matrix3d::Identity()));
  if (!fit.covariance || !(fit.covariance->trace() > 0.0)) return std::nullopt;
  CameraRotation rotation;
  rotation.frame_a = pair.frame_a;
  rotation.frame_b = pair.frame_b;
  rotation.q_a_b = Eigen::Quaterniond(fit.R_a_b).normalized();
  rotation.sigma_rad = std::sqrt(fit.covariance->trace() / 3.0);
  rotation.residual_px = std::sqrt(fit.variance_px);
  return rotation;
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
  return RotationOf(pair, matches, options, std::nullopt, motion);
}

std::optional<CameraRotation> EstimateCameraRotation(const FramePair& pair,
                                                     const GyroRotation& gyro,
                                                     const TwoViewOptions& options) {
  std::vector<RayMatch> matches;
  matches.reserve(pair.matches.size());
  for (const Match& match : pair.matches) {
    if (!match.px_a.allFinite() || !match.px_b.allFinite()) continue;
    if (const std::optional<RayMatch> rays = gyro.Unroll(match)) matches.push_back(*rays);
  }
  return RotationOf(pair, matches, options, gyro.BetweenMiddleRows(), nullptr);
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
