// A lens group that moves against fast rotation.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "core/effects/entries.h"

namespace camgyro {
namespace {

// The picture shifts in proportion to the rotation above a corner frequency, about the camera's x
// and y axes: angle' = omega - 2 pi corner angle, exact for rates that are linear between samples
// up to the second order of the step. The shift is in px per rad: gain * f. Stabilisers have gains
// of 0.3 and more: a few px per rad are something else.
class OpticalStabilisation final : public Effect {
 public:
  OpticalStabilisation(const EffectSetup& setup, double corner_hz)
      : Effect({{"shift_per_rad", "px/rad", 500.0, 30.0, 1e4}}),
        gyro_(setup.gyro),
        delays_s_(setup.frame_delays_s),
        readout_s_(setup.readout_s) {
    for (const FrameTime& frame : setup.frames) stamps_s_.push_back(frame.stamp_s);
    delays_s_.resize(stamps_s_.size(), setup.delay_s);
    const double a = 2.0 * M_PI * corner_hz;
    const std::vector<double>& times_s = gyro_->times_s;
    const auto n = static_cast<Eigen::Index>(times_s.size());
    const Eigen::Vector3d mean = gyro_->values.rowwise().mean();  // the bias, nearly
    const Eigen::Matrix3Xd omega = setup.R_gyro_cam.transpose() * (gyro_->values.colwise() - mean);
    angle_.setZero(2, n);
    for (Eigen::Index i = 1; i < n; ++i) {
      const double dt = times_s[static_cast<size_t>(i)] - times_s[static_cast<size_t>(i) - 1];
      const double decay = std::exp(-a * dt);
      const Eigen::Vector2d input = 0.5 * (decay * omega.col(i - 1) + omega.col(i)).head<2>();
      angle_.col(i) = decay * angle_.col(i - 1) + dt * input;
    }
  }
  void ChangeLens(const Observation& o, LensColumns columns) const override {
    const auto frame = std::lower_bound(stamps_s_.begin(), stamps_s_.end(), o.frame.stamp_s);
    if (frame == stamps_s_.end()) return;
    const double delay_s = delays_s_[static_cast<size_t>(frame - stamps_s_.begin())];
    const double t = o.frame.stamp_s + delay_s + readout_s_ * o.px.y() / o.size_px.y();
    const std::vector<double>& times_s = gyro_->times_s;
    const auto next = std::lower_bound(times_s.begin(), times_s.end(), t);
    if (next == times_s.begin() || next == times_s.end()) return;
    const Eigen::Index i = next - times_s.begin();
    const double u = (t - *(next - 1)) / (*next - *(next - 1));
    const Eigen::Vector2d angle = (1.0 - u) * angle_.col(i - 1) + u * angle_.col(i);
    columns(kCx, 0) = angle.y();
    columns(kCy, 0) = -angle.x();
  }
  bool depends_on_calibration() const override { return true; }

 private:
  const std::shared_ptr<const SensorSamples> gyro_;
  std::vector<double> stamps_s_, delays_s_;  // of the frames
  const double readout_s_;
  Eigen::Matrix2Xd angle_;
};

}  // namespace

// Shapes: the corner frequency in Hz.
EffectEntry OpticalStabilisationEntry() {
  EffectEntry entry = {"optical_stabilisation", ModelPart::kLens,
                       "the lens moves against fast rotation, so that the picture turns less "
                       "than the camera",
                       "switch the optical stabilisation off; else the principal point is a "
                       "function of time, and only slow rotation shows the focal length"};
  entry.shapes = [](const EffectSetup& setup) {
    return setup.has_pixels ? std::vector<std::string>{"0.15", "0.5", "1"}
                            : std::vector<std::string>{};
  };
  entry.make = [](const EffectSetup& setup,
                  const std::string& shape) -> std::shared_ptr<const Effect> {
    char* end = nullptr;
    const double corner_hz = std::strtod(shape.c_str(), &end);
    if (!setup.has_pixels || shape.empty() || *end != 0 || !(corner_hz > 0.0)) return nullptr;
    return std::make_shared<OpticalStabilisation>(setup, corner_hz);
  };
  return entry;
}

}  // namespace camgyro
