#include "factors/coplanarity_plane.h"

#include <glog/logging.h>

#include <algorithm>
#include <utility>

#include "factors/robust.h"

namespace camgyro {
namespace {

bool IsWanted(const double* jacobian) { return jacobian != nullptr; }

// The numerator e = tau . (a x b) is linear in each ray: e = a . m_a = b . m_b.
struct Numerator {
  Numerator(const Eigen::Vector3d& a, const Eigen::Matrix<double, 3, 2>& A,
            const Eigen::Vector3d& b, const Eigen::Matrix<double, 3, 2>& B,
            const Eigen::Vector3d& tau)
      : m_a(b.cross(tau)),
        m_b(tau.cross(a)),
        n(a.cross(b)),
        e_px_a(A.transpose() * m_a),
        e_px_b(B.transpose() * m_b) {}

  double InverseSigma(double variance_a, double variance_b) const {
    // A match on the epipole in both images says nothing; the floor keeps it at zero residual.
    return 1.0 /
           std::sqrt(variance_a * e_px_a.squaredNorm() + variance_b * e_px_b.squaredNorm() + 1e-30);
  }

  Eigen::Vector3d m_a, m_b, n;
  Eigen::Vector2d e_px_a, e_px_b;
};

}  // namespace

double PlaneResidualValue(const Eigen::Vector3d& a, const Eigen::Matrix<double, 3, 2>& A,
                          const Eigen::Vector3d& b, const Eigen::Matrix<double, 3, 2>& B,
                          const Eigen::Vector3d& tau, double variance_a, double variance_b) {
  const Numerator e(a, A, b, B, tau);
  return tau.dot(e.n) * e.InverseSigma(variance_a, variance_b);
}

PlaneResidual EvaluatePlaneResidual(const Eigen::Vector3d& a, const Eigen::Matrix<double, 3, 2>& A,
                                    const Eigen::Vector3d& b, const Eigen::Matrix<double, 3, 2>& B,
                                    const Eigen::Vector3d& tau, double variance_a,
                                    double variance_b) {
  const Numerator e(a, A, b, B, tau);
  const Eigen::Vector3d &m_a = e.m_a, &m_b = e.m_b, &n = e.n;
  const Eigen::Vector2d &e_px_a = e.e_px_a, &e_px_b = e.e_px_b;
  const double inv_sigma = e.InverseSigma(variance_a, variance_b);

  PlaneResidual r;
  r.value = tau.dot(n) * inv_sigma;
  // dr = de / sigma - (e / sigma^3) d(sigma^2 / 2)
  const double k = r.value * inv_sigma * inv_sigma;
  const Eigen::Vector3d q_a = variance_a * (A * e_px_a), q_b = variance_b * (B * e_px_b);
  r.by_a = inv_sigma * m_a - k * q_b.cross(tau);
  r.by_b = inv_sigma * m_b - k * tau.cross(q_a);
  r.by_tau = inv_sigma * n - k * (q_a.cross(b) + a.cross(q_b));
  r.by_J_a = (-k * variance_a) * m_a * e_px_a.transpose();
  r.by_J_b = (-k * variance_b) * m_b * e_px_b.transpose();
  return r;
}

CoplanarityPlane::CoplanarityPlane(std::shared_ptr<const PairMeasurement> pair)
    : pair_(std::move(pair)) {
  CHECK_GT(pair_->sigma, 0.0);
  CHECK_GE(pair_->rate_times_s.size(), 2u);
  set_num_residuals(static_cast<int>(pair_->matches.size()));
  *mutable_parameter_block_sizes() = {kLensSize, kShutterSize, 4, 3, 6};
  if (pair_->effects) mutable_parameter_block_sizes()->push_back(pair_->effects->size());
  mutable_parameter_block_sizes()->resize(
      parameter_block_sizes().size() + static_cast<size_t>(NumTimeBlocks(*pair_)), 1);
  for (size_t g = 0; g < pair_->rate_group_sizes.size(); ++g) {
    mutable_parameter_block_sizes()->push_back(3 * pair_->num_rate_values(g));
  }
}

bool CoplanarityPlane::Evaluate(double const* const* parameters, double* residuals,
                                double** jacobians) const {
  const PairMeasurement& pair = *pair_;
  const int times_block = kEffectsBlock + NumEffectBlocks(pair);
  const int first_rate_group = times_block + NumTimeBlocks(pair);
  const RotationChain chain = ChainOf(pair, parameters + first_rate_group);
  const BearingsOfMatch bearings(pair, chain, parameters[0], parameters[1], parameters[2],
                                 pair.effects ? parameters[kEffectsBlock] : nullptr,
                                 pair.own_times ? parameters + times_block : nullptr);
  const Eigen::Vector3d tau = Eigen::Map<const Eigen::Vector3d>(parameters[kTauBlock]);
  const Eigen::Map<const Eigen::Matrix<double, 3, 2>> bend(parameters[kBendBlock]);
  // What is held, nobody asks about: directions and the frames' own times need none of it.
  const bool whole_row =
      jacobians != nullptr &&
      (std::any_of(jacobians, jacobians + kTauBlock, IsWanted) ||
       std::any_of(jacobians + kEffectsBlock, jacobians + times_block, IsWanted) ||
       std::any_of(jacobians + first_rate_group, jacobians + parameter_block_sizes().size(),
                   IsWanted));
  PairRow row(chain);
  Bearing a, b;
  for (size_t i = 0; i < pair.matches.size(); ++i) {
    if (!bearings.Evaluate(i, jacobians != nullptr, &a, &b)) return false;
    const Eigen::Vector2d shares = BendShares(pair, pair.matches[i]);
    const Eigen::Vector3d direction = tau + bend * shares;
    if (jacobians == nullptr) {
      const double value = PlaneResidualValue(a.ray_ref, a.J_ray_px, b.ray_ref, b.J_ray_px,
                                              direction, pair.variance_a(), pair.variance_b());
      residuals[i] = Robustify(value, pair.robust_threshold).value;
      continue;
    }
    const PlaneResidual r = EvaluatePlaneResidual(a.ray_ref, a.J_ray_px, b.ray_ref, b.J_ray_px,
                                                  direction, pair.variance_a(), pair.variance_b());
    const RobustResidual robust = Robustify(r.value, pair.robust_threshold);
    residuals[i] = robust.value;
    if (whole_row) {
      row.Clear();
      row.Add(a, chain, pair.size_px.y(), r.by_a, r.by_J_a);
      row.Add(b, chain, pair.size_px.y(), r.by_b, r.by_J_b);
      row.Write(static_cast<int>(i), robust.derivative, parameters[2], pair, first_rate_group,
                jacobians);
    }
    for (int k = 0; k < NumTimeBlocks(pair); ++k) {
      if (jacobians[times_block + k] == nullptr) continue;
      jacobians[times_block + k][i] =
          robust.derivative * (k == 0 ? ByTime(a, r.by_a, r.by_J_a) : ByTime(b, r.by_b, r.by_J_b));
    }
    if (jacobians[kTauBlock] != nullptr) {
      Eigen::Map<Eigen::Vector3d>(jacobians[kTauBlock] + 3 * i) = robust.derivative * r.by_tau;
    }
    if (jacobians[kBendBlock] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 2>>(jacobians[kBendBlock] + 6 * i) =
          robust.derivative * r.by_tau * shares.transpose();
    }
  }
  return true;
}

}  // namespace camgyro
