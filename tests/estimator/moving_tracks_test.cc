#include "estimator/moving_tracks.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "estimator/window/pair_graph.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using testing::IsEmpty;

struct WalkScene {
  simulation::Simulated simulated;
  EstimationInput input;
  PairGraphOptions options;
  std::set<int64_t> moving;  // truly
};

WalkScene Walk(const simulation::SceneOptions& scene_options, double outlier_fraction,
               double duration_s) {
  simulation::Scenario scenario = ShortScenario(duration_s);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.scene = scene_options;
  scenario.tracks.count = 100;
  scenario.tracks.noise_px = 0.5;
  scenario.tracks.outlier_fraction = outlier_fraction;
  WalkScene scene;
  scene.simulated = *simulation::SimulateTracks(scenario);
  const Recording& recording = scene.simulated.recording;
  scene.input = MakeEstimationInput(recording, SelectPairs(recording));
  for (size_t f = 0; f < recording.tracks.size(); ++f) {
    for (size_t i = 0; i < recording.tracks[f].size(); ++i) {
      if (scene.simulated.points[f][i].moving) scene.moving.insert(recording.tracks[f][i].track_id);
    }
  }
  return scene;
}

std::vector<TrackLean> LeansOf(const WalkScene& scene) {
  return LeanOfTracks(scene.input, scene.input.pairs, scene.simulated.truth, 0.5, scene.options);
}

double ShareBeyond(const std::vector<TrackLean>& leans, double p) {
  const auto beyond = [&](const TrackLean& lean) { return lean.chi2 > -2.0 * std::log(p); };
  return static_cast<double>(std::count_if(leans.begin(), leans.end(), beyond)) /
         static_cast<double>(leans.size());
}

// Without wrong matches and with 28 % of them: of points at rest as many lean as by chance, and no
// more.
TEST(LeanOfTracks, IsChiSquareOfPointsAtRest) {
  for (const double outliers : {0.0, 0.15}) {
    SCOPED_TRACE(outliers);
    const std::vector<TrackLean> leans = LeansOf(Walk({}, outliers, 20.0));
    ASSERT_GT(leans.size(), 400u);
    EXPECT_NEAR(ShareBeyond(leans, 0.5), 0.5, 0.06);
    EXPECT_NEAR(ShareBeyond(leans, 0.1), 0.1, 0.04);
    EXPECT_LT(ShareBeyond(leans, 0.01), 0.016);
    EXPECT_THAT(MovingTracks(leans), IsEmpty());
  }
}

TEST(MovingTracks, AreThoseThatMove) {
  simulation::SceneOptions options;
  options.moving_fraction = 0.3;
  const WalkScene scene = Walk(options, 0.0, 10.0);
  const std::vector<TrackLean> leans = LeansOf(scene);
  const std::vector<int64_t> named = MovingTracks(leans);
  ASSERT_TRUE(std::is_sorted(named.begin(), named.end()));
  const auto right = static_cast<double>(std::count_if(
      named.begin(), named.end(), [&](int64_t id) { return scene.moving.count(id) > 0; }));
  EXPECT_GT(right, 0.93 * static_cast<double>(named.size()));
  const auto moves =
      static_cast<double>(std::count_if(leans.begin(), leans.end(), [&](const TrackLean& lean) {
        return scene.moving.count(lean.track_id) > 0;
      }));
  EXPECT_GT(right, 0.6 * moves);  // the others go along their epipolar lines
}

// Stamps that are up to 5 ms off, as a fit knows them: what moves is what moves without that.
TEST(LeanOfTracks, IsAtTheTimesThatAFitKnows) {
  simulation::SceneOptions options;
  options.moving_fraction = 0.3;
  WalkScene scene = Walk(options, 0.0, 6.0);
  const std::vector<int64_t> moving = MovingTracks(LeansOf(scene));
  ASSERT_GT(moving.size(), 20u);
  Calibration& fit = scene.simulated.truth;
  fit.effects = std::make_shared<const EffectSet>(
      MakeEffects("frame_stamp_jitter", MakeEffectSetup(scene.simulated.recording, fit)).value());
  fit.effect_values = Eigen::VectorXd::Constant(1, 3e-3);
  const auto late_s = [](int frame) { return 1e-3 * (frame * 7919 % 11 - 5); };
  PairLatents latents;
  for (TimedPair& pair : scene.input.pairs) {
    pair.time_a_s += late_s(pair.frame_a);
    pair.time_b_s += late_s(pair.frame_b);
    EXPECT_FALSE(latents.TimesOf(pair));  // of its second frame, it does not know
    latents.frame_times_s[PairGraph::FrameNumber(pair.time_a_s)] = -late_s(pair.frame_a);
    latents.frame_times_s[PairGraph::FrameNumber(pair.time_b_s)] = -late_s(pair.frame_b);
  }
  EXPECT_EQ(
      MovingTracks(LeanOfTracks(scene.input, scene.input.pairs, fit, 0.5, scene.options, &latents)),
      moving);
}

TEST(FitWhatIsStill, FitsAgainWithoutWhatMoves) {
  simulation::SceneOptions options;
  options.moving_fraction = 0.3;
  const WalkScene scene = Walk(options, 0.0, 8.0);
  const Prior prior = StartOffTheTruth(scene.simulated.truth);
  int fits = 0;
  const auto fit = [&](const std::vector<TimedPair>& pairs, const Refined* before) {
    ++fits;
    return Refine(scene.input, pairs, before ? before->calibration : prior.mean, prior, {});
  };
  const Result<StillFit> still = FitWhatIsStill(scene.input, scene.input.pairs, {}, fit);
  ASSERT_TRUE(still) << still.error().message;
  EXPECT_GE(fits, 2);
  EXPECT_GT(still->moving, 30);
  EXPECT_GT(still->tracks, 3 * still->moving);
  EXPECT_LT(still->fit.quality.noise_px, 0.56);
  for (const TimedPair& pair : still->pairs) {
    for (const Match& match : pair.matches) ASSERT_GE(match.track_id, 0);
  }
}

// Fits that differ by less and by more: ten of the 29 tracks at the threshold, less than 1 % of all
// matches, are not worth a third one.
TEST(FitWhatIsStill, FitsNotAgainForAFewMatches) {
  simulation::SceneOptions options;
  options.moving_fraction = 0.06;
  const WalkScene scene = Walk(options, 0.0, 8.0);
  struct Case {
    double change_px;
    int fits;
  };
  for (const Case& c : {Case{0.0, 2}, Case{12.0, 2}, Case{24.0, kMostTests + 1}}) {
    SCOPED_TRACE(c.change_px);
    int fits = 0;
    const auto fit = [&](const std::vector<TimedPair>&, const Refined*) -> Result<Refined> {
      Refined refined;
      refined.calibration = scene.simulated.truth;
      refined.calibration.lens[kFocal] += c.change_px * fits++;
      refined.quality.noise_px = 0.5;
      return refined;
    };
    const Result<StillFit> still = FitWhatIsStill(scene.input, scene.input.pairs, {}, fit);
    ASSERT_TRUE(still) << still.error().message;
    EXPECT_EQ(fits, c.fits);
  }
}

TEST(FitWhatIsStill, LeavesTheRestAsItWas) {
  WalkScene scene = Walk({}, 0.0, 8.0);
  const Prior prior = StartOffTheTruth(scene.simulated.truth);
  int fits = 0;
  const auto fit = [&](const std::vector<TimedPair>& pairs, const Refined*) {
    ++fits;
    return Refine(scene.input, pairs, prior.mean, prior, {});
  };
  const Result<StillFit> still = FitWhatIsStill(scene.input, scene.input.pairs, {}, fit);
  ASSERT_TRUE(still) << still.error().message;
  EXPECT_EQ(fits, 1);
  EXPECT_EQ(still->moving, 0);
  EXPECT_TRUE(still->pairs.empty());
}

}  // namespace
}  // namespace camgyro
