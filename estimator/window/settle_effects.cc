#include "estimator/window/settle_effects.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "estimator/window/estimation_input.h"

namespace camgyro {
namespace {

// Makes those effects anew that depend on the calibration, in the shape that it says; false if
// there are none.
bool RemakeEffects(const Recording& recording, Calibration* calibration) {
  if (calibration->effects == nullptr) return false;
  auto set = std::make_shared<EffectSet>();
  bool remade = false;
  const EffectSetup setup = MakeEffectSetup(recording, *calibration);
  for (const auto& item : calibration->effects->items()) {
    EffectSet::Item own = item;
    if (own.effect->depends_on_calibration()) {
      if (own.entry->shape_by_fit) {
        own.shape =
            own.entry->shape_by_fit(own.shape, calibration->effect_values.data() + own.first);
      }
      own.effect = own.entry->make(setup, own.shape);
      remade = true;
    }
    set->Add(own);
  }
  calibration->effects = set;
  return remade;
}

}  // namespace

Refined SettleEffects(const Recording& recording, Refined fit, const Refit& refit) {
  constexpr int kMostTimes = 5;
  for (int i = 0; i < kMostTimes; ++i) {
    Refined from = fit;
    if (!RemakeEffects(recording, &from.calibration)) break;
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
