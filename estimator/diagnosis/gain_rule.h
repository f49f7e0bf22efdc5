// Does the gain in unseen frames bear out an effect that is significant?
// And do frames that had no part in the choice confirm it?
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_GAIN_RULE_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_GAIN_RULE_H_

#include <string>
#include <vector>

#include "estimator/diagnosis/diagnose.h"

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

// Does the report share gain by what the round has added, beyond that gain's own noise? If it does
// not, the effect may be right and too weak to show in a fifth of the recording, or stand for
// something else, which the other frames have and these have not.
bool Confirmed(const DiagnosisRound& round);

// Effects that were added and are not confirmed, in their order.
std::vector<std::string> Unconfirmed(const std::vector<DiagnosisRound>& rounds);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_GAIN_RULE_H_
