// Which frames the fit, the choice of effects and the reported gain may see.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_SHARES_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_SHARES_H_

#include <cstddef>
#include <limits>
#include <vector>

#include "core/recording.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_selection.h"

namespace camgyro {

// A stretch of frames that belong to one share.
using PairBlock = std::vector<TimedPair>;

struct Shares {
  // Blocks of neighbouring pairs in time order, dealt out as fit, choice, fit, choice, report and
  // so on. No frame is in two shares: pairs across the border of two blocks are in none. In
  // `report`, no track that is in another share either. (A track may go on from a fit block into a
  // choice block; the residuals of two frames have no point in common with others, only its noise
  // in either frame, so that the two shares do not meet.)
  std::vector<PairBlock> fit, choice, report;
  double block_s = 0.0;
  // The tracks live too long for that: `report` has tracks that other shares see, too.
  bool report_shares_tracks = false;
};

// How many pairs of recordings with pixels stay in a share: every n-th.
struct ShareLimits {
  static constexpr size_t kAll = std::numeric_limits<size_t>::max();
  size_t fit = kAll, choice = kAll, report = kAll;
  bool with_report = true;  // false: `report` stays empty
};

// The pairs that are tested: those that are fitted (SelectPairs), of cameras of more than 60
// frames/s as many as of such a one (kMostPairsPerS). As there, no two share an observation.
PairSelection SelectPairsToTest(const Recording& recording);

// Short blocks, so that what changes with time is seen by all shares: 1/40 of the recording, within
// 0.2 and 3 s, at least 6 frames and twice the length of a pair; longer ones where there would be
// more than 300. `input` may be an outline (OutlineOf): pairs that stay have their matches.
Shares MakeShares(const Recording& recording, const EstimationInput& input,
                  const ShareLimits& limits = {});

std::vector<TimedPair> Joined(const std::vector<PairBlock>& blocks);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_SHARES_H_
