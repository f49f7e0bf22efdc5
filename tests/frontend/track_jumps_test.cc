#include "frontend/track_jumps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "simulation/simulate.h"

namespace camgyro {
namespace {

simulation::Simulated WalkWithTracks(const std::string& motion, double wrong = 0.0) {
  const std::vector<std::string> overrides = {"duration_s=8", "tracks.count=60",
                                              "tracks.noise_px=0.5", "motion.kind=" + motion,
                                              "tracks.outlier_fraction=" + std::to_string(wrong)};
  const auto scenario = simulation::ParseScenario("motion: {kind: walking}", overrides);
  return simulation::SimulateTracks(scenario.value(), 5).value();
}

// Points, told by their frames and places.
std::set<std::pair<size_t, double>> PointsOf(const Recording& recording) {
  std::set<std::pair<size_t, double>> points;
  for (size_t f = 0; f < recording.tracks.size(); ++f) {
    for (const TrackedPoint& point : recording.tracks[f]) points.emplace(f, point.px.x());
  }
  return points;
}

size_t MatchesOfNeighbours(const Recording& recording) {
  size_t matches = 0;
  for (const FramePair& pair : PairsFromTracks(recording.tracks, 1)) matches += pair.matches.size();
  return matches;
}

TEST(TrackJumps, SoundTracksStayAsTheyAre) {
  for (const char* motion : {"handheld", "walking", "running", "panning", "slow"}) {
    SCOPED_TRACE(motion);
    simulation::Simulated simulated = WalkWithTracks(motion);
    const size_t points = PointsOf(simulated.recording).size();
    const TrackJumps jumps = RemoveTrackJumps(&simulated.recording);
    EXPECT_GT(jumps.points, 10000u);
    // Points at arm's length, whose parallax turns within a frame, are taken for wrong; of all
    // points that is a few in a thousand, most of them cuts, which cost one match.
    EXPECT_LT(jumps.wrong_ratio(), 2e-3);
    EXPECT_LT(static_cast<double>(jumps.off), 1e-3 * static_cast<double>(jumps.points));
    EXPECT_EQ(PointsOf(simulated.recording).size(), points - jumps.off);
    for (const auto& frame : simulated.recording.tracks) {
      for (size_t i = 1; i < frame.size(); ++i) {
        ASSERT_LT(frame[i - 1].track_id, frame[i].track_id);
      }
    }
  }
}

TEST(TrackJumps, WrongPointsLeaveAndRightOnesStay) {
  for (const char* motion : {"handheld", "slow"}) {
    for (const double fraction : {0.05, 0.15, 0.3}) {
      SCOPED_TRACE(std::string(motion) + " " + std::to_string(fraction));
      simulation::Simulated simulated = WalkWithTracks(motion, fraction);
      const Recording before = simulated.recording;
      RemoveTrackJumps(&simulated.recording);
      const auto kept = PointsOf(simulated.recording);
      double wrong = 0.0, right = 0.0, wrong_kept = 0.0, right_kept = 0.0;
      for (size_t f = 0; f < before.tracks.size(); ++f) {
        for (size_t i = 0; i < before.tracks[f].size(); ++i) {
          const simulation::PointTruth& truth = simulated.points[f][i];
          const Eigen::Vector2d& px = before.tracks[f][i].px;
          const bool stays = kept.count({f, px.x()}) > 0;
          // An error of a few sigmas is no jump, and none that a robust loss could not bear.
          const bool off = truth.outlier && (px - truth.px).norm() > 10.0;
          wrong += off;
          wrong_kept += off && stays;
          right += !truth.outlier;
          right_kept += !truth.outlier && stays;
        }
      }
      // A right point with wrong ones on both sides cannot be told; of those there are
      // fraction^2 (1 + 2 (1 - fraction)): 1, 6 and 22 %.
      EXPECT_LT(wrong_kept / wrong, fraction < 0.2 ? 0.15 : 0.3);
      EXPECT_GT(right_kept / right, 1.0 - 2.5 * fraction * fraction * (3.0 - 2.0 * fraction));
    }
  }
}

TEST(TrackJumps, ATrackThatSlipsGoesOnAsAnother) {
  simulation::Simulated simulated = WalkWithTracks("walking");
  std::vector<std::vector<TrackedPoint>>& tracks = simulated.recording.tracks;
  // Every tenth track slips by 15 px in frame 100, for good.
  std::set<int64_t> slipped;
  for (size_t f = 100; f < tracks.size(); ++f) {
    for (TrackedPoint& point : tracks[f]) {
      if (point.track_id % 10 != 0) continue;
      point.px += Eigen::Vector2d(12.0, -9.0);
      if (f == 100) slipped.insert(point.track_id);
    }
  }
  std::set<int64_t> there;  // those that frames 98 to 101 see
  for (const TrackedPoint& point : tracks[101]) {
    if (slipped.count(point.track_id) > 0) there.insert(point.track_id);
  }
  for (const size_t f : {size_t{98}, size_t{99}}) {
    std::set<int64_t> ids;
    for (const TrackedPoint& point : tracks[f]) ids.insert(point.track_id);
    for (auto id = there.begin(); id != there.end();) {
      id = ids.count(*id) > 0 ? std::next(id) : there.erase(id);
    }
  }
  ASSERT_GE(there.size(), 3u);
  const size_t points = PointsOf(simulated.recording).size();
  const size_t matches = MatchesOfNeighbours(simulated.recording);

  const TrackJumps jumps = RemoveTrackJumps(&simulated.recording);
  EXPECT_GE(jumps.cuts, there.size());
  EXPECT_LE(jumps.cuts, there.size() + 30);  // and those of near points, as above
  EXPECT_EQ(PointsOf(simulated.recording).size(), points - jumps.off);
  for (const int64_t id : there) {
    for (size_t f = 100; f < tracks.size(); ++f) {
      for (const TrackedPoint& point : tracks[f]) EXPECT_NE(point.track_id, id) << f;
    }
  }
  // A cut costs one match, a point that is gone two.
  EXPECT_GE(MatchesOfNeighbours(simulated.recording), matches - jumps.cuts - 2 * jumps.off);
}

TEST(TrackJumps, FewTracksAndNoneStay) {
  Recording recording;
  EXPECT_EQ(RemoveTrackJumps(&recording).points, 0u);
  recording.tracks.assign(6, {{1, {10.0, 10.0}}, {2, {50.0, 20.0}}});
  recording.tracks[3][0].px.x() = 300.0;  // wrong, but what moves is not known
  const TrackJumps jumps = RemoveTrackJumps(&recording);
  EXPECT_EQ(jumps.points, 12u);
  EXPECT_EQ(jumps.off + jumps.cuts, 0u);
}

// Every seventh picture is the one before: nothing moves, then everything moves twice as far.
TEST(TrackJumps, ARepeatedPictureIsNoJump) {
  simulation::Simulated simulated = WalkWithTracks("running");
  std::vector<std::vector<TrackedPoint>>& tracks = simulated.recording.tracks;
  for (size_t f = 7; f < tracks.size(); f += 7) tracks[f] = tracks[f - 1];
  const TrackJumps jumps = RemoveTrackJumps(&simulated.recording);
  EXPECT_LT(jumps.wrong_ratio(), 5e-3);
}

struct Streamed {
  Recording recording;  // with what came out, in place
  TrackJumps jumps;
};

Streamed ThroughStream(const Recording& recording) {
  Streamed streamed;
  StreamingTrackJumps stream;
  for (const auto& points : recording.tracks) {
    const size_t before = stream.held();
    auto known = stream.Add(points);
    EXPECT_EQ(known.has_value(), before == StreamingTrackJumps::kBehind);
    if (known) streamed.recording.tracks.push_back(*std::move(known));
  }
  EXPECT_EQ(streamed.recording.tracks.size() + stream.held(), recording.tracks.size());
  streamed.jumps = stream.jumps();
  return streamed;
}

// The rule is that of the whole recording, with the noise of a second instead of all of it.
TEST(StreamingTrackJumps, LeavesOutWhatTheWholeRecordingDoes) {
  for (const double fraction : {0.0, 0.15}) {
    SCOPED_TRACE(fraction);
    simulation::Simulated simulated = WalkWithTracks("walking", fraction);
    const Streamed streamed = ThroughStream(simulated.recording);
    RemoveTrackJumps(&simulated.recording);
    simulated.recording.tracks.resize(streamed.recording.tracks.size());
    const auto whole = PointsOf(simulated.recording), parts = PointsOf(streamed.recording);
    std::vector<std::pair<size_t, double>> differ;
    std::set_symmetric_difference(whole.begin(), whole.end(), parts.begin(), parts.end(),
                                  std::back_inserter(differ));
    EXPECT_LT(static_cast<double>(differ.size()), 0.01 * static_cast<double>(whole.size()));
    for (const auto& frame : streamed.recording.tracks) {
      for (size_t i = 1; i < frame.size(); ++i) ASSERT_LT(frame[i - 1].track_id, frame[i].track_id);
    }
    EXPECT_NEAR(streamed.jumps.wrong_ratio(), fraction, fraction > 0.0 ? 0.03 : 3e-3);
  }
}

TEST(StreamingTrackJumps, ATrackThatSlipsGoesOnAsAnother) {
  simulation::Simulated simulated = WalkWithTracks("walking");
  std::vector<std::vector<TrackedPoint>>& tracks = simulated.recording.tracks;
  std::set<int64_t> slips;  // of those that frames 98 to 101 see, every tenth
  for (const TrackedPoint& point : tracks[98]) {
    if (point.track_id % 10 == 0) slips.insert(point.track_id);
  }
  for (const size_t f : {size_t{99}, size_t{100}, size_t{101}}) {
    std::set<int64_t> here;
    for (const TrackedPoint& point : tracks[f]) {
      if (slips.count(point.track_id) > 0) here.insert(point.track_id);
    }
    slips = std::move(here);
  }
  ASSERT_GE(slips.size(), 3u);
  for (size_t f = 100; f < tracks.size(); ++f) {
    for (TrackedPoint& point : tracks[f]) {
      if (slips.count(point.track_id) > 0) point.px += Eigen::Vector2d(12.0, -9.0);
    }
  }
  const Streamed streamed = ThroughStream(simulated.recording);
  EXPECT_GE(streamed.jumps.cuts, slips.size());
  for (size_t f = 0; f < streamed.recording.tracks.size(); ++f) {
    std::set<int64_t> cut;
    for (const TrackedPoint& point : streamed.recording.tracks[f]) {
      if (f >= 100) {
        EXPECT_EQ(slips.count(point.track_id), 0u) << f;
      }
      if (point.track_id <= StreamingTrackJumps::kLargestCutId) cut.insert(point.track_id);
    }
    // They go on: as many as are there. Before, only points at arm's length are cut.
    if (f == 100) {
      EXPECT_GE(cut.size(), slips.size());
    }
    if (f < 100) {
      EXPECT_LE(cut.size(), 3u) << f;
    }
  }
}

}  // namespace
}  // namespace camgyro
