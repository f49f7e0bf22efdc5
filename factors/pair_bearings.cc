#include "factors/pair_bearings.h"

#include <algorithm>

#include "factors/rotation_manifold.h"

namespace camgyro {

void HoldRays(const double* lens, const double* shutter, const double* effects,
              PairMeasurement* pair) {
  pair->rays_a.clear();
  pair->rays_b.clear();
  if (pair->effects && pair->effects->follows_own_time()) return;
  const Eigen::Map<const LensParameters> lens_at(lens);
  const Eigen::Map<const ShutterParameters> shutter_at(shutter);
  const PairEffects effects_at{pair->effects.get(), effects};
  const auto evaluate = [&](const FrameTime& frame, const Eigen::Vector2d& px, TimedRay* ray) {
    return EvaluateTimedRay(*pair->lens, lens_at, shutter_at, frame, pair->size_px, px, effects_at,
                            ray);
  };
  std::vector<TimedRay> a(pair->matches.size()), b(pair->matches.size());
  for (size_t i = 0; i < pair->matches.size(); ++i) {
    if (!evaluate(pair->frame_a, pair->matches[i].px_a, &a[i]) ||
        !evaluate(pair->frame_b, pair->matches[i].px_b, &b[i])) {
      return;
    }
  }
  pair->rays_a = std::move(a);
  pair->rays_b = std::move(b);
}

BearingsOfMatch::BearingsOfMatch(const PairMeasurement& pair, const RotationChain& chain,
                                 const double* lens, const double* shutter,
                                 const double* q_gyro_cam, const double* effects,
                                 const double* const* own_times)
    : pair_(pair),
      chain_(chain),
      lens_(Eigen::Map<const LensParameters>(lens)),
      shutter_(Eigen::Map<const ShutterParameters>(shutter)),
      R_gyro_cam_(Eigen::Map<const Eigen::Quaterniond>(q_gyro_cam).normalized().toRotationMatrix()),
      effects_{pair.effects.get(), effects},
      later_a_s_(own_times ? *own_times[0] : 0.0),
      later_b_s_(own_times ? *own_times[1] : 0.0),
      frame_a_(pair.frame_a.Moved(later_a_s_)),
      frame_b_(pair.frame_b.Moved(later_b_s_)) {}

bool BearingsOfMatch::Evaluate(size_t match, bool derivatives, Bearing* a, Bearing* b) const {
  const Match& m = pair_.matches[match];
  if (!pair_.rays_a.empty()) {
    TurnRay(pair_.rays_a[match], later_a_s_, R_gyro_cam_, chain_, a);
    TurnRay(pair_.rays_b[match], later_b_s_, R_gyro_cam_, chain_, b);
    b->ScaleNoise(m.noise_factor_b);
    return true;
  }
  const LensDerivatives by_lens = derivatives ? pair_.by_lens : LensDerivatives::kNone;
  if (!EvaluateBearing(*pair_.lens, lens_, shutter_, R_gyro_cam_, chain_, frame_a_, pair_.size_px,
                       m.px_a, effects_, a, by_lens) ||
      !EvaluateBearing(*pair_.lens, lens_, shutter_, R_gyro_cam_, chain_, frame_b_, pair_.size_px,
                       m.px_b, effects_, b, by_lens)) {
    return false;
  }
  b->ScaleNoise(m.noise_factor_b);
  return true;
}

bool EvaluatePairBearings(const PairMeasurement& pair, const RotationChain& chain,
                          const double* lens, const double* shutter, const double* q_gyro_cam,
                          const double* effects, bool derivatives, PairBearings* bearings,
                          const double* const* own_times) {
  const BearingsOfMatch of_match(pair, chain, lens, shutter, q_gyro_cam, effects, own_times);
  const size_t n = pair.matches.size();
  bearings->a.resize(n);
  bearings->b.resize(n);
  for (size_t i = 0; i < n; ++i) {
    if (!of_match.Evaluate(i, derivatives, &bearings->a[i], &bearings->b[i])) return false;
  }
  return true;
}

Eigen::Matrix3Xd GatherRates(const std::vector<int>& group_sizes, const double* const* groups) {
  int total = 0;
  for (const int size : group_sizes) total += size;
  Eigen::Matrix3Xd rates(3, total);
  int column = 0;
  for (size_t g = 0; g < group_sizes.size(); ++g) {
    rates.middleCols(column, group_sizes[g]) =
        Eigen::Map<const Eigen::Matrix3Xd>(groups[g], 3, group_sizes[g]);
    column += group_sizes[g];
  }
  return rates;
}

Eigen::Matrix3Xd GatherRates(const PairMeasurement& pair, const double* const* groups) {
  if (pair.rate_step == 1 && pair.rate_base.cols() == 0) {
    return GatherRates(pair.rate_group_sizes, groups);
  }
  Eigen::Matrix3Xd rates = pair.rate_base;
  int column = 0;
  for (size_t g = 0; g < pair.rate_group_sizes.size(); ++g) {
    const Eigen::Map<const Eigen::Matrix3Xd> values(groups[g], 3, pair.num_rate_values(g));
    for (int i = 0; i < pair.rate_group_sizes[g]; ++i) {
      rates.col(column++) += values.col(i / pair.rate_step);
    }
  }
  return rates;
}

std::vector<int> PairMeasurement::RateValues() const {
  std::vector<int> values;
  values.reserve(rate_times_s.size());
  int first = 0;
  for (size_t g = 0; g < rate_group_sizes.size(); ++g) {
    for (int i = 0; i < rate_group_sizes[g]; ++i) values.push_back(first + i / rate_step);
    first += num_rate_values(g);
  }
  return values;
}

RotationChain ChainOf(const PairMeasurement& pair, const double* const* groups) {
  return {pair.rate_times_s, GatherRates(pair, groups), pair.RateValues()};
}

void PairRow::Write(int row, double scale, const double* q_gyro_cam, const PairMeasurement& pair,
                    int first_rate_group, double** jacobians) const {
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 1, kLensSize>>(jacobians[0] + row * kLensSize) =
        scale * gradient_.by_lens;
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 1, kShutterSize>>(jacobians[1] + row * kShutterSize) =
        scale * gradient_.by_shutter;
  }
  if (jacobians[2] != nullptr) {
    Eigen::Map<Eigen::RowVector4d>(jacobians[2] + row * 4) =
        scale * RotationManifold::Lift(gradient_.by_rotation, q_gyro_cam);
  }
  const int effects_block = first_rate_group - NumTimeBlocks(pair) - 1;
  if (pair.effects && jacobians[effects_block] != nullptr) {
    const int size = pair.effects->size();
    Eigen::Map<Eigen::RowVectorXd>(jacobians[effects_block] + row * size, size) =
        scale * gradient_.by_effects;
  }
  int column = 0;
  for (size_t g = 0; g < pair.rate_group_sizes.size(); ++g) {
    const int values = pair.num_rate_values(g);
    if (double* jacobian = jacobians[static_cast<size_t>(first_rate_group) + g]) {
      Eigen::Map<Eigen::Matrix3Xd>(jacobian + row * 3 * values, 3, values) =
          scale * by_rates_.middleCols(column, values);
    }
    column += values;
  }
}

}  // namespace camgyro
