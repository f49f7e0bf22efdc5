#include "estimator/moving_tracks.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "core/parallel.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_view.h"

namespace camgyro {
namespace {

void AddLeans(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise, const PairGraphOptions& options,
              const std::optional<Eigen::Vector2d>& times_s, TrackLeans* leans) {
  PairView view;
  std::vector<MatchMisfit> misfits;
  if (!ResidualOf(pair, options)
           .Explain(input, pair, calibration, noise, options, times_s, &view, &misfits)) {
    return;
  }
  for (size_t i = 0; i < misfits.size(); ++i) {
    leans->Add(view.measurement.matches[i].track_id,
               misfits[i].residual_px / view.measurement.sigma, misfits[i].correction_px);
  }
}

// Of two sets of ascending ids, the first of them of the tracks that were tested. What comes and
// goes at the threshold is not worth another fit.
bool AlmostTheSame(const std::vector<int64_t>& moving, const std::vector<int64_t>& left_out,
                   const std::vector<TrackLean>& leans) {
  // Of the tracks that move.
  constexpr double kTracks = 0.1;
  // Of all matches: points at rest that come or go with so many move a fit by a tenth of its sigma
  // (the root of it, of independent noise), as far as a solve stops from its minimum. Those
  // that no fit has been without are not at the threshold.
  constexpr double kMatches = 0.01;
  std::vector<int64_t> differ;
  std::set_symmetric_difference(moving.begin(), moving.end(), left_out.begin(), left_out.end(),
                                std::back_inserter(differ));
  if (static_cast<double>(differ.size()) <=
      kTracks * static_cast<double>(std::max(moving.size(), left_out.size()))) {
    return true;
  }
  double all = 0.0, of_differing = 0.0;
  for (const TrackLean& lean : leans) {
    all += lean.matches;
    if (std::binary_search(differ.begin(), differ.end(), lean.track_id)) {
      of_differing += lean.matches;
    }
  }
  return !left_out.empty() && of_differing <= kMatches * all;
}

}  // namespace

std::vector<TrackLean> LeanOfTracks(const EstimationInput& input,
                                    const std::vector<TimedPair>& pairs,
                                    const Calibration& calibration, double noise,
                                    const PairGraphOptions& options, const PairLatents* latents) {
  constexpr size_t kTogether = 64;  // pairs, whatever the number of threads: sums in one order
  std::vector<TrackLeans> of_parts((pairs.size() + kTogether - 1) / kTogether);
  ParallelFor(of_parts.size(), [&](size_t part) {
    const size_t end = std::min(pairs.size(), (part + 1) * kTogether);
    for (size_t i = part * kTogether; i < end; ++i) {
      const auto times_s = latents != nullptr ? latents->TimesOf(pairs[i]) : std::nullopt;
      AddLeans(input, pairs[i], calibration, noise, options, times_s, &of_parts[part]);
    }
  });
  TrackLeans leans;
  for (const TrackLeans& of_part : of_parts) leans.Add(of_part);
  return leans.All();
}

std::vector<TimedPair> WithoutTracks(const std::vector<TimedPair>& pairs,
                                     const std::vector<int64_t>& track_ids) {
  std::vector<TimedPair> kept = pairs;
  for (TimedPair& pair : kept) EraseMatchesOf(track_ids, &pair.matches);
  return kept;
}

Result<StillFit> FitWhatIsStill(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                                const PairGraphOptions& options, const FitOfPairs& fit) {
  Result<Refined> first = fit(pairs, nullptr);
  if (!first) return tl::unexpected(first.error());
  StillFit still;
  still.fit = *std::move(first);
  if (pairs.empty() || !ResidualOf(pairs.front(), options).facts().has_direction ||
      options.robust_threshold <= 0.0) {
    return still;
  }
  std::vector<int64_t> left_out;
  for (int test = 0; test < kMostTests; ++test) {
    const std::vector<TrackLean> leans =
        LeanOfTracks(input, pairs, still.fit.calibration, still.fit.quality.noise_px, options,
                     still.fit.latents.get());
    std::vector<int64_t> moving = MovingTracks(leans);
    if (AlmostTheSame(moving, left_out, leans)) break;
    std::vector<TimedPair> at_rest = WithoutTracks(pairs, moving);
    Result<Refined> next = fit(at_rest, &still.fit);
    if (!next) break;
    left_out = std::move(moving);
    still = {*std::move(next), std::move(at_rest), static_cast<int>(leans.size()),
             static_cast<int>(left_out.size())};
  }
  return still;
}

}  // namespace camgyro
