// What the files of the effects share: entries with one shape.
#ifndef CAMGYRO_CORE_EFFECTS_SHAPES_H_
#define CAMGYRO_CORE_EFFECTS_SHAPES_H_

#include <memory>
#include <string>
#include <utility>

#include "core/effects/effect.h"

namespace camgyro {

// Sets `shapes` and `make` of an entry whose effect E(setup) has a single shape, for recordings
// where `can_show` is true.
template <typename E, typename CanShow>
EffectEntry WithOneShape(EffectEntry entry, const std::string& shape, CanShow can_show) {
  entry.shapes = [=](const EffectSetup& setup) {
    return can_show(setup) ? std::vector<std::string>{shape} : std::vector<std::string>{};
  };
  entry.make = [=](const EffectSetup& setup,
                   const std::string& asked) -> std::shared_ptr<const Effect> {
    if (asked != shape || !can_show(setup)) return nullptr;
    return std::make_shared<E>(setup);
  };
  return entry;
}

inline bool NeedsPixels(const EffectSetup& setup) { return setup.has_pixels; }
inline bool AlwaysShown(const EffectSetup& /*setup*/) { return true; }

// An entry whose effect has no parameters: a fault of the data, or a refusal.
inline EffectEntry WithoutShape(EffectEntry entry) {
  entry.shapes = [](const EffectSetup&) { return std::vector<std::string>{}; };
  entry.make = [](const EffectSetup&, const std::string&) { return nullptr; };
  return entry;
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_SHAPES_H_
