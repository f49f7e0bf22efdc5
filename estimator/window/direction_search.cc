#include "estimator/window/direction_search.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/sphere.h"
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

// The plane residuals of two matches, prepared for many directions: numerator and sigma are linear
// in the direction and the norm of a linear form. Two beside each other fill the processor's
// registers, which the five rows of one match do not.
struct TwoMatches {
  using Two = Eigen::Array2d;
  static constexpr int kForms = 5;  // x . (a x b), and its derivatives by the pixels in sigmas

  void Set(int which, const Bearing& at_a, const Bearing& at_b, double variance_a,
           double variance_b) {
    const Vector3d &a = at_a.ray_ref, &b = at_b.ray_ref;
    SetForm(which, 0, a.cross(b));
    for (int k = 0; k < 2; ++k) {
      SetForm(which, 1 + k, std::sqrt(variance_a) * at_a.J_ray_px.col(k).cross(b));
      SetForm(which, 3 + k, std::sqrt(variance_b) * a.cross(at_b.J_ray_px.col(k)));
    }
    ray_b.row(which) = b.transpose();
    ++count;
  }
  void SetForm(int which, int form, const Vector3d& value) {
    forms.block<1, 3>(which, 3 * form) = value.transpose();
  }
  Two Form(int form, const std::array<Two, 3>& x) const {
    const auto f = forms.middleCols<3>(3 * form).array();
    return (f.col(0) * x[0] + f.col(1) * x[1]) + f.col(2) * x[2];
  }
  // Sum of the squares of the derivatives.
  Two Variance(const std::array<Two, 3>& x) const {
    const Two e1 = Form(1, x), e2 = Form(2, x), e3 = Form(3, x);
    const auto f = forms.middleCols<3>(12).array();
    const Two e4 = f.col(0) * x[0] + (f.col(1) * x[1] + f.col(2) * x[2]);
    return (e1 * e1 + e3 * e3) + (e2 * e2 + e4 * e4);
  }

  // The residuals in sigmas, without loss, and their derivatives by x.
  Two Residuals(const std::array<Two, 3>& x, std::array<Two, 3>* by_x) const {
    std::array<Two, kForms> e;
    Two variance = Two::Constant(1e-30);
    for (int form = 0; form < kForms; ++form) {
      const auto k = static_cast<size_t>(form);
      e[k] = Form(form, x);
      if (form > 0) variance += e[k] * e[k];
    }
    const Two inv_sigma = 1.0 / variance.sqrt(), residuals = e[0] * inv_sigma;
    // dr = de / sigma - (e / sigma^3) d(sigma^2 / 2)
    const Two factor = residuals * inv_sigma * inv_sigma;
    for (int c = 0; c < 3; ++c) {
      Two half_variance_by = Two::Zero();
      for (int form = 1; form < kForms; ++form) {
        half_variance_by += e[static_cast<size_t>(form)] * forms.col(3 * form + c).array();
      }
      (*by_x)[static_cast<size_t>(c)] =
          inv_sigma * forms.col(c).array() - factor * half_variance_by;
    }
    return residuals;
  }

  Eigen::Matrix<double, 2, 3 * kForms> forms = Eigen::Matrix<double, 2, 3 * kForms>::Zero();
  Eigen::Matrix<double, 2, 3> ray_b = Eigen::Matrix<double, 2, 3>::Zero();
  int count = 0;
};

std::vector<TwoMatches> Prepare(const PairBearings& bearings, double variance_a, double variance_b,
                                size_t first, size_t stride) {
  std::vector<TwoMatches> matches;
  matches.reserve((bearings.a.size() / stride + 2) / 2);
  for (size_t i = first; i < bearings.a.size(); i += stride) {
    if (matches.empty() || matches.back().count == 2) matches.emplace_back();
    TwoMatches& two = matches.back();
    two.Set(two.count, bearings.a[i], bearings.b[i], variance_a, variance_b);
  }
  return matches;
}

std::array<TwoMatches::Two, 3> AtBoth(const Vector3d& x) {
  using Two = TwoMatches::Two;
  return {Two::Constant(x[0]), Two::Constant(x[1]), Two::Constant(x[2])};
}

// The sum, or something beyond `bound` if the sum is.
double Cost(const std::vector<TwoMatches>& matches, double threshold, const Vector3d& tau,
            double bound = std::numeric_limits<double>::infinity()) {
  using Two = TwoMatches::Two;
  const double k_sq =
      threshold > 0.0 ? threshold * threshold : std::numeric_limits<double>::infinity();
  const std::array<Two, 3> x = AtBoth(tau);
  double cost = 0.0;
  for (const TwoMatches& two : matches) {
    const Two e = two.Form(0, x), e_sq = e * e, variance = two.Variance(x) + 1e-30;
    // The square of Robustify(e / sigma).
    const Two limit = k_sq * variance, inside = e_sq / variance,
              outside = k_sq * (2.0 - limit / e_sq);
    for (int k = 0; k < two.count; ++k) {
      cost += e_sq[k] <= limit[k] ? inside[k] : outside[k];
      if (cost > bound) return cost;
    }
  }
  return cost;
}

double CostOfPointsBehind(const std::vector<TwoMatches>& matches, double robust_threshold,
                          const Vector3d& tau) {
  // With a and b turned to one orientation, the depth along a has the sign of (tau x b).(a x b).
  using Two = TwoMatches::Two;
  int in_front = 0, behind = 0;
  for (const TwoMatches& two : matches) {
    const auto b = two.ray_b.array();
    const std::array<Two, 3> x = {tau[1] * b.col(2) - tau[2] * b.col(1),
                                  tau[2] * b.col(0) - tau[0] * b.col(2),
                                  tau[0] * b.col(1) - tau[1] * b.col(0)};
    const Two parallax = two.Form(0, x), variance = two.Variance(x);
    for (int k = 0; k < two.count; ++k) {
      if (parallax[k] * parallax[k] < 4.0 * variance[k]) continue;
      ++(parallax[k] > 0.0 ? in_front : behind);
    }
  }
  const double outlier = robust_threshold > 0.0 ? robust_threshold * robust_threshold : 9.0;
  return outlier * std::min(in_front, behind);
}

struct Refined {
  Vector3d tau;
  double cost;
};

Refined Refine(const std::vector<TwoMatches>& matches, double threshold, Vector3d tau) {
  double cost = Cost(matches, threshold, tau);
  double damping = 1e-3;
  for (int iteration = 0; iteration < 8; ++iteration) {
    const Eigen::Matrix<double, 3, 2> basis = TangentsOf(tau);
    const Vector3d u = basis.col(0), v = basis.col(1);
    Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
    Eigen::Vector2d g = Eigen::Vector2d::Zero();
    const std::array<TwoMatches::Two, 3> x = AtBoth(tau);
    std::array<TwoMatches::Two, 3> by_x;
    for (const TwoMatches& two : matches) {
      const TwoMatches::Two residuals = two.Residuals(x, &by_x);
      const TwoMatches::Two by_u = by_x[0] * u[0] + by_x[1] * u[1] + by_x[2] * u[2],
                            by_v = by_x[0] * v[0] + by_x[1] * v[1] + by_x[2] * v[2];
      for (int k = 0; k < two.count; ++k) {
        const RobustResidual robust = Robustify(residuals[k], threshold);
        const Eigen::Vector2d J = robust.derivative * Eigen::Vector2d(by_u[k], by_v[k]);
        H += J * J.transpose();
        g += J * robust.value;
      }
    }
    H.diagonal() *= 1.0 + damping;
    H.diagonal().array() += 1e-12;
    const Eigen::Vector2d step = -H.ldlt().solve(g);
    const Vector3d candidate = (tau + basis * step).normalized();
    const double candidate_cost = Cost(matches, threshold, candidate);
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
                          double robust_threshold, const Vector3d& tau) {
  return CostOfPointsBehind(Prepare(bearings, variance_a, variance_b, 0, 1), robust_threshold, tau);
}

DirectionEstimate FindDirection(const PairBearings& bearings, double variance_a, double variance_b,
                                double robust_threshold, size_t first, size_t step) {
  static const std::vector<Vector3d> grid = HalfSphere(120);
  std::vector<Vector3d> candidates;
  const size_t n = (bearings.a.size() + step - 1 - first) / step;
  const auto normal = [&](size_t i) -> Vector3d {
    return bearings.a[first + step * i].ray_ref.cross(bearings.b[first + step * i].ray_ref);
  };
  // Two matches give a direction: their cross products' cross product.
  for (size_t k = 0; k < 20 && n >= 2; ++k) {
    const size_t i = (k * 7919) % n, j = (i + 1 + (k * 104729) % (n - 1)) % n;
    const Vector3d tau = normal(i).cross(normal(j));
    if (tau.norm() > 1e-14) candidates.push_back(tau.normalized());
  }
  // After those: beside them, most of these have lost after a few matches.
  candidates.insert(candidates.end(), grid.begin(), grid.end());
  // Some 60 matches rank the candidates well enough; the refinement uses them all.
  const size_t stride = std::max<size_t>(1, n / 60);
  const std::vector<TwoMatches> all = Prepare(bearings, variance_a, variance_b, first, step),
                                fewer = stride > 1 ? Prepare(bearings, variance_a, variance_b,
                                                             first, step * stride)
                                                   : std::vector<TwoMatches>();
  const std::vector<TwoMatches>& some = stride > 1 ? fewer : all;
  std::vector<std::pair<double, size_t>> ranked;  // the best three
  for (size_t c = 0; c < candidates.size(); ++c) {
    const double bound =
        ranked.size() < 3 ? std::numeric_limits<double>::infinity() : ranked.back().first;
    double cost = Cost(some, robust_threshold, candidates[c], bound);
    if (cost >= bound) continue;
    cost += CostOfPointsBehind(some, robust_threshold, candidates[c]);
    ranked.insert(std::upper_bound(ranked.begin(), ranked.end(), std::make_pair(cost, c)),
                  {cost, c});
    if (ranked.size() > 3) ranked.pop_back();
  }
  DirectionEstimate best;
  for (size_t s = 0; s < ranked.size(); ++s) {
    const Refined refined = Refine(all, robust_threshold, candidates[ranked[s].second]);
    const double cost = refined.cost + CostOfPointsBehind(all, robust_threshold, refined.tau);
    if (s == 0 || cost < best.cost) {
      best.tau = refined.tau;
      best.cost = cost;
    }
  }
  best.residuals.reserve(n);
  const std::array<TwoMatches::Two, 3> x = AtBoth(best.tau);
  std::array<TwoMatches::Two, 3> by_x;
  for (const TwoMatches& two : all) {
    const TwoMatches::Two residuals = two.Residuals(x, &by_x);
    best.residuals.insert(best.residuals.end(), residuals.data(), residuals.data() + two.count);
  }
  return best;
}

}  // namespace camgyro
