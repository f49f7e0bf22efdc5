// The picture averages over its exposure.
#include <algorithm>
#include <cmath>

#include "core/effects/entries.h"
#include "core/effects/rate_derivatives.h"

namespace camgyro {
namespace {

// Over an exposure T, the mean of where a point is seen is off its place in the middle by T^2/24 of
// its acceleration, so that the picture turns as rate + T^2/24 rate''. Trackers that follow an edge
// of the blur are off by up to twice as much. In the model, the gyro reads less than the picture
// turns by that: the column of gyro_lowpass, with the other sign.
class ExposureLowpass final : public Effect {
 public:
  // recorded: the parameter is a factor of the squares of the recorded exposures, else T^2.
  ExposureLowpass(const EffectSetup& setup, bool recorded)
      : Effect(recorded ? std::vector<EffectParameter>{{"factor_sq", "", 4.0, 0.0, 4.0}}
                        : std::vector<EffectParameter>{{"exposure_sq", "s^2", 2e-3, 0.0, 4e-3}}),
        derivatives_(setup) {
    const auto n = static_cast<Eigen::Index>(derivatives_.gyro().times_s.size());
    squares_.setOnes(n);
    if (!recorded) return;
    // Of the frame that is exposed, or the next one.
    size_t frame = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double time_s = derivatives_.gyro().times_s[static_cast<size_t>(i)];
      while (frame + 1 < setup.frames.size() &&
             setup.frames[frame].stamp_s + DelayOf(setup, frame) < time_s) {
        ++frame;
      }
      squares_[i] = setup.frames[frame].exposure_s * setup.frames[frame].exposure_s;
    }
  }
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    const Eigen::Index at = derivatives_.IndexAt(time_s);
    if (at >= 0) columns = -squares_[at] / 12.0 * derivatives_.At(at).row(2).transpose();
  }

 private:
  static double DelayOf(const EffectSetup& setup, size_t frame) {
    return frame < setup.frame_delays_s.size() ? setup.frame_delays_s[frame] : setup.delay_s;
  }

  const RateDerivatives derivatives_;
  Eigen::VectorXd squares_;  // by sample [s^2], or ones
};

bool ExposuresRecorded(const EffectSetup& setup) {
  return std::all_of(setup.frames.begin(), setup.frames.end(), [](const FrameTime& frame) {
    return std::isfinite(frame.exposure_s) && frame.exposure_s > 0.0;
  });
}

constexpr char kRecorded[] = "recorded", kConstant[] = "constant";

}  // namespace

// Shapes: recorded (times the recorded exposures), else constant (one exposure for all frames).
EffectEntry ExposureLowpassEntry() {
  EffectEntry entry = {"exposure_lowpass", ModelPart::kRate,
                       "the picture averages over its exposure, which attenuates fast rotation in "
                       "it",
                       "take pictures with a shorter exposure, or in more light"};
  entry.shapes = [](const EffectSetup& setup) {
    if (!setup.has_pixels || !RateDerivatives::Possible(setup)) return std::vector<std::string>{};
    return std::vector<std::string>{ExposuresRecorded(setup) ? kRecorded : kConstant};
  };
  entry.make = [](const EffectSetup& setup,
                  const std::string& shape) -> std::shared_ptr<const Effect> {
    if (!setup.has_pixels || !RateDerivatives::Possible(setup)) return nullptr;
    if (shape == kConstant) return std::make_shared<ExposureLowpass>(setup, false);
    if (shape != kRecorded || !ExposuresRecorded(setup)) return nullptr;
    return std::make_shared<ExposureLowpass>(setup, true);
  };
  return entry;
}

}  // namespace camgyro
