// Does the gain in unseen frames bear out an effect that is significant?
// And do frames that had no part in the choice confirm it?
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_GAIN_RULE_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_GAIN_RULE_H_

#include <string>
#include <vector>

#include "estimator/diagnosis/diagnose.h"
#include "estimator/diagnosis/pair_scores.h"

namespace camgyro {

// It does if it is beyond twice its scatter from block to block or, where the effect acts in some
// blocks only (a step early in the recording) so that the scatter is the effect itself, beyond
// twice the noise that the gain of a right effect has, 2 sqrt(gain), inflated as the test; a
// right effect then makes hardly any block worse.
// The half of the data that tells the gain cannot have it beyond its noise for an effect of less
// than some 8 sigmas. Where the noise is what the model says (little inflation), or both shares
// together leave no doubt, it only has to agree: with its sign (before the refit, where both
// shares tell the gain), with half of the statistic, which is what a right effect gains there, and
// with a scatter that is not beyond twice a right effect's (structure that lacks a name has more).
// Without any doubt, once its scatter is enough.
// tests: number of candidates of the round.
bool GainBearsOut(const CandidateResult& candidate, double tests);

// Fall of chi2 in a share where `with` is right in place of `without`, from which it differs by an
// effect more and what else has moved: the difference, squared by the information that the share
// has. scores: of the share, at `with`.
double ExpectedFall(const Scores& scores, const Calibration& without, const Calibration& with);

// Can the report share, which has no part in the choice, say anything of what the round has added?
// Its tracks are its own, so that it may have few matches, and those tell little of weak effects: a
// right one has to show beyond twice the noise of such a gain, 2 sqrt(gain).
bool CouldConfirm(const DiagnosisRound& round);

// Does it gain beyond the gain's own scatter there?
bool ShowsGain(const DiagnosisRound& round);

// It could, and shows no gain: the effect may be right all the same,
// or stand for something else, which the other frames have and these have not.
bool IsUnconfirmed(const DiagnosisRound& round);

// The effects of such rounds that are not withdrawn, in their order.
std::vector<std::string> Unconfirmed(const std::vector<DiagnosisRound>& rounds);

// One of the candidates of many recordings is significant by chance. If frames that had no part in
// the choice do not show an effect, whether they could or not, and its parameters in the fit of all
// frames are not significant either, all its shapes together, it is no finding. Fills `withdrawn`
// of the rounds of the least significant one: what is left of two that stand for the same thing is
// told by the fit without it. False if there is none.
bool WithdrawByAllFrames(const Calibration& of_all_frames, double significance,
                         std::vector<DiagnosisRound>* rounds);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_GAIN_RULE_H_
