// Columns that are read one after the other instead of rows. (Rows from bottom to top are a
// negative readout time, which needs no effect: see estimator/diagnosis/.)
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class ReadoutDirection final : public Effect {
 public:
  explicit ReadoutDirection(const EffectSetup&)
      : Effect({{"column_readout", "s", 0.02, -0.05, 0.05}}) {}
  void ChangeTime(const Observation& o, TimeColumns columns) const override {
    columns(0, 0) = o.px.x() / o.size_px.x();
    columns(1, 0) = 1.0 / o.size_px.x();
  }
};

}  // namespace

EffectEntry ReadoutDirectionEntry() {
  return WithOneShape<ReadoutDirection>(
      {"readout_direction", ModelPart::kShutterClock,
       "the sensor is not read row by row from top to bottom: it is turned, or reads backwards",
       "use the sign of the readout time; for columns, turn the picture by 90 degrees before use"},
      "columns", NeedsPixels);
}

}  // namespace camgyro
