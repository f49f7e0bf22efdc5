#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <vector>

#include "factors/coplanarity_determinant.h"
#include "factors/coplanarity_plane.h"
#include "factors/robust.h"
#include "factors/rotation_manifold.h"
#include "tests/factors/difference_check.h"
#include "tests/factors/pair_scene.h"
#include "tests/factors/reference_plane.h"

namespace camgyro {
namespace {

constexpr int kReferenceLensSize = kP2 + 1;
using Jet = ceres::Jet<double, 71>;  // 8 + 2 + 4 + 3 + 6 + 48 parameters: the reference knows no kb

std::vector<double> Residuals(const ceres::CostFunction& factor,
                              const std::vector<double*>& parameters) {
  std::vector<double> residuals(static_cast<size_t>(factor.num_residuals()), std::nan(""));
  EXPECT_TRUE(factor.Evaluate(parameters.data(), residuals.data(), nullptr));
  return residuals;
}

// All parameters of the scene as jets, in the order of CoplanarityPlane.
std::vector<Jet> SceneJets(const PairScene& s) {
  std::vector<double> values(s.lens.data(), s.lens.data() + kReferenceLensSize);
  values.insert(values.end(), s.shutter.data(), s.shutter.data() + 2);
  values.insert(values.end(), s.q_gyro_cam.coeffs().data(), s.q_gyro_cam.coeffs().data() + 4);
  values.insert(values.end(), s.tau.data(), s.tau.data() + 3);
  values.insert(values.end(), s.bend.data(), s.bend.data() + 6);
  for (const auto& group : s.rate_groups) {
    values.insert(values.end(), group.data(), group.data() + group.size());
  }
  std::vector<Jet> jets;
  for (size_t i = 0; i < values.size(); ++i) jets.emplace_back(values[i], static_cast<int>(i));
  return jets;
}

// Compares a factor's residuals and tangent-space Jacobians with jets of the reference.
void ExpectMatchesReference(const ceres::CostFunction& factor, PairScene* s, bool with_tau,
                            const std::function<Jet(size_t, const std::vector<Jet>&)>& reference) {
  const auto parameters = s->Parameters(with_tau);
  const auto& sizes = factor.parameter_block_sizes();
  std::vector<std::vector<double>> storage;
  std::vector<double*> jacobians;
  for (const int size : sizes) {
    storage.emplace_back(static_cast<size_t>(size * factor.num_residuals()), std::nan(""));
  }
  for (auto& block : storage) jacobians.push_back(block.data());
  std::vector<double> residuals(static_cast<size_t>(factor.num_residuals()), std::nan(""));
  ASSERT_TRUE(factor.Evaluate(parameters.data(), residuals.data(), jacobians.data()));

  const std::vector<Jet> jets = SceneJets(*s);
  const Eigen::Matrix<double, 4, 3> plus =
      RotationManifold::PlusJacobianOf(s->q_gyro_cam.coeffs().data());
  for (size_t row = 0; row < residuals.size(); ++row) {
    const Jet expected = reference(row, jets);
    ASSERT_NEAR(residuals[row], expected.a, 1e-9 * (1 + std::abs(expected.a)));
    int offset = 0;
    for (size_t block = 0; block < sizes.size(); ++block) {
      const int size = block == 0 ? kReferenceLensSize : sizes[block];
      if (!with_tau && block == CoplanarityPlane::kTauBlock) offset += 9;  // tau and bend
      const Eigen::VectorXd want = expected.v.segment(offset, size);
      const Eigen::VectorXd have = Eigen::Map<const Eigen::VectorXd>(
          jacobians[block] + static_cast<int>(row) * sizes[block], size);
      const double scale = 1.0 + want.norm();
      if (block == 2) {  // the rotation's row has a meaning only in the tangent
        EXPECT_LT((plus.transpose() * (have - want)).norm() / scale, 1e-9) << "block 2";
      } else {
        EXPECT_LT((have - want).norm() / scale, 1e-9) << "block " << block;
      }
      offset += size;
    }
  }
}

TEST(CoplanarityPlane, IsZeroAtTheTruth) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    PairScene s = MakePairScene(seed);
    for (const double r : Residuals(CoplanarityPlane(s.pair), s.Parameters())) {
      EXPECT_LT(std::abs(r), 1e-8) << seed;
    }
  }
}

// A pixel moved by k sigma across its epipolar line, in the only noisy image, is a residual of k.
TEST(CoplanarityPlane, ResidualIsTheDistanceFromTheEpipolarLineInSigmas) {
  PairScene s = MakePairScene(3);
  s.pair->noise = MatchNoise::kSecondImage;
  const double step = 1e-4;
  for (size_t i = 0; i < s.pair->matches.size(); ++i) {
    SCOPED_TRACE(i);
    const Eigen::Vector2d px = s.pair->matches[i].px_b;
    Eigen::Vector2d slope;  // of the residual over the pixel [sigmas / px]
    for (int k = 0; k < 2; ++k) {
      s.pair->matches[i].px_b = px + step * Eigen::Vector2d::Unit(k);
      slope[k] = Residuals(CoplanarityPlane(s.pair), s.Parameters())[i] / step;
      s.pair->matches[i].px_b = px;
    }
    EXPECT_NEAR(slope.norm(), 1.0 / s.pair->sigma, 1e-3);
  }
}

TEST(CoplanarityPlane, NoiseHasUnitVarianceWhenBothImagesAreNoisy) {
  PairScene s = MakePairScene(5, 60);
  std::mt19937_64 generator(7);
  std::normal_distribution<double> noise(0.0, s.pair->sigma);
  const auto exact = s.pair->matches;
  double sum_sq = 0.0;
  int count = 0;
  for (int trial = 0; trial < 100; ++trial) {
    for (size_t i = 0; i < exact.size(); ++i) {
      s.pair->matches[i].px_a = exact[i].px_a + Eigen::Vector2d{noise(generator), noise(generator)};
      s.pair->matches[i].px_b = exact[i].px_b + Eigen::Vector2d{noise(generator), noise(generator)};
    }
    for (const double r : Residuals(CoplanarityPlane(s.pair), s.Parameters())) {
      sum_sq += r * r;
      ++count;
    }
  }
  // 6000 residuals: the mean square has a standard deviation of sqrt(2/6000) = 0.018.
  EXPECT_NEAR(sum_sq / count, 1.0, 0.06);
}

TEST(CoplanarityPlane, DoesNotDependOnTheSignOfTau) {
  PairScene s = MakePairScene(4);
  Disturb(4, &s);
  const auto r = Residuals(CoplanarityPlane(s.pair), s.Parameters());
  s.tau = -s.tau;
  s.bend = -s.bend;
  const auto r_flipped = Residuals(CoplanarityPlane(s.pair), s.Parameters());
  for (size_t i = 0; i < r.size(); ++i) EXPECT_NEAR(r[i], -r_flipped[i], 1e-12);
}

// On a path of constant jerk the direction of every match is known: that of the class comment.
TEST(CoplanarityPlane, DirectionFollowsAPathWithJerk) {
  const Eigen::Vector3d acceleration(3.0, -8.0, 5.0), jerk(-150.0, 100.0, 200.0);  // m/s^2, m/s^3
  for (uint64_t seed = 0; seed < 5; ++seed) {
    // Delay, gap and readout of the scene; the middle row is exposed half a readout later.
    const double gap_s = 1.0 / 30, readout_s = 0.025, middle_s = 0.006 + 0.5 * (gap_s + readout_s);
    PairScene s = MakePairScene(seed, 12, [&](double t) {
      const double u = t - middle_s;
      return Eigen::Vector3d(u * u / 2.0 * acceleration + u * u * u / 6.0 * jerk);
    });
    ASSERT_EQ(s.shutter, ShutterParameters(readout_s, 0.006));
    s.pair->readout_over_gap = readout_s / gap_s;
    const Eigen::Vector3d path = s.tau + gap_s * gap_s / 24.0 * jerk;  // velocity 1 m/s along tau
    s.tau = path.normalized();
    s.bend << acceleration * readout_s, jerk * (readout_s * gap_s / 12.0);
    s.bend /= path.norm();
    double without_jerk = 0.0;
    for (const double r : Residuals(CoplanarityPlane(s.pair), s.Parameters())) {
      EXPECT_LT(std::abs(r), 1e-8) << seed;
    }
    s.bend.tail<3>().setZero();
    for (const double r : Residuals(CoplanarityPlane(s.pair), s.Parameters())) {
      without_jerk = std::max(without_jerk, std::abs(r));
    }
    EXPECT_GT(without_jerk, 1e-2) << seed;
  }
}

TEST(CoplanarityPlane, JacobianMatchesAutodiffOfThePlainFormula) {
  for (uint64_t seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE(seed);
    PairScene s = MakePairScene(seed, 4);
    Disturb(seed, &s);
    if (seed % 2 == 1) s.pair->noise = MatchNoise::kSecondImage;
    ExpectMatchesReference(
        CoplanarityPlane(s.pair), &s, true, [&](size_t row, const std::vector<Jet>& x) {
          return reference::Plane<Jet>(*s.pair, s.pair->matches[row], x.data(), x.data() + 8,
                                       x.data() + 10, {x[14], x[15], x[16]}, {x[17], x[18], x[19]},
                                       {x[20], x[21], x[22]}, {x.begin() + 23, x.end()});
        });
  }
}

TEST(CoplanarityPlane, JacobianMatchesDifferencesWithTheLossOn) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    PairScene s = MakePairScene(seed);
    Disturb(seed, &s);
    s.pair->robust_threshold = 1.7;  // many of the disturbed residuals are beyond
    const CoplanarityPlane factor(s.pair);
    ExpectJacobiansMatchDifferences(factor, s.Parameters(), 1e-7);
  }
}

// An offset of a frame's time is an error of its stamp, which makes up for the other one.
TEST(CoplanarityPlane, TakesTheFramesOwnTimes) {
  for (uint64_t seed = 0; seed < 5; ++seed) {
    PairScene s = MakePairScene(seed);
    s.pair->own_times = true;
    s.pair->frame_a.stamp_s += 0.002;
    s.pair->frame_b.stamp_s -= 0.003;
    double off = 0.0;
    for (const double r : Residuals(CoplanarityPlane(s.pair), s.Parameters())) {
      off = std::max(off, std::abs(r));
    }
    EXPECT_GT(off, 0.1) << seed;
    s.times_s << -0.002, 0.003;
    for (const double r : Residuals(CoplanarityPlane(s.pair), s.Parameters())) {
      EXPECT_LT(std::abs(r), 1e-8) << seed;
    }
  }
}

TEST(CoplanarityPlane, JacobianByTheFramesOwnTimesMatchesDifferences) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    PairScene s = MakePairScene(seed);
    Disturb(seed, &s);
    s.pair->own_times = true;
    s.times_s << 0.002, -0.001;
    s.pair->robust_threshold = seed % 2 == 0 ? 0.0 : 1.7;
    if (seed % 3 == 1) {
      for (Match& match : s.pair->matches) match.noise_factor_b = {0.8, 0.1, 1.2};
    }
    ExpectJacobiansMatchDifferences(CoplanarityPlane(s.pair), s.Parameters(), 1e-6);
  }
}

// Solves that hold some blocks ask for the others alone, and get what they get with all of them.
TEST(CoplanarityPlane, JacobianByOneBlockIsThatOfAll) {
  PairScene s = MakePairScene(3);
  Disturb(3, &s);
  s.pair->own_times = true;
  const CoplanarityPlane factor(s.pair);
  const auto parameters = s.Parameters();
  const std::vector<int32_t>& sizes = factor.parameter_block_sizes();
  const auto by_blocks = [&](const std::function<bool(size_t)>& is_wanted) {
    std::vector<std::vector<double>> storage;
    std::vector<double*> jacobians;
    for (const int size : sizes) {
      storage.emplace_back(static_cast<size_t>(size * factor.num_residuals()), -1e9);
    }
    for (size_t i = 0; i < sizes.size(); ++i) {
      jacobians.push_back(is_wanted(i) ? storage[i].data() : nullptr);
    }
    std::vector<double> residuals(s.pair->matches.size());
    EXPECT_TRUE(factor.Evaluate(parameters.data(), residuals.data(), jacobians.data()));
    return storage;
  };
  const auto all = by_blocks([](size_t) { return true; });
  for (size_t one = 0; one < sizes.size(); ++one) {
    EXPECT_EQ(by_blocks([one](size_t i) { return i == one; })[one], all[one]) << one;
  }
}

// With lens and shutter held, residuals and their derivatives by what is the pair's own are the
// same.
TEST(CoplanarityPlane, HeldRaysAreThoseThatAreEvaluated) {
  PairScene s = MakePairScene(5);
  Disturb(5, &s);
  s.pair->own_times = true;
  s.times_s << 0.002, -0.003;
  for (Match& match : s.pair->matches) match.noise_factor_b = {0.8, 0.1, 1.2};
  const CoplanarityPlane factor(s.pair);
  const auto evaluate = [&] {
    const auto n = static_cast<Eigen::Index>(s.pair->matches.size());
    Eigen::MatrixXd all(n, 6);  // residuals; by tau, and by the two times
    Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> by_tau(n, 3);
    std::vector<double*> jacobians(factor.parameter_block_sizes().size(), nullptr);
    jacobians[3] = by_tau.data();
    jacobians[5] = all.col(4).data();
    jacobians[6] = all.col(5).data();
    EXPECT_TRUE(factor.Evaluate(s.Parameters().data(), all.data(), jacobians.data()));
    all.middleCols<3>(1) = by_tau;
    return all;
  };
  const Eigen::MatrixXd evaluated = evaluate();
  HoldRays(s.lens.data(), s.shutter.data(), nullptr, s.pair.get());
  ASSERT_EQ(s.pair->rays_a.size(), s.pair->matches.size());
  EXPECT_TRUE(evaluate().isApprox(evaluated, 1e-12));
  s.times_s << 0.004, 0.001;  // they follow the frames' times
  const Eigen::MatrixXd held = evaluate();
  EXPECT_FALSE(held.isApprox(evaluated, 1e-3));
  s.lens[kK1] = -3.0;  // to where it lacks rays
  HoldRays(s.lens.data(), s.shutter.data(), nullptr, s.pair.get());
  EXPECT_TRUE(s.pair->rays_a.empty() && s.pair->rays_b.empty());
}

TEST(CoplanarityPlane, RejectsAStepToWhereALensHasNoRay) {
  PairScene s = MakePairScene(6);
  s.lens[kK1] = -3.0;
  std::vector<double> residuals(s.pair->matches.size());
  EXPECT_FALSE(CoplanarityPlane(s.pair).Evaluate(s.Parameters().data(), residuals.data(), nullptr));
}

TEST(CoplanarityDeterminant, IsZeroAtTheTruth) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    PairScene s = MakePairScene(seed);
    const CoplanarityDeterminant factor(s.pair, RandomTriplets(12, 30, seed));
    for (const double r : Residuals(factor, s.Parameters(false))) {
      EXPECT_LT(std::abs(r), 1e-6) << seed;
    }
  }
}

TEST(CoplanarityDeterminant, NoiseHasUnitVariance) {
  PairScene s = MakePairScene(8, 60);
  s.pair->sigma = 0.05;  // first-order propagation: noise small against parallax
  std::mt19937_64 generator(9);
  std::normal_distribution<double> noise(0.0, s.pair->sigma);
  const auto exact = s.pair->matches;
  double sum_sq = 0.0;
  int count = 0;
  for (int trial = 0; trial < 100; ++trial) {
    for (size_t i = 0; i < exact.size(); ++i) {
      s.pair->matches[i].px_a = exact[i].px_a + Eigen::Vector2d{noise(generator), noise(generator)};
      s.pair->matches[i].px_b = exact[i].px_b + Eigen::Vector2d{noise(generator), noise(generator)};
    }
    const CoplanarityDeterminant factor(s.pair, RandomTriplets(60, 60, trial));
    for (const double r : Residuals(factor, s.Parameters(false))) {
      sum_sq += r * r;
      ++count;
    }
  }
  EXPECT_NEAR(sum_sq / count, 1.0, 0.1);  // triplets share matches: fewer than 6000 independent
}

TEST(CoplanarityDeterminant, JacobianMatchesAutodiffOfThePlainFormula) {
  for (uint64_t seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE(seed);
    PairScene s = MakePairScene(seed, 6);
    Disturb(seed, &s);
    if (seed % 2 == 1) s.pair->noise = MatchNoise::kSecondImage;
    const std::vector<CoplanarityDeterminant::Triplet> triplets = {{0, 1, 2}, {5, 3, 1}};
    ExpectMatchesReference(CoplanarityDeterminant(s.pair, triplets), &s, false,
                           [&](size_t row, const std::vector<Jet>& x) {
                             const Match* matches[3];
                             for (size_t i = 0; i < 3; ++i) {
                               matches[i] = &s.pair->matches[static_cast<size_t>(triplets[row][i])];
                             }
                             return reference::Determinant<Jet>(*s.pair, matches, x.data(),
                                                                x.data() + 8, x.data() + 10,
                                                                {x.begin() + 23, x.end()});
                           });
  }
}

TEST(CoplanarityDeterminant, TripletsAreRepeatableAndOfDifferentMatches) {
  const auto triplets = RandomTriplets(5, 200, 11);
  EXPECT_EQ(triplets, RandomTriplets(5, 200, 11));
  EXPECT_NE(triplets, RandomTriplets(5, 200, 12));
  for (const auto& t : triplets) {
    EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
    EXPECT_THAT(t, ::testing::Each(::testing::AllOf(::testing::Ge(0), ::testing::Lt(5))));
  }
}

TEST(Robustify, KeepsInliersAndIsContinuousWithItsDerivative) {
  EXPECT_EQ(Robustify(1.5, 2.0).value, 1.5);
  EXPECT_EQ(Robustify(-100.0, 0.0).value, -100.0);
  EXPECT_NEAR(Robustify(2.0 + 1e-9, 2.0).value, 2.0, 1e-8);
  EXPECT_NEAR(Robustify(2.0 + 1e-9, 2.0).derivative, 1.0, 1e-8);
  // rho(r^2) = k^2 (2 - k^2/r^2): at r = -4, k = 2: 4 * (2 - 1/4) = 7.
  const RobustResidual far = Robustify(-4.0, 2.0);
  EXPECT_NEAR(far.value, -std::sqrt(7.0), 1e-12);
  const double h = 1e-6;
  EXPECT_NEAR(far.derivative,
              (Robustify(-4.0 + h, 2.0).value - Robustify(-4.0 - h, 2.0).value) / (2 * h), 1e-8);
  EXPECT_LT(std::abs(Robustify(1e9, 2.0).value), 2.0 * std::sqrt(2.0) + 1e-9);
}

// Corrections of three samples each: the residuals of rates that are corrected so, and derivatives.
TEST(CoplanarityPlane, TakesCorrectionsOfSeveralRatesAtOnce) {
  PairScene s = MakePairScene(11);
  Disturb(11, &s);
  PairScene coarse = s;
  coarse.pair = std::make_shared<PairMeasurement>(*s.pair);
  coarse.pair->rate_step = 3;
  coarse.pair->rate_base.resize(3, 16);
  int column = 0;
  for (size_t g = 0; g < s.rate_groups.size(); ++g) {
    const int size = s.pair->rate_group_sizes[g];
    coarse.rate_groups[g] = 0.02 * Eigen::Matrix3Xd::Random(3, coarse.pair->num_rate_values(g));
    for (int i = 0; i < size; ++i) {
      coarse.pair->rate_base.col(column++) =
          s.rate_groups[g].col(i) - coarse.rate_groups[g].col(i / 3);
    }
  }
  EXPECT_EQ(coarse.pair->num_rate_values(1), 3);  // 7 samples
  const auto fine = Residuals(CoplanarityPlane(s.pair), s.Parameters());
  const CoplanarityPlane factor(coarse.pair);
  const auto same = Residuals(factor, coarse.Parameters());
  for (size_t i = 0; i < fine.size(); ++i) EXPECT_NEAR(fine[i], same[i], 1e-9);
  ExpectJacobiansMatchDifferences(factor, coarse.Parameters(), 1e-6);
}

}  // namespace
}  // namespace camgyro
