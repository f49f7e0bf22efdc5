#include "estimator/diagnosis/gain_rule.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/format.h"
#include "core/linear_algebra.h"
#include "estimator/diagnosis/score_test.h"
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
    if (IsUnconfirmed(round) && round.withdrawn.empty()) names.push_back(round.added);
  }
  return names;
}

bool WithdrawByAllFrames(const Calibration& of_all_frames, double significance,
                         std::vector<DiagnosisRound>* rounds) {
  if (of_all_frames.effects == nullptr) return false;
  std::string least;
  double least_p = significance;
  for (const DiagnosisRound& round : *rounds) {
    if (round.added.empty() || !round.withdrawn.empty()) continue;
    std::vector<Eigen::Index> at;  // of all its shapes
    for (const EffectSet::Item& item : of_all_frames.effects->items()) {
      if (item.entry->name != round.added) continue;
      for (int k = 0; k < item.effect->size(); ++k) at.push_back(item.first + k);
    }
    if (at.empty() || std::any_of(rounds->begin(), rounds->end(), [&](const DiagnosisRound& other) {
          return other.added == round.added && ShowsGain(other);
        })) {
      continue;
    }
    const double p = ChiSquareTail(SquaredMahalanobis(of_all_frames.effect_values(at),
                                                      of_all_frames.effect_covariance(at, at)),
                                   static_cast<double>(at.size()));
    if (p > least_p) {
      least_p = p;
      least = round.added;
    }
  }
  if (least.empty()) return false;
  for (DiagnosisRound& round : *rounds) {
    if (round.added != least) continue;
    round.withdrawn = Format(
        "unseen frames do not show it, and the fit of all frames does not bear it out (p = %.2g)",
        least_p);
  }
  return true;
}

}  // namespace camgyro
