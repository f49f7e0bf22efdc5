// Columns that are read one after the other instead of rows. (Rows from bottom to top are a
// negative readout time, which needs no effect: see estimator/diagnosis/.)
//
// Image sensors are wider than high, and are read row by row: a picture that is higher than wide
// was most likely turned after it had been read, as apps for phones in portrait do. So the effect
// is part of the model for such pictures, beside the readout of the rows, and the data say which of
// the two it is.
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
  EffectEntry entry = WithOneShape<ReadoutDirection>(
      {"readout_direction", ModelPart::kShutterClock,
       "the sensor is not read row by row from top to bottom: it is turned, or reads backwards",
       "use the sign of the readout time; for columns, turn the picture by 90 degrees before use"},
      "columns", NeedsPixels);
  entry.found_at_start = [](const EffectSetup& setup) {
    return setup.has_pixels && setup.size_px.y() > setup.size_px.x();
  };
  entry.start_note =
      "the picture is higher than wide, as if turned after it was read: its columns may have been "
      "read one after the other, and readout_direction is part of the model";
  return entry;
}

}  // namespace camgyro
