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

double ExpectedFall(const Scores& scores, const Calibration& without, const Calibration& with) {
  const Eigen::Index had = without.effect_values.size(), has = with.effect_values.size();
  if (has < had || scores.num_model != kStateSize + has) return 0.0;
  Eigen::VectorXd moved(scores.num_model);
  moved.head<kStateSize>() = Difference(with, without);
  moved.tail(has) = with.effect_values;
  moved.segment(kStateSize, had) -= without.effect_values;
  double fall = 0.0;
  for (const BlockScore& block : scores.blocks) {
    if (block.H.rows() < moved.size()) continue;
    fall += moved.dot(block.H.topLeftCorner(moved.size(), moved.size()) * moved);
  }
  return fall;
}

bool CouldConfirm(const DiagnosisRound& round) {
  return round.expected_gain > kGainSigmas * 2.0 * std::sqrt(round.expected_gain);
}

bool ShowsGain(const DiagnosisRound& round) {
  return round.report_gain.sum > kConfirmingSigmas * round.report_gain.sigma;
}

bool IsUnconfirmed(const DiagnosisRound& round) {
  return !round.added.empty() && CouldConfirm(round) && !ShowsGain(round);
}

std::vector<std::string> Unconfirmed(const std::vector<DiagnosisRound>& rounds) {
  std::vector<std::string> names;
  for (const DiagnosisRound& round : rounds) {
    if (IsUnconfirmed(round)) names.push_back(round.added);
  }
  return names;
}

}  // namespace camgyro
