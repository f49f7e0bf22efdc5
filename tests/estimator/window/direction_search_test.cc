// The inner minimisation: translation directions with noise, wrong matches and ambiguity.
#include "estimator/window/direction_search.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/rotation_chain.h"
#include "factors/coplanarity_plane.h"
#include "factors/robust.h"
#include "tests/factors/pair_scene.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

PairBearings BearingsOf(PairScene* s) {
  const std::vector<double*> parameters = s->Parameters(/*with_tau=*/false);
  const RotationChain chain(s->pair->rate_times_s,
                            GatherRates(s->pair->rate_group_sizes, parameters.data() + 3));
  PairBearings bearings;
  EXPECT_TRUE(EvaluatePairBearings(*s->pair, chain, parameters[0], parameters[1], parameters[2],
                                   nullptr,
                                   /*derivatives=*/false, &bearings));
  return bearings;
}

double AngleDeg(const Vector3d& a, const Vector3d& b) {
  return std::acos(std::min(1.0, std::abs(a.normalized().dot(b.normalized())))) * 180.0 / M_PI;
}

TEST(FindDirection, IsExactWithoutNoise) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    PairScene s = MakePairScene(seed, 40);
    const DirectionEstimate found = FindDirection(BearingsOf(&s), 0.09, 0.09, 2.5);
    EXPECT_LT(AngleDeg(found.tau, s.tau), 1e-2);
    EXPECT_NEAR(found.tau.norm(), 1.0, 1e-12);
    EXPECT_LT(found.cost, 1e-4);
    ASSERT_EQ(found.residuals.size(), 40u);
  }
}

// Robust cost and information (2 x 2, in a basis of the tangent) of one direction.
struct CostAndInformation {
  double cost = 0.0;
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
};
CostAndInformation At(const PairBearings& bearings, double variance, const Vector3d& tau) {
  Eigen::Matrix<double, 3, 2> basis;
  basis << tau.unitOrthogonal(), tau.cross(tau.unitOrthogonal());
  CostAndInformation sum;
  for (size_t i = 0; i < bearings.a.size(); ++i) {
    const PlaneResidual r =
        EvaluatePlaneResidual(bearings.a[i].ray_ref, bearings.a[i].J_ray_px, bearings.b[i].ray_ref,
                              bearings.b[i].J_ray_px, tau, variance, variance);
    const RobustResidual robust = Robustify(r.value, 2.5);
    const Eigen::Vector2d J = robust.derivative * (basis.transpose() * r.by_tau);
    sum.cost += robust.value * robust.value;
    if (std::abs(r.value) <= 2.5) sum.information += J * J.transpose();
  }
  sum.cost += CostOfPointsBehind(bearings, variance, variance, 2.5, tau);
  return sum;
}

struct Trial {
  double error_deg, sigma_deg, excess_over_truth, excess_over_cover;
};
std::vector<Trial> Trials(int count, double wrong) {
  std::vector<Trial> trials;
  for (uint64_t seed = 0; seed < static_cast<uint64_t>(count); ++seed) {
    PairScene s = MakePairScene(seed, 80);
    std::mt19937_64 generator(seed + 77);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const auto num_wrong = static_cast<size_t>(std::lround(80 * wrong));
    for (size_t i = 0; i < s.pair->matches.size(); ++i) {
      Match& match = s.pair->matches[i];
      // One draw after the other: in which order arguments are evaluated is the compiler's choice.
      for (Eigen::Vector2d* px : {&match.px_a, &match.px_b}) {
        px->y() += 0.3 * normal(generator);
        px->x() += 0.3 * normal(generator);
      }
      if (i < num_wrong) {
        const double angle = 2.0 * M_PI * uniform(generator);
        match.px_b +=
            (10.0 + 20.0 * uniform(generator)) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      }
    }
    const PairBearings bearings = BearingsOf(&s);
    const double variance = 0.09;
    const DirectionEstimate found = FindDirection(bearings, variance, variance, 2.5);
    const CostAndInformation truth = At(bearings, variance, s.tau);
    double cover = truth.cost;
    for (int k = 0; k < 3000; ++k) {
      Vector3d tau;
      for (const int axis : {2, 1, 0}) tau[axis] = normal(generator);
      cover = std::min(cover, At(bearings, variance, tau.normalized()).cost);
    }
    trials.push_back({AngleDeg(found.tau, s.tau),
                      std::sqrt(truth.information.inverse().trace()) * 180.0 / M_PI,
                      found.cost - truth.cost, found.cost - cover});
  }
  return trials;
}

TEST(FindDirection, FindsTheMinimumAndItIsWhereTheNoiseAllows) {
  // A parallax of a few pixels and 0.3 px of noise: some 3 deg.
  for (const Trial& trial : Trials(40, 0.0)) {
    EXPECT_LT(trial.error_deg, 4.0 * trial.sigma_deg);
    EXPECT_LT(trial.excess_over_truth, 1.0);
    EXPECT_LT(trial.excess_over_cover, 1.0);
  }
}

// The robust cost still grows with the logarithm of a gross error, so that wrong matches move its
// minimum, to twice the error here; and one scene in ten ends in another minimum.
TEST(FindDirection, WithEveryFifthMatchWrongMostDirectionsAreStillUsable) {
  const std::vector<Trial> trials = Trials(40, 0.2);
  int found = 0, usable = 0;
  for (const Trial& trial : trials) {
    found += trial.excess_over_truth < 1.0 ? 1 : 0;
    usable += trial.error_deg < 20.0 ? 1 : 0;
  }
  EXPECT_GE(found, 36);
  EXPECT_GE(usable, 34);
}

TEST(FindDirection, IsTheSameTwice) {
  PairScene s = MakePairScene(4, 50);
  Disturb(4, &s);
  const PairBearings bearings = BearingsOf(&s);
  const DirectionEstimate a = FindDirection(bearings, 0.0, 0.25, 2.5);
  const DirectionEstimate b = FindDirection(bearings, 0.0, 0.25, 2.5);
  EXPECT_EQ(a.tau, b.tau);
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.residuals, b.residuals);
}

TEST(CostOfPointsBehind, CountsTheMinorityForEitherSign) {
  PairScene s = MakePairScene(2, 60);
  EXPECT_EQ(CostOfPointsBehind(BearingsOf(&s), 0.01, 0.01, 2.5, s.tau), 0.0);
  EXPECT_EQ(CostOfPointsBehind(BearingsOf(&s), 0.01, 0.01, 2.5, -s.tau), 0.0);
  // Exchanging the two rays of a match puts its point behind the camera, on the same plane.
  PairBearings bearings = BearingsOf(&s);
  for (size_t i = 0; i < 6; ++i) std::swap(bearings.a[i], bearings.b[i]);
  const double cost = CostOfPointsBehind(bearings, 1e-6, 1e-6, 2.5, s.tau);
  EXPECT_DOUBLE_EQ(cost, 6 * 2.5 * 2.5);
  EXPECT_EQ(CostOfPointsBehind(bearings, 1e-6, 1e-6, 2.5, -s.tau), cost);
  // Parallax below the noise says nothing.
  EXPECT_EQ(CostOfPointsBehind(bearings, 1e6, 1e6, 2.5, s.tau), 0.0);
}

// Points in one plane with the path: every direction in that plane has zero residuals. Only those
// that leave all points in front are possible.
TEST(FindDirection, PrefersPointsInFront) {
  PairBearings bearings;
  Eigen::Matrix<double, 3, 2> J;
  J << 1.0 / 500, 0.0, 0.0, 1.0 / 500, 0.0, 0.0;
  for (int i = 0; i < 40; ++i) {
    const double x = -0.6 + 1.2 * i / 39, depth = 2.0 + (i * 7) % 11;
    Bearing &a = bearings.a.emplace_back(), &b = bearings.b.emplace_back();
    a.ray_ref = Vector3d(x, 0.0, 1.0);
    b.ray_ref = Vector3d(x - 0.1 / depth, 0.0, 1.0);  // the camera moves 0.1 m along x
    a.J_ray_px = b.J_ray_px = J;
  }
  const double variance = 0.09;
  EXPECT_GE(CostOfPointsBehind(bearings, variance, variance, 2.5, Vector3d::UnitZ()), 10 * 6.25);
  EXPECT_EQ(CostOfPointsBehind(bearings, variance, variance, 2.5, Vector3d::UnitX()), 0.0);
  const DirectionEstimate found = FindDirection(bearings, variance, variance, 2.5);
  EXPECT_LT(std::abs(found.tau.y()), 0.05);
  EXPECT_EQ(CostOfPointsBehind(bearings, variance, variance, 2.5, found.tau), 0.0);
  // A path through the field of view would have points on both sides of it.
  EXPECT_GT(std::abs(found.tau.x() / found.tau.z()), 0.55);
}

}  // namespace
}  // namespace camgyro
