#include "estimator/diagnosis/gain_rule.h"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/thresholds.h"

namespace camgyro {

Gain CandidateResult::ExpectedGain() const {
  Gain expected;
  expected.sum = 0.5 * statistic * inflation;
  expected.sigma = 2.0 * std::sqrt(expected.sum * inflation);
  return expected;
}

bool GainBearsOut(const CandidateResult& candidate, double tests) {
  const Gain& gain = candidate.gain;
  const double noise =
      2.0 * std::sqrt(std::max(0.0, gain.sum) * std::max(1.0, candidate.inflation));
  if (gain.sum > kGainSigmas * gain.sigma ||
      (gain.sum > kGainSigmas * noise && gain.lost < kHardlyAnyLoss * gain.sum)) {
    return true;
  }
  const bool no_doubt = candidate.p_value * tests < kNoDoubt;
  if (no_doubt && gain.sum > gain.sigma) return true;
  if (!no_doubt && candidate.inflation >= kNoiseAlone) return false;
  const Gain expected = candidate.ExpectedGain();
  return (candidate.refitted || gain.sum > 0.0) &&
         gain.sum + kGainSigmas * expected.sigma > expected.sum &&
         gain.sigma < kGainSigmas * expected.sigma;
}

bool Confirmed(const DiagnosisRound& round) {
  return round.report_gain.sum > kConfirmingSigmas * round.report_gain.sigma;
}

std::vector<std::string> Unconfirmed(const std::vector<DiagnosisRound>& rounds) {
  std::vector<std::string> names;
  for (const DiagnosisRound& round : rounds) {
    if (!round.added.empty() && !Confirmed(round)) names.push_back(round.added);
  }
  return names;
}

}  // namespace camgyro
