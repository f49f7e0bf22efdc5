// The rotation-only residual: zero where only the camera turns, in sigmas, with right derivatives.
#include "factors/symmetric_transfer.h"

#include <gmock/gmock.h>

#include <cmath>
#include <memory>
#include <random>

#include "tests/factors/difference_check.h"
#include "tests/factors/pair_scene.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

VectorXd Residuals(PairScene* s) {
  const SymmetricTransfer factor(s->pair);
  VectorXd r = VectorXd::Constant(factor.num_residuals(), std::nan(""));  // must be overwritten
  EXPECT_TRUE(factor.Evaluate(s->Parameters(/*with_tau=*/false).data(), r.data(), nullptr));
  return r;
}

// The matches of the scene, with second observations where the rotation alone would put them.
PairScene RotationScene(uint64_t seed) {
  PairScene s = MakePairScene(seed);
  Eigen::Matrix3Xd rates(3, 16);
  rates << s.rate_groups[0], s.rate_groups[1], s.rate_groups[2];
  const RotationChain chain(s.pair->rate_times_s, rates);
  const Matrix3d R_gyro_cam = s.q_gyro_cam.toRotationMatrix();
  std::vector<Match> kept;
  for (Match match : s.pair->matches) {
    Bearing a;
    EXPECT_TRUE(EvaluateBearing(*s.pair->lens, s.lens, s.shutter, R_gyro_cam, chain,
                                s.pair->frame_a.stamp_s, s.pair->size_px.y(), match.px_a, &a));
    std::optional<Vector2d> px = match.px_b;
    for (int i = 0; i < 30 && px; ++i) {  // the row decides the time, the time decides the row
      const double t =
          RowTimeGyroS(s.pair->frame_b.stamp_s, s.shutter, px->y(), s.pair->size_px.y());
      const Matrix3d R_ref_cam = chain.At(t).R_ref_gyro * R_gyro_cam;
      px = s.pair->lens->Project(R_ref_cam.transpose() * a.ray_ref, s.lens);
    }
    if (!px) continue;
    match.px_b = *px;
    kept.push_back(match);
  }
  EXPECT_GT(kept.size(), 6u);
  s.pair->matches = kept;
  return s;
}

TEST(SymmetricTransfer, VanishesForPureRotation) {
  for (uint64_t seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE(seed);
    PairScene s = RotationScene(seed);
    EXPECT_LT(Residuals(&s).cwiseAbs().maxCoeff(), 1e-6);
    // A metre per second past points a few metres away is seen.
    PairScene moving = MakePairScene(seed);
    EXPECT_GT(Residuals(&moving).cwiseAbs().maxCoeff(), 1.0);
  }
}

// Global shutter, pinhole, still but for a jump of one rotation: the homography K R K^-1.
TEST(SymmetricTransfer, IsTheHomographyOfAGlobalShutter) {
  PairScene s = MakePairScene(3);
  s.lens = MakePinhole(500.0, {370.0, 245.0});
  s.pair->lens = &GetLens(DistortionModel::kNone);
  s.shutter[kReadout] = 0.0;
  s.pair->noise = MatchNoise::kSecondImage;
  const double sigma = s.pair->sigma;
  Eigen::Matrix3Xd rates(3, 16);
  rates << s.rate_groups[0], s.rate_groups[1], s.rate_groups[2];
  const RotationChain chain(s.pair->rate_times_s, rates);
  const Matrix3d R_gyro_cam = s.q_gyro_cam.toRotationMatrix();
  const auto R_ref_cam = [&](double stamp_s) -> Matrix3d {
    return chain.At(stamp_s + s.shutter[kDelay]).R_ref_gyro * R_gyro_cam;
  };
  Matrix3d K;
  K << 500, 0, 370, 0, 500, 245, 0, 0, 1;
  const Matrix3d H_b_a = K * R_ref_cam(s.pair->frame_b.stamp_s).transpose() *
                         R_ref_cam(s.pair->frame_a.stamp_s) * K.inverse();
  const VectorXd r = Residuals(&s);
  for (size_t i = 0; i < s.pair->matches.size(); ++i) {
    const Match& match = s.pair->matches[i];
    const Vector2d into_b = (H_b_a * match.px_a.homogeneous()).hnormalized();
    const Vector2d into_a = (H_b_a.inverse() * match.px_b.homogeneous()).hnormalized();
    Eigen::Vector4d expected;
    expected << match.px_b - into_b, match.px_a - into_a;
    expected /= std::sqrt(2.0) * sigma;  // noise in the second image only
    EXPECT_LT((r.segment<4>(4 * static_cast<Eigen::Index>(i)) - expected).norm(), 1e-8);
  }
}

// Noise of sigma in both images: the squares of a match's four residuals sum to 2 in the mean.
TEST(SymmetricTransfer, IsWhitened) {
  PairScene s = RotationScene(1);
  const std::vector<Match> exact = s.pair->matches;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, s.pair->sigma);
  const int kDraws = 400;
  double sum = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    for (size_t k = 0; k < exact.size(); ++k) {
      s.pair->matches[k].px_a = exact[k].px_a + Vector2d{normal(random), normal(random)};
      s.pair->matches[k].px_b = exact[k].px_b + Vector2d{normal(random), normal(random)};
    }
    sum += Residuals(&s).squaredNorm();
  }
  // chi-square with 2 degrees of freedom, standard deviation 2, of 400 x 12: to 0.03; the local
  // scale of the transfer, up to a few percent at the corners of a distorting lens, is neglected.
  EXPECT_NEAR(sum / kDraws / static_cast<double>(exact.size()), 2.0, 0.15);
}

// The same noise: each of the two has unit variance and knows nothing of the other. They are as
// long as the four, whatever the loss.
TEST(SymmetricTransfer, TwoResidualsOfAMatchAreIndependent) {
  PairScene s = RotationScene(1);
  const std::vector<Match> exact = s.pair->matches;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0.0, s.pair->sigma);
  const int kDraws = 400;
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    for (size_t k = 0; k < exact.size(); ++k) {
      s.pair->matches[k].px_a = exact[k].px_a + Vector2d{normal(random), normal(random)};
      s.pair->matches[k].px_b = exact[k].px_b + Vector2d{normal(random), normal(random)};
    }
    s.pair->robust_threshold = 0.0;
    const VectorXd four = Residuals(&s);
    s.pair->robust_threshold = 1.0;
    const std::vector<double> two =
        SymmetricTransfer(s.pair).IndependentResiduals(s.Parameters(/*with_tau=*/false).data());
    ASSERT_EQ(two.size(), 2 * exact.size());
    for (size_t k = 0; k < exact.size(); ++k) {
      const Vector2d r(two[2 * k], two[2 * k + 1]);
      EXPECT_NEAR(r.norm(), four.segment<4>(4 * static_cast<Eigen::Index>(k)).norm(), 1e-12);
      sum += r * r.transpose();
    }
  }
  // Known to sqrt(2 / n), 0.02, and 0.015 off the diagonal; and the local scale, as above.
  sum /= kDraws * static_cast<double>(exact.size());
  EXPECT_NEAR(sum(0, 0), 1.0, 0.08);
  EXPECT_NEAR(sum(1, 1), 1.0, 0.08);
  EXPECT_NEAR(sum(0, 1), 0.0, 0.06);
}

// The loss bends the length of the four residuals and keeps their direction.
TEST(SymmetricTransfer, LossTakesTheWholeMatch) {
  PairScene s = MakePairScene(2);
  const VectorXd plain = Residuals(&s);
  s.pair->robust_threshold = 1.5;
  const VectorXd robust = Residuals(&s);
  int bent = 0;
  for (Eigen::Index i = 0; i < plain.size(); i += 4) {
    const double length = plain.segment<4>(i).norm();
    // k sqrt(2 - k^2 / r^2) beyond k.
    const double expected =
        length <= 1.5 ? length : 1.5 * std::sqrt(2.0 - 1.5 * 1.5 / (length * length));
    EXPECT_LT((robust.segment<4>(i) - expected / length * plain.segment<4>(i)).norm(), 1e-9);
    if (length > 1.5) ++bent;
  }
  EXPECT_GT(bent, 0);
}

TEST(SymmetricTransfer, JacobianMatchesDifferences) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    for (const double threshold : {0.0, 2.0}) {
      SCOPED_TRACE(testing::Message() << seed << " " << threshold);
      PairScene s = MakePairScene(seed);
      Disturb(seed, &s);
      s.pair->robust_threshold = threshold;
      const SymmetricTransfer factor(s.pair);
      ExpectJacobiansMatchDifferences(factor, s.Parameters(/*with_tau=*/false), 1e-6);
    }
  }
}

TEST(SymmetricTransfer, RejectsWhatLeavesTheLens) {
  PairScene s = MakePairScene(1);
  for (auto& group : s.rate_groups) group.colwise() += Vector3d(60.0, 0.0, 0.0);  // 2 rad
  const SymmetricTransfer factor(s.pair);
  VectorXd r(factor.num_residuals());
  EXPECT_FALSE(factor.Evaluate(s.Parameters(/*with_tau=*/false).data(), r.data(), nullptr));
  EXPECT_TRUE(factor.IndependentResiduals(s.Parameters(/*with_tau=*/false).data()).empty());
}

}  // namespace
}  // namespace camgyro
