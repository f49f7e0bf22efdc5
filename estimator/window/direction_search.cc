#include "estimator/window/direction_search.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "factors/coplanarity_plane.h"
#include "factors/robust.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

// A Fibonacci lattice on the half sphere (tau and -tau are the same plane).
std::vector<Vector3d> HalfSphere(int count) {
  std::vector<Vector3d> directions;
  const double golden = M_PI * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = (i + 0.5) / count, radius = std::sqrt(1.0 - z * z);
    directions.emplace_back(radius * std::cos(golden * i), radius * std::sin(golden * i), z);
  }
  return directions;
}

double Cost(const PairBearings& bearings, double variance_a, double variance_b, double threshold,
            const Vector3d& tau, size_t stride) {
  double cost = 0.0;
  for (size_t i = 0; i < bearings.a.size(); i += stride) {
    const Vector3d &a = bearings.a[i].ray_ref, &b = bearings.b[i].ray_ref;
    const double e = tau.dot(a.cross(b));
    const double variance =
        variance_a * (bearings.a[i].J_ray_px.transpose() * b.cross(tau)).squaredNorm() +
        variance_b * (bearings.b[i].J_ray_px.transpose() * tau.cross(a)).squaredNorm() + 1e-30;
    const double r = Robustify(e / std::sqrt(variance), threshold).value;
    cost += r * r;
  }
  return cost;
}

struct Refined {
  Vector3d tau;
  double cost;
};

Refined Refine(const PairBearings& bearings, double variance_a, double variance_b, double threshold,
               Vector3d tau) {
  double cost = Cost(bearings, variance_a, variance_b, threshold, tau, 1);
  double damping = 1e-3;
  for (int iteration = 0; iteration < 8; ++iteration) {
    const Vector3d u = tau.unitOrthogonal(), v = tau.cross(u);
    Eigen::Matrix<double, 3, 2> basis;
    basis << u, v;
    Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
    Eigen::Vector2d g = Eigen::Vector2d::Zero();
    for (size_t i = 0; i < bearings.a.size(); ++i) {
      const PlaneResidual r = EvaluatePlaneResidual(bearings.a[i].ray_ref, bearings.a[i].J_ray_px,
                                                    bearings.b[i].ray_ref, bearings.b[i].J_ray_px,
                                                    tau, variance_a, variance_b);
      const RobustResidual robust = Robustify(r.value, threshold);
      const Eigen::Vector2d J = robust.derivative * (basis.transpose() * r.by_tau);
      H += J * J.transpose();
      g += J * robust.value;
    }
    H.diagonal() *= 1.0 + damping;
    H.diagonal().array() += 1e-12;
    const Eigen::Vector2d step = -H.ldlt().solve(g);
    const Vector3d candidate = (tau + basis * step).normalized();
    const double candidate_cost = Cost(bearings, variance_a, variance_b, threshold, candidate, 1);
    if (candidate_cost < cost) {
      const bool converged = cost - candidate_cost < 1e-5 * cost;
      tau = candidate;
      cost = candidate_cost;
      damping = std::max(1e-9, 0.2 * damping);
      if (converged) break;
    } else {
      damping *= 10.0;
      if (damping > 1e6) break;
    }
  }
  return {tau, cost};
}

}  // namespace

double CostOfPointsBehind(const PairBearings& bearings, double variance_a, double variance_b,
                          double robust_threshold, const Vector3d& tau, size_t stride) {
  // With a and b turned to one orientation, the depth along a has the sign of (tau x b).(a x b).
  int in_front = 0, behind = 0;
  for (size_t i = 0; i < bearings.a.size(); i += stride) {
    const Vector3d &a = bearings.a[i].ray_ref, &b = bearings.b[i].ray_ref;
    const Vector3d along = tau.cross(b);
    const double parallax = along.dot(a.cross(b));
    const double variance =
        variance_a * (bearings.a[i].J_ray_px.transpose() * b.cross(along)).squaredNorm() +
        variance_b * (bearings.b[i].J_ray_px.transpose() * along.cross(a)).squaredNorm();
    if (parallax * parallax < 4.0 * variance) continue;
    ++(parallax > 0.0 ? in_front : behind);
  }
  const double outlier = robust_threshold > 0.0 ? robust_threshold * robust_threshold : 9.0;
  return outlier * std::min(in_front, behind);
}

DirectionEstimate FindDirection(const PairBearings& bearings, double variance_a, double variance_b,
                                double robust_threshold) {
  static const std::vector<Vector3d> grid = HalfSphere(120);
  std::vector<Vector3d> candidates = grid;
  const size_t n = bearings.a.size();
  // Two matches give a direction: their cross products' cross product.
  for (size_t k = 0; k < 20 && n >= 2; ++k) {
    const size_t i = (k * 7919) % n, j = (i + 1 + (k * 104729) % (n - 1)) % n;
    const Vector3d tau = bearings.a[i]
                             .ray_ref.cross(bearings.b[i].ray_ref)
                             .cross(bearings.a[j].ray_ref.cross(bearings.b[j].ray_ref));
    if (tau.norm() > 1e-14) candidates.push_back(tau.normalized());
  }
  // Some 60 matches rank the candidates well enough; the refinement uses them all.
  const size_t stride = std::max<size_t>(1, n / 60);
  const auto total_cost = [&](double cost, const Vector3d& tau, size_t step) {
    return cost + CostOfPointsBehind(bearings, variance_a, variance_b, robust_threshold, tau, step);
  };
  std::vector<std::pair<double, size_t>> ranked;
  for (size_t c = 0; c < candidates.size(); ++c) {
    const double cost =
        Cost(bearings, variance_a, variance_b, robust_threshold, candidates[c], stride);
    ranked.emplace_back(total_cost(cost, candidates[c], stride), c);
  }
  const size_t starts = std::min<size_t>(3, ranked.size());
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(starts),
                    ranked.end());
  DirectionEstimate best;
  for (size_t s = 0; s < starts; ++s) {
    const Refined refined =
        Refine(bearings, variance_a, variance_b, robust_threshold, candidates[ranked[s].second]);
    const double cost = total_cost(refined.cost, refined.tau, 1);
    if (s == 0 || cost < best.cost) {
      best.tau = refined.tau;
      best.cost = cost;
    }
  }
  best.residuals.reserve(n);
  for (size_t i = 0; i < n; ++i) {
    best.residuals.push_back(EvaluatePlaneResidual(bearings.a[i].ray_ref, bearings.a[i].J_ray_px,
                                                   bearings.b[i].ray_ref, bearings.b[i].J_ray_px,
                                                   best.tau, variance_a, variance_b)
                                 .value);
  }
  return best;
}

}  // namespace camgyro
