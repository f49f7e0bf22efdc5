#include "estimator/diagnosis/gain_rule.h"

#include <algorithm>
#include <cmath>

namespace camgyro {

Gain CandidateResult::ExpectedGain() const {
  Gain expected;
  expected.sum = 0.5 * statistic * inflation;
  expected.sigma = 2.0 * std::sqrt(expected.sum * inflation);
  return expected;
}

bool GainBearsOut(const CandidateResult& candidate, double tests) {
  constexpr double kNoDoubt = 1e-5;    // p of all candidates together
  constexpr double kNoiseAlone = 2.0;  // inflation
  const Gain& gain = candidate.gain;
  const double noise =
      2.0 * std::sqrt(std::max(0.0, gain.sum) * std::max(1.0, candidate.inflation));
  if (gain.sum > 2.0 * gain.sigma || (gain.sum > 2.0 * noise && gain.lost < 0.1 * gain.sum)) {
    return true;
  }
  const bool no_doubt = candidate.p_value * tests < kNoDoubt;
  if (no_doubt && gain.sum > gain.sigma) return true;
  if (!no_doubt && candidate.inflation >= kNoiseAlone) return false;
  const Gain expected = candidate.ExpectedGain();
  return (candidate.refitted || gain.sum > 0.0) && gain.sum + 2.0 * expected.sigma > expected.sum &&
         gain.sigma < 2.0 * expected.sigma;
}

}  // namespace camgyro
