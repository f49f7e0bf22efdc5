#include "pipeline/moving_lens.h"

#include <memory>
#include <utility>
#include <vector>

#include "core/effects/catalogue.h"
#include "estimator/window/estimation_input.h"
#include "pipeline/read_calibration.h"

namespace camgyro {
namespace {

constexpr char kStabilised[] = "optical_stabilisation";

tl::unexpected<Error> Stabilised(const std::string& where) {
  return BadInput(where +
                  ": the lens moves as the camera turns (optical_stabilisation), expected one that "
                  "does not; camgyro rectify takes that out of a recording");
}

}  // namespace

Status AddMovingLens(const std::string& file, const Recording& recording,
                     Calibration* calibration) {
  const Result<std::vector<ListedEffect>> listed = ReadEffects(file);
  if (!listed) return tl::unexpected(listed.error());
  EffectSet set;
  std::vector<double> values;
  for (const ListedEffect& effect : *listed) {
    const EffectEntry* const entry = FindEffect(effect.name);
    if (entry == nullptr || entry->part != ModelPart::kLens) continue;
    const Result<EffectSet> made =
        MakeEffects(effect.name + (effect.shape.empty() ? "" : ":" + effect.shape),
                    MakeEffectSetup(recording, *calibration));
    if (!made) {
      return BadInput(file + ": effects: " + effect.name +
                      ": not of this recording: " + made.error().message);
    }
    if (made->items().front().effect->is_constant_lens()) continue;
    if (made->size() != static_cast<int>(effect.values.size())) {
      return BadInput(file + ": effects: " + effect.name + ": has " +
                      std::to_string(effect.values.size()) + " parameters, expected " +
                      std::to_string(made->size()));
    }
    set.Add(made->items().front());
    values.insert(values.end(), effect.values.begin(), effect.values.end());
  }
  if (set.empty()) return {};
  calibration->effects = std::make_shared<const EffectSet>(std::move(set));
  calibration->effect_values =
      Eigen::VectorXd::Map(values.data(), static_cast<Eigen::Index>(values.size()));
  return {};
}

Status RefuseStabilisedLens(const std::string& file) {
  const Result<std::vector<ListedEffect>> listed = ReadEffects(file);
  if (!listed) return tl::unexpected(listed.error());
  for (const ListedEffect& effect : *listed) {
    if (effect.name == kStabilised) return Stabilised(file);
  }
  return {};
}

Status RefuseStabilisedLens(const Calibration& fit) {
  if (fit.effects && fit.effects->Has(kStabilised)) return Stabilised("calibration");
  return {};
}

}  // namespace camgyro
