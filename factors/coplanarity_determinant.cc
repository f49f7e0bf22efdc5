#include "factors/coplanarity_determinant.h"

#include <glog/logging.h>

#include <random>
#include <utility>

#include "factors/robust.h"

namespace camgyro {

CoplanarityDeterminant::CoplanarityDeterminant(std::shared_ptr<const PairMeasurement> pair,
                                               std::vector<Triplet> triplets)
    : pair_(std::move(pair)), triplets_(std::move(triplets)) {
  CHECK_GT(pair_->sigma, 0.0);
  CHECK_GE(pair_->rate_times_s.size(), 2u);
  set_num_residuals(static_cast<int>(triplets_.size()));
  *mutable_parameter_block_sizes() = {kLensSize, kShutterSize, 4};
  if (pair_->effects) mutable_parameter_block_sizes()->push_back(pair_->effects->size());
  for (size_t g = 0; g < pair_->rate_group_sizes.size(); ++g) {
    mutable_parameter_block_sizes()->push_back(3 * pair_->num_rate_values(g));
  }
}

bool CoplanarityDeterminant::Evaluate(double const* const* parameters, double* residuals,
                                      double** jacobians) const {
  using Eigen::Vector2d;
  using Eigen::Vector3d;
  const PairMeasurement& pair = *pair_;
  const int first_rate_group = kEffectsBlock + NumEffectBlocks(pair);
  const RotationChain chain = ChainOf(pair, parameters + first_rate_group);
  PairBearings bearings;
  if (!EvaluatePairBearings(pair, chain, parameters[0], parameters[1], parameters[2],
                            pair.effects ? parameters[kEffectsBlock] : nullptr,
                            jacobians != nullptr, &bearings)) {
    return false;
  }
  const double var_a = pair.variance_a(), var_b = pair.variance_b();
  PairRow row(chain);
  for (size_t t = 0; t < triplets_.size(); ++t) {
    std::array<const Bearing*, 3> a, b;
    std::array<Vector3d, 3> n, c;  // cross products, and derivative of the determinant by each
    for (size_t i = 0; i < 3; ++i) {
      a[i] = &bearings.a[static_cast<size_t>(triplets_[t][i])];
      b[i] = &bearings.b[static_cast<size_t>(triplets_[t][i])];
      n[i] = a[i]->ray_ref.cross(b[i]->ray_ref);
    }
    for (size_t i = 0; i < 3; ++i) c[i] = n[(i + 1) % 3].cross(n[(i + 2) % 3]);
    const double det = n[0].dot(c[0]);

    std::array<Vector3d, 3> m_a, m_b, q_a, q_b;
    std::array<Vector2d, 3> p_a, p_b;  // derivative of the determinant by the pixels
    double variance = 1e-60;
    for (size_t i = 0; i < 3; ++i) {
      m_a[i] = b[i]->ray_ref.cross(c[i]);
      m_b[i] = c[i].cross(a[i]->ray_ref);
      p_a[i] = a[i]->J_ray_px.transpose() * m_a[i];
      p_b[i] = b[i]->J_ray_px.transpose() * m_b[i];
      q_a[i] = var_a * (a[i]->J_ray_px * p_a[i]);
      q_b[i] = var_b * (b[i]->J_ray_px * p_b[i]);
      variance += var_a * p_a[i].squaredNorm() + var_b * p_b[i].squaredNorm();
    }
    const double inv_sigma = 1.0 / std::sqrt(variance);
    const double r = det * inv_sigma;
    const RobustResidual robust = Robustify(r, pair.robust_threshold);
    residuals[t] = robust.value;
    if (jacobians == nullptr) continue;

    // dr = d det / sigma - k d(sigma^2 / 2); sigma depends on the rays directly and through c.
    const double k = r * inv_sigma * inv_sigma;
    std::array<Vector3d, 3> half_var_by_c, half_var_by_n;
    for (size_t i = 0; i < 3; ++i) {
      half_var_by_c[i] = q_a[i].cross(b[i]->ray_ref) + a[i]->ray_ref.cross(q_b[i]);
    }
    for (size_t i = 0; i < 3; ++i) {  // c_j = n_{j+1} x n_{j+2}
      const size_t next = (i + 1) % 3, previous = (i + 2) % 3;
      half_var_by_n[i] =
          n[next].cross(half_var_by_c[previous]) + half_var_by_c[next].cross(n[previous]);
    }
    row.Clear();
    for (size_t i = 0; i < 3; ++i) {
      const Vector3d& ray_a = a[i]->ray_ref;
      const Vector3d& ray_b = b[i]->ray_ref;
      const Vector3d half_var_by_a = q_b[i].cross(c[i]) + ray_b.cross(half_var_by_n[i]);
      const Vector3d half_var_by_b = c[i].cross(q_a[i]) + half_var_by_n[i].cross(ray_a);
      row.Add(*a[i], chain, pair.size_px.y(), inv_sigma * m_a[i] - k * half_var_by_a,
              (-k * var_a) * m_a[i] * p_a[i].transpose());
      row.Add(*b[i], chain, pair.size_px.y(), inv_sigma * m_b[i] - k * half_var_by_b,
              (-k * var_b) * m_b[i] * p_b[i].transpose());
    }
    row.Write(static_cast<int>(t), robust.derivative, parameters[2], pair, first_rate_group,
              jacobians);
  }
  return true;
}

std::vector<CoplanarityDeterminant::Triplet> RandomTriplets(int num_matches, int count,
                                                            uint64_t seed) {
  CHECK_GE(num_matches, 3);
  std::mt19937_64 generator(seed);
  const auto draw = [&generator](int limit) {
    return static_cast<int>(generator() % static_cast<uint64_t>(limit));
  };
  std::vector<CoplanarityDeterminant::Triplet> triplets;
  triplets.reserve(static_cast<size_t>(count));
  while (static_cast<int>(triplets.size()) < count) {
    const int i = draw(num_matches), j = draw(num_matches), k = draw(num_matches);
    if (i != j && j != k && k != i) triplets.push_back({i, j, k});
  }
  return triplets;
}

}  // namespace camgyro
