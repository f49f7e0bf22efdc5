#include "estimator/times_between.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <utility>

#include "core/format.h"
#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/refinement.h"

namespace camgyro {
namespace {

// Pairs of neighbours that are fitted together. Frames' times hang together within a few frames:
// where the calibration is held, stretches need not know of each other, and each settles in fewer
// steps than all of a recording does.
constexpr size_t kStretch = 150;
// Pairs on either side that a stretch shares with the next one, so that none of its own frames is
// at an end.
constexpr size_t kShared = 10;

// Rates that pairs within some time may need, those of frames that are late by kMostSpreadS
// included [s].
constexpr double kRateMarginS = 1.0;

// A disagreement of sides up to this is what some 300 frames show by chance: their median is known
// to 6 %.
constexpr double kTakenForNoise = 1.2;

// Those of the pairs first, first + 1, ... before end, and their rates.
EstimationInput PartOf(const EstimationInput& input, size_t first, size_t end,
                       const Calibration& calibration) {
  EstimationInput part;
  part.origin_ns = input.origin_ns;
  part.pairs.assign(input.pairs.begin() + static_cast<std::ptrdiff_t>(first),
                    input.pairs.begin() + static_cast<std::ptrdiff_t>(end));
  const auto delay_s = [&](const TimedPair& pair) { return DelayOf(calibration, pair.first()); };
  const double from_s = part.pairs.front().time_a_s + delay_s(part.pairs.front()) - kRateMarginS;
  const double to_s = part.pairs.back().time_b_s + delay_s(part.pairs.back()) + kRateMarginS;
  for (const TimedRate& rate : input.rates) {
    if (rate.time_s >= from_s && rate.time_s <= to_s) part.rates.push_back(rate);
  }
  return part;
}

// A fit of the frames' own times beside a calibration that is known, from times that are.
class TimesBesideFit {
 public:
  TimesBesideFit(const Recording& recording, const Calibration& fit,
                 const std::vector<FrameOffset>& known, double noise_px,
                 const PairGraphOptions& graph)
      // What is a frame's own moves nothing else.
      : recording_(recording),
        fit_(fit),
        held_{fit, fit.sigma(), fit.effect_covariance.diagonal().cwiseMax(1e-24).cwiseSqrt()} {
    // What is left are directions and times: a third round moves them no nearer to the camera's
    // clock (docs/lab/performance.md).
    constexpr int kRounds = 2;
    auto times = std::make_shared<PairLatents>();
    for (const FrameOffset& frame : known) times->frame_times_s[frame.frame] = frame.offset_s;
    with_.graph = graph;
    with_.max_rounds = kRounds;
    with_.frame_times_alone = with_.graph.hold_shared = true;
    with_.latents = std::move(times);
    with_.graph.sigma = noise_px;
  }

  // Of the pairs first, first + 1, ... before end, by those of their matches that are wanted (all).
  // None where they cannot be fitted.
  std::vector<FrameOffset> Of(const EstimationInput& input, size_t first, size_t end,
                              const std::function<bool(const Match&)>& is_wanted = {}) const {
    EstimationInput part = PartOf(input, first, end, fit_);
    AddMatches(recording_, &part.pairs);
    for (TimedPair& pair : part.pairs) {
      if (!is_wanted) break;
      std::vector<Match>& matches = pair.matches;
      matches.erase(std::remove_if(matches.begin(), matches.end(),
                                   [&](const Match& match) { return !is_wanted(match); }),
                    matches.end());
    }
    const Result<Refined> refined = Refine(part, part.pairs, fit_, held_, with_);
    return refined ? refined->frame_times : std::vector<FrameOffset>();
  }

 private:
  const Recording& recording_;
  const Calibration& fit_;
  const Prior held_;
  RefinementOptions with_;
};

// How far the times that both sides tell of the same frames differ, in sigmas, less the median:
// what a stretch has in common is no frame's own.
std::vector<double> DifferencesOfSides(const std::vector<FrameOffset>& left,
                                       const std::vector<FrameOffset>& right, double most_sigma_s) {
  std::map<int64_t, FrameOffset> by_frame;
  for (const FrameOffset& frame : left) by_frame[frame.frame] = frame;
  std::vector<Eigen::Vector2d> told;  // difference and its sigma [s]
  std::vector<double> differences_s;
  for (const FrameOffset& frame : right) {
    const auto other = by_frame.find(frame.frame);
    if (other == by_frame.end() || std::max(frame.sigma_s, other->second.sigma_s) > most_sigma_s) {
      continue;
    }
    told.emplace_back(other->second.offset_s - frame.offset_s,
                      std::hypot(other->second.sigma_s, frame.sigma_s));
    differences_s.push_back(told.back()[0]);
  }
  std::vector<double> z;
  if (told.empty()) return z;
  const double median_s = MedianInPlace(&differences_s);
  for (const Eigen::Vector2d& one : told) z.push_back((one[0] - median_s) / one[1]);
  return z;
}

// The sigma of a frame's time that its matches tell so much less well than was thought.
double Widened(const FrameOffset& frame, double spread_s, double factor) {
  const double prior = std::pow(PriorSpread(frame.offset_s, spread_s), -2);
  const double told = std::max(0.0, std::pow(frame.sigma_s, -2) - prior);
  return 1.0 / std::sqrt(told / (factor * factor) + prior);
}

}  // namespace

std::vector<FrameOffset> TimesOfAllFrames(const Recording& recording, const Calibration& fit,
                                          const std::vector<FrameOffset>& of_pairs, double noise_px,
                                          const PairGraphOptions& graph) {
  if (of_pairs.empty() || !SelectPairs(recording).leaves_frames_out()) return of_pairs;
  const TimesBesideFit beside(recording, fit, of_pairs, noise_px, graph);
  const EstimationInput input = OutlineOf(recording, PairSelection());
  std::map<int64_t, FrameOffset> all;  // by frame
  for (const FrameOffset& frame : of_pairs) all[frame.frame] = frame;
  std::vector<std::vector<FrameOffset>> of_stretches((input.pairs.size() + kStretch - 1) /
                                                     kStretch);
  ParallelFor(of_stretches.size(), [&](size_t k) {
    const size_t first = k * kStretch, end = std::min(first + kStretch, input.pairs.size());
    const int64_t own_from = PairGraph::FrameNumber(input.pairs[first].time_a_s);
    const int64_t own_to = PairGraph::FrameNumber(input.pairs[end - 1].time_b_s);
    for (const FrameOffset& frame : beside.Of(input, first - std::min(first, kShared),
                                              std::min(end + kShared, input.pairs.size()))) {
      if (frame.frame >= own_from && frame.frame <= own_to) of_stretches[k].push_back(frame);
    }
  });
  for (const auto& of_stretch : of_stretches) {
    for (const FrameOffset& frame : of_stretch) all[frame.frame] = frame;
  }
  std::vector<FrameOffset> result;
  for (const auto& entry : all) result.push_back(entry.second);
  return result;
}

double DisagreementOfSides(const Recording& recording, const Calibration& fit,
                           const std::vector<FrameOffset>& of_pairs, double noise_px,
                           const PairGraphOptions& graph) {
  constexpr size_t kPairs = 50, kStretches = 6;  // spread over the recording
  constexpr size_t kLeastFrames = 60;            // know a median to 15 %
  constexpr double kTold = 0.5;                  // of the spread: by matches, not by the prior
  const double most_sigma_s = kTold * fit.pair_effects().frame_time_spread_s();
  const EstimationInput input = OutlineOf(recording, SelectPairs(recording));
  const size_t stretches = std::min(kStretches, input.pairs.size() / kPairs);
  if (of_pairs.empty() || stretches == 0 || recording.HasOnlyAttitudes()) return 1.0;
  const TimesBesideFit beside(recording, fit, of_pairs, noise_px, graph);
  std::vector<std::array<std::vector<FrameOffset>, 2>> sides(stretches);
  ParallelFor(2 * stretches, [&](size_t k) {
    const size_t stretch = k / 2, side = k % 2;
    const size_t first =
        (input.pairs.size() - kPairs) * stretch / std::max<size_t>(1, stretches - 1);
    sides[stretch].at(side) = beside.Of(input, first, first + kPairs, [&](const Match& match) {
      return (match.px_a.x() < 0.5 * fit.width_px) == (side == 0);
    });
  });
  std::vector<double> sizes;
  for (const auto& [left, right] : sides) {
    for (const double z : DifferencesOfSides(left, right, most_sigma_s)) {
      sizes.push_back(std::abs(z));
    }
  }
  if (sizes.size() < kLeastFrames) return 1.0;
  return std::max(1.0, kSigmaOfMedian * MedianInPlace(&sizes));
}

void TakeTimesOfAllFrames(const Recording& recording, const PairGraphOptions& graph,
                          CalibrationReport* report) {
  const Calibration& fit = report->calibration;
  const double noise_px = report->quality.noise_px;
  const double factor = DisagreementOfSides(recording, fit, report->frame_times, noise_px, graph);
  report->frame_times = TimesOfAllFrames(recording, fit, report->frame_times, noise_px, graph);
  if (!(factor > kTakenForNoise)) return;
  for (FrameOffset& frame : report->frame_times) {
    frame.sigma_s = Widened(frame, fit.pair_effects().frame_time_spread_s(), factor);
  }
  report->notes.push_back(
      Format("the left and the right half of the picture tell times of frames that differ by %.1f "
             "times as much as noise lets expect: so much less is told of frames' own times",
             factor));
}

}  // namespace camgyro
