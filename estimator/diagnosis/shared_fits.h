// What the rounds of the closed loop share: the recording dealt out, and fits and scores on it.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_SHARED_FITS_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_SHARED_FITS_H_

#include <limits>
#include <memory>
#include <vector>

#include "estimator/diagnosis/diagnose.h"
#include "estimator/diagnosis/pair_scores.h"
#include "estimator/diagnosis/shares.h"
#include "estimator/window/refinement.h"

namespace camgyro {

class SharedFits {
 public:
  // Both outlive it.
  SharedFits(const LoopInput& in, const DiagnoseOptions& options);

  const LoopInput& in() const { return in_; }
  const DiagnoseOptions& options() const { return options_; }
  // Its pairs have no matches (OutlineOf); those of the shares have.
  const EstimationInput& input() const { return input_; }
  const Shares& shares() const { return shares_; }
  // The choice share's frames in pairs that are near.
  const std::vector<PairBlock>& map_pairs() const { return map_pairs_; }
  // Pairs of near frames in the fit and the choice share.
  const std::vector<TimedPair>& near_pairs() const { return near_pairs_; }
  // Stretches of the fit and the choice share together, those that have pairs, in time order.
  std::vector<PairBlock> SeenBlocks() const;

  // A fit of the fit share. noise: first guess. latents: of a fit of the share near the start.
  // most_noise: with more, or with a focal length that is running away, the fit is lost and ends
  // early.
  Result<Refined> Fit(const Calibration& start, double noise,
                      std::shared_ptr<const PairLatents> latents = nullptr,
                      double most_noise = std::numeric_limits<double>::infinity()) const;
  // Effects that depend on the calibration made anew until it settles.
  Refined Settle(Refined fit) const;
  // Puts steps of the delay where the fit and the choice share have them, to within a pair or a gap
  // between the shares. False if nothing has moved.
  bool PlaceSteps(double noise, Calibration* calibration) const;

  Scores ScoresOf(const std::vector<PairBlock>& blocks, const Calibration& calibration,
                  std::shared_ptr<const EffectSet> candidates, double noise) const;

  // Far from where it all began, in focal length or centre.
  bool HasRunAway(const Calibration& calibration) const;

 private:
  const LoopInput& in_;
  const DiagnoseOptions& options_;
  const EstimationInput input_;
  Shares shares_;
  std::vector<PairBlock> map_pairs_;
  std::vector<TimedPair> near_pairs_;
};

// Sum over the blocks.
double Chi2Of(const Scores& scores);
// Fall of chi2 + log_det by block; blocks that one of the two could not evaluate count nothing.
std::vector<double> Fall(const Scores& before, const Scores& after);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_SHARED_FITS_H_
