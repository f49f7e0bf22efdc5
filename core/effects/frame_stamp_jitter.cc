// Frame stamps that scatter around the camera's clock: every frame has a time of its own.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

class FrameStampJitter final : public Effect {
 public:
  // A fit begins at 3 ms, which is what phones show that stamp a frame when it arrives.
  explicit FrameStampJitter(const EffectSetup&) : Effect({{"spread", "s", 3e-3, 0.0, 30e-3}}) {}
  bool frees_frame_times() const override { return true; }
};

}  // namespace

EffectEntry FrameStampJitterEntry() {
  EffectEntry entry = WithOneShape<FrameStampJitter>(
      {"frame_stamp_jitter",
       ModelPart::kShutterClock,
       "the frames' stamps scatter around the times at which they were taken, each by an amount of "
       "its own",
       "stamp frames where they are taken (the sensor's own timestamp), not where they arrive; for "
       "this recording, use the repaired times of its frames",
       {},
       {}},
      "spread", AlwaysShown);
  // An attitude says too little of its own time.
  entry.found_at_start = [](const EffectSetup& setup) {
    return setup.has_pixels && setup.frame_stamp_jitter_s > 0.0;
  };
  return entry;
}

}  // namespace camgyro
