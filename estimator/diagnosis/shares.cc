#include "estimator/diagnosis/shares.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/time.h"
#include "estimator/diagnosis/thresholds.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_selection.h"

namespace camgyro {
namespace {

enum Share { kFit, kChoice, kReport };
constexpr Share kDeal[] = {kFit, kChoice, kFit, kChoice, kReport};

// Leaves every n-th pair, so that at most `most` stay.
void Thin(size_t most, std::vector<PairBlock>* blocks) {
  size_t pairs = 0;
  for (const PairBlock& block : *blocks) pairs += block.size();
  if (pairs <= most) return;
  const size_t stride = (pairs + most - 1) / most;
  size_t at = 0;
  for (PairBlock& block : *blocks) {
    PairBlock kept;
    for (TimedPair& pair : block) {
      if (at++ % stride == 0) kept.push_back(std::move(pair));
    }
    block = std::move(kept);
  }
}

// The length of a stretch. It is of the recording, so that pairs of any gap have the same blocks.
double LengthOfBlock(const Recording& recording, double duration_s) {
  const double interval_s = MedianInterval(recording.frames);
  return std::max({std::clamp(duration_s / kBlocksPerRecording, kShortestBlockS, kLongestBlockS),
                   kLeastFramesOfBlock * interval_s,
                   kLeastPairsOfBlock * SelectPairs(recording).gap * interval_s,
                   duration_s / kMostBlocks});
}

void AddMatches(const Recording& recording, std::vector<PairBlock>* blocks) {
  for (PairBlock& block : *blocks) AddMatches(recording, &block);
}

}  // namespace

PairSelection SelectPairsToTest(const Recording& recording) {
  PairSelection selection = SelectPairs(recording);
  if (selection.gap == 1) return selection;  // neighbours do not overlap
  // Gaps are odd where pairs overlap, so that pairs from even frames share none.
  const double interval_s = MedianInterval(recording.frames);
  while (selection.stride < selection.gap &&
         selection.stride * interval_s * kMostPairsPerS < 0.95) {  // 59.94 frames/s are 60
    selection.stride += 2;
  }
  return selection;
}

Shares MakeShares(const Recording& recording, const EstimationInput& input,
                  const ShareLimits& limits) {
  Shares shares;
  if (input.pairs.empty()) return shares;
  const double begin_s = SecondsSince(input.origin_ns, recording.frames.front().stamp_ns);
  const double duration_s =
      SecondsSince(input.origin_ns, recording.frames.back().stamp_ns) - begin_s;
  shares.block_s = LengthOfBlock(recording, duration_s);
  const auto block_of = [&](double time_s) {
    return static_cast<int64_t>(std::floor((time_s - begin_s) / shares.block_s));
  };
  const auto share_of = [](int64_t block) { return kDeal[block % 5]; };

  // Tracks that the other shares see.
  std::set<int64_t> seen;
  const bool has_tracks = recording.matches.empty() && !recording.tracks.empty();
  if (has_tracks && limits.with_report) {
    for (const TimedPair& pair : input.pairs) {
      if (share_of(block_of(pair.time_a_s)) == kReport) continue;
      for (const TrackedPoint& point : recording.tracks[static_cast<size_t>(pair.frame_a)]) {
        seen.insert(point.track_id);
      }
    }
  }
  std::vector<PairBlock> report_all;
  size_t usable = 0;
  int64_t last_block = -1;
  for (const TimedPair& pair : input.pairs) {
    const int64_t block = block_of(pair.time_a_s);
    if (block_of(pair.time_b_s) != block) continue;
    const Share share = share_of(block);
    if (share == kReport && !limits.with_report) continue;
    std::vector<PairBlock>& blocks = share == kFit      ? shares.fit
                                     : share == kChoice ? shares.choice
                                                        : shares.report;
    if (block != last_block) blocks.emplace_back();
    last_block = block;
    blocks.back().push_back(pair);
    if (share == kReport && has_tracks) {
      report_all.resize(shares.report.size());
      report_all.back().push_back(pair);
      std::vector<Match>& matches = blocks.back().back().matches;
      matches = MatchesOf(recording, pair);
      matches.erase(
          std::remove_if(matches.begin(), matches.end(),
                         [&](const Match& match) { return seen.count(match.track_id) > 0; }),
          matches.end());
      usable += matches.size() >= static_cast<size_t>(PairGraph::kMinMatches) ? 1 : 0;
    }
  }
  if (has_tracks && usable < kLeastReportPairs && usable * 2 < Joined(report_all).size()) {
    shares.report = std::move(report_all);
    shares.report_shares_tracks = true;
  }
  if (recording.HasOnlyAttitudes()) return shares;
  Thin(limits.fit, &shares.fit);
  Thin(limits.choice, &shares.choice);
  Thin(limits.report, &shares.report);
  AddMatches(recording, &shares.fit);
  AddMatches(recording, &shares.choice);
  if (!has_tracks || shares.report_shares_tracks) AddMatches(recording, &shares.report);
  return shares;
}

std::vector<TimedPair> Joined(const std::vector<PairBlock>& blocks) {
  std::vector<TimedPair> pairs;
  for (const PairBlock& block : blocks) pairs.insert(pairs.end(), block.begin(), block.end());
  return pairs;
}

}  // namespace camgyro
