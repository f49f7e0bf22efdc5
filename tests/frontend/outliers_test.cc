#include "frontend/outliers.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/so3.h"
#include "tests/frontend/two_view_scene.h"

namespace camgyro {
namespace {

std::vector<RotatedMatch> Rotate(const FramePair& pair, const TwoViewScene& scene,
                                 const Eigen::Quaterniond& q_a_b) {
  const Lens& lens = GetLens(DistortionModel::kNone);
  const Eigen::Matrix3d R_a_b = q_a_b.toRotationMatrix();
  std::vector<RotatedMatch> rotated;
  for (const Match& match : pair.matches) {
    RayJet a, b;
    EXPECT_TRUE(lens.Unproject(match.px_a, scene.lens, &a));
    EXPECT_TRUE(lens.Unproject(match.px_b, scene.lens, &b));
    rotated.push_back({a.ray, R_a_b * b.ray, a.J_ray_px, R_a_b * b.J_ray_px});
  }
  return rotated;
}

TwoViewScene WalkingScene() {
  TwoViewScene scene;
  scene.q_a_b = Exp(Eigen::Vector3d(0.02, -0.03, 0.015));
  scene.p_a = Eigen::Vector3d(0.08, -0.02, 0.05);
  scene.noise_px = 0.3;
  return scene;
}

struct Score {
  double kept_good;  // fraction of the right matches
  double found_bad;  // fraction of the wrong ones
};

Score ScoreOf(const std::vector<bool>& inliers, const std::vector<bool>& spoiled) {
  double good = 0.0, bad = 0.0, kept = 0.0, found = 0.0;
  for (size_t i = 0; i < inliers.size(); ++i) {
    (spoiled[i] ? bad : good) += 1.0;
    if (spoiled[i] && !inliers[i]) found += 1.0;
    if (!spoiled[i] && inliers[i]) kept += 1.0;
  }
  return {kept / good, bad > 0.0 ? found / bad : 1.0};
}

TEST(CoplanarityNormal, DistanceIsThePixelOffsetFromTheEpipolarLine) {
  // Pinhole of 500 px looking along z, sideways translation: epipolar lines are rows. A second
  // image 0.8 px off its row is 0.8 px away, whatever the parallax; noise in both images halves the
  // square of it.
  TwoViewScene scene;
  scene.lens = MakePinhole(500.0, {320.0, 240.0});
  for (const double parallax_px : {0.0, 3.0, 50.0}) {
    FramePair pair;
    pair.matches.push_back({{300.0, 200.0}, {300.0 - parallax_px, 200.8}});
    const RotatedMatch match = Rotate(pair, scene, Eigen::Quaterniond::Identity())[0];
    const Eigen::Vector3d tau = Eigen::Vector3d::UnitX();
    EXPECT_NEAR(MakeCoplanarityNormal(match, MatchNoise::kSecondImage).SquaredDistance(tau),
                0.8 * 0.8, 1e-5);  // the guard of the epipole takes 1e-6 of it
    EXPECT_NEAR(MakeCoplanarityNormal(match, MatchNoise::kBothImages).SquaredDistance(tau),
                0.8 * 0.8 / 2.0, 2e-3);  // to first order: the lines of a and b differ by 0.8 px
  }
}

TEST(TranslationConsensus, FindsDirectionAndOutliersDespiteParallax) {
  const TwoViewScene scene = WalkingScene();
  double worst_deg = 0.0, kept = 0.0, found = 0.0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    FramePair pair = scene.Make(120, seed);
    const std::vector<bool> spoiled = SpoilMatches(4, seed, &pair);
    TranslationConsensusOptions options;
    options.sigma_px = 0.3;
    options.noise = MatchNoise::kBothImages;
    const TranslationConsensus consensus =
        FindTranslationConsensus(Rotate(pair, scene, scene.q_a_b), options);
    ASSERT_EQ(consensus.inliers.size(), pair.matches.size());
    EXPECT_NEAR(consensus.tau.norm(), 1.0, 1e-12);
    worst_deg =
        std::max(worst_deg, 180.0 / M_PI * std::acos(consensus.tau.dot(scene.p_a.normalized())));
    const Score score = ScoreOf(consensus.inliers, spoiled);
    kept += score.kept_good / 20.0;
    found += score.found_bad / 20.0;
  }
  EXPECT_LT(worst_deg, 5.0);  // including the sign
  EXPECT_GT(kept, 0.98);      // 3 sigma on two sides and one: 0.996 expected
  // A displacement of 15-40 px in any direction is within 3 x 0.42 px of the line for some 3 %, and
  // half of those point forwards.
  EXPECT_GT(found, 0.95);
}

TEST(TranslationConsensus, KeepsEverythingWithoutParallax) {
  TwoViewScene scene = WalkingScene();
  scene.p_a.setZero();
  double kept = 0.0, found = 0.0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    FramePair pair = scene.Make(100, seed);
    TranslationConsensusOptions options;
    options.sigma_px = 0.3;
    options.noise = MatchNoise::kBothImages;
    const std::vector<bool> none(pair.matches.size(), false);
    kept +=
        ScoreOf(FindTranslationConsensus(Rotate(pair, scene, scene.q_a_b), options).inliers, none)
            .kept_good /
        20.0;
    const std::vector<bool> spoiled = SpoilMatches(5, seed, &pair);
    found += ScoreOf(FindTranslationConsensus(Rotate(pair, scene, scene.q_a_b), options).inliers,
                     spoiled)
                 .found_bad /
             20.0;
  }
  EXPECT_GT(kept, 0.98);
  EXPECT_GT(found, 0.8);  // the direction is free, and takes a wrong match or two with it
}

TEST(TranslationConsensus, ExactPureRotationIsAllInliers) {
  TwoViewScene scene = WalkingScene();
  scene.p_a.setZero();
  scene.noise_px = 0.0;
  const FramePair pair = scene.Make(50, 3);
  const TranslationConsensus consensus = FindTranslationConsensus(Rotate(pair, scene, scene.q_a_b));
  EXPECT_EQ(consensus.num_inliers, 50);
  EXPECT_TRUE(consensus.tau.allFinite());

  // Nothing at all moved: every normal is exactly zero.
  FramePair still = pair;
  for (Match& match : still.matches) match.px_b = match.px_a;
  const TranslationConsensus at_rest =
      FindTranslationConsensus(Rotate(still, scene, Eigen::Quaterniond::Identity()));
  EXPECT_EQ(at_rest.num_inliers, 50);
  EXPECT_TRUE(at_rest.tau.allFinite());
}

TEST(TranslationConsensus, RejectsPointsBehindTheCamera) {
  const TwoViewScene scene = WalkingScene();
  FramePair pair = scene.Make(100, 5);
  // Mirror some displacements along their epipolar line: still coplanar, on the wrong side.
  const Lens& lens = GetLens(DistortionModel::kNone);
  int mirrored = 0;
  for (size_t i = 0; i < 10; ++i) {
    RayJet a;
    ASSERT_TRUE(lens.Unproject(pair.matches[i].px_a, scene.lens, &a));
    const auto at_infinity = lens.Project(scene.q_a_b.conjugate() * a.ray, scene.lens);
    if ((pair.matches[i].px_b - *at_infinity).norm() < 4.0) continue;
    pair.matches[i].px_b = 2.0 * *at_infinity - pair.matches[i].px_b;
    ++mirrored;
  }
  ASSERT_GT(mirrored, 3);
  TranslationConsensusOptions options;
  options.sigma_px = 0.3;
  options.noise = MatchNoise::kBothImages;
  const TranslationConsensus consensus =
      FindTranslationConsensus(Rotate(pair, scene, scene.q_a_b), options);
  EXPECT_NEAR(consensus.num_inliers, 100 - mirrored, 3);
}

TEST(TranslationConsensus, FewMatchesCannotDisagree) {
  const TwoViewScene scene = WalkingScene();
  for (int count = 0; count < 3; ++count) {
    const TranslationConsensus consensus =
        FindTranslationConsensus(Rotate(scene.Make(count, 6), scene, scene.q_a_b));
    EXPECT_EQ(consensus.num_inliers, count);
    EXPECT_EQ(consensus.inliers.size(), static_cast<size_t>(count));
  }
}

TEST(TranslationConsensus, IsRepeatable) {
  const TwoViewScene scene = WalkingScene();
  FramePair pair = scene.Make(100, 7);
  SpoilMatches(3, 7, &pair);
  const auto rotated = Rotate(pair, scene, scene.q_a_b);
  const TranslationConsensus one = FindTranslationConsensus(rotated);
  const TranslationConsensus two = FindTranslationConsensus(rotated);
  EXPECT_EQ(one.tau, two.tau);
  EXPECT_EQ(one.inliers, two.inliers);
}

TEST(BinHomography, RemovesWrongMatchesOfARotation) {
  TwoViewScene scene = WalkingScene();
  scene.p_a.setZero();
  FramePair pair = scene.Make(200, 8);
  const FramePair clean = pair;
  const std::vector<bool> spoiled = SpoilMatches(5, 8, &pair);
  const int removed = RejectByBinHomography(pair, TwoViewScene::kWidth, TwoViewScene::kHeight);
  EXPECT_EQ(removed + static_cast<int>(pair.matches.size()), 200);
  EXPECT_NEAR(removed, 40, 2);  // 15 px and more against a threshold of 1.5 px and noise of 0.42
  // What is left is what was never spoiled, in its order.
  size_t k = 0;
  for (const Match& match : pair.matches) {
    while (k < clean.matches.size() && clean.matches[k].px_a != match.px_a) ++k;
    ASSERT_LT(k, clean.matches.size());
    EXPECT_FALSE(spoiled[k]);
  }
}

TEST(BinHomography, TakesParallaxForOutliersWhereTheConsensusDoesNot) {
  TwoViewScene scene = WalkingScene();
  scene.p_a *= 3.0;
  FramePair pair = scene.Make(200, 9);
  TranslationConsensusOptions options;
  options.noise = MatchNoise::kBothImages;
  options.sigma_px = 0.3;
  EXPECT_GT(FindTranslationConsensus(Rotate(pair, scene, scene.q_a_b), options).num_inliers, 190);
  EXPECT_GT(RejectByBinHomography(pair, TwoViewScene::kWidth, TwoViewScene::kHeight), 60);
}

TEST(BinHomography, JudgesAThinBinByTheWholePicture) {
  TwoViewScene scene = WalkingScene();
  scene.p_a.setZero();
  FramePair pair = scene.Make(300, 10);
  // Leave 3 matches of the lower right bin, one of them wrong.
  std::vector<Match> kept, corner;
  for (const Match& match : pair.matches) {
    const bool lower_right = match.px_a.x() > 320 && match.px_a.y() > 240;
    (lower_right ? corner : kept).push_back(match);
  }
  corner.resize(3);
  corner[1].px_b += Eigen::Vector2d(20.0, 0.0);
  pair.matches = kept;
  pair.matches.insert(pair.matches.end(), corner.begin(), corner.end());
  RejectByBinHomography(pair, TwoViewScene::kWidth, TwoViewScene::kHeight);
  ASSERT_GE(pair.matches.size(), 2u);
  EXPECT_EQ(pair.matches.back().px_a, corner[2].px_a);
  EXPECT_EQ(pair.matches[pair.matches.size() - 2].px_a, corner[0].px_a);
}

TEST(BinHomography, LeavesTooFewToJudge) {
  TwoViewScene scene = WalkingScene();
  FramePair pair = scene.Make(6, 11);
  SpoilMatches(2, 11, &pair);
  EXPECT_EQ(RejectByBinHomography(pair, TwoViewScene::kWidth, TwoViewScene::kHeight), 0);
  EXPECT_EQ(pair.matches.size(), 6u);
}

}  // namespace
}  // namespace camgyro
