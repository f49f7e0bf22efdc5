#include "estimator/window/settle_effects.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "estimator/window/estimation_input.h"

namespace camgyro {

void RemakeEffects(const Recording& recording, Calibration* calibration) {
  auto set = std::make_shared<EffectSet>();
  const EffectSetup setup = MakeEffectSetup(recording, *calibration);
  for (const auto& item : calibration->effects->items()) {
    EffectSet::Item own = item;
    if (own.effect->depends_on_calibration()) {
      if (own.entry->shape_by_fit) {
        own.shape =
            own.entry->shape_by_fit(own.shape, calibration->effect_values.data() + own.first);
      }
      own.effect = own.entry->make(setup, own.shape);
    }
    set->Add(own);
  }
  calibration->effects = set;
}

bool HasToSettle(const Calibration& c) {
  if (c.effects == nullptr) return false;
  return std::any_of(
      c.effects->items().begin(), c.effects->items().end(),
      [&](const EffectSet::Item& item) { return item.effect->depends_on_calibration(); });
}

Refined SettleEffects(const Recording& recording, Refined fit, const Refit& refit) {
  constexpr int kMostTimes = 5;
  for (int i = 0; i < kMostTimes && HasToSettle(fit.calibration); ++i) {
    Refined from = fit;
    RemakeEffects(recording, &from.calibration);
    Result<Refined> better = refit(from);
    if (!better) break;
    const Calibration& c = better->calibration;
    const StateVector moved = Difference(c, from.calibration).cwiseQuotient(c.sigma());
    const Eigen::VectorXd effects_moved =
        (c.effect_values - from.calibration.effect_values)
            .cwiseQuotient(c.effect_covariance.diagonal().cwiseSqrt());
    fit = *std::move(better);
    if (std::max(moved.cwiseAbs().maxCoeff(), effects_moved.cwiseAbs().maxCoeff()) < 0.1) break;
  }
  return fit;
}

}  // namespace camgyro
