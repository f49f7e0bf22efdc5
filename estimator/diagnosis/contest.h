// The contest of a round: the close rivals refitted on the fit share and compared on the choice
// share.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_CONTEST_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_CONTEST_H_

#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/candidates.h"
#include "estimator/diagnosis/shared_fits.h"

namespace camgyro {

// A candidate of a round with what is known of it.
struct Contestant {
  CandidateResult result;
  Candidate candidate;
};

struct ContestSetting {
  const SharedFits* fits = nullptr;
  const Refined* now = nullptr;    // the fit so far
  const Scores* choice = nullptr;  // its scores in the choice share
  bool first_round = true;
  bool delay_moves = false;  // DelayMoves() of the maps
};

struct ContestResult {
  size_t winner = 0;  // index into the contestants
  Refined fit;        // with it
};

// Refits those contestants that are not rejected, best first as they come, and, where the model is
// far off, some that are (CandidateResult::tried_anyway); writes into each what its refit has shown
// and why it does not win. Nothing if none may be added.
std::optional<ContestResult> RunContest(const ContestSetting& setting,
                                        std::vector<Contestant>* contestants);

// Of effects that are a last resort (Candidate::is_last_resort), which RunContest leaves alone: the
// first that is not rejected, refitted. Nothing if there is none, or its refit speaks against it.
std::optional<ContestResult> RunLastResort(const ContestSetting& setting,
                                           std::vector<Contestant>* contestants);

// Of the last effect's parameters being all zero, by both shares: Wald's statistic of the fit share
// and the gain in the choice share. If the best parameters are a of one and b of the other, in
// sigmas, the two are a^2 and at most 2ab - a^2, so that their sum is bounded by a^2 + b^2, chi2
// with twice the parameters. The score extrapolates from zero, at derivatives of a model that may
// be far off.
double PValueOfFit(const Calibration& fit, double inflation, double gain);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_CONTEST_H_
