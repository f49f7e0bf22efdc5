// A lens group that moves against fast rotation.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/effects/entries.h"

namespace camgyro {
namespace {

// A stabiliser: the corner frequency below which it lets the picture turn, and how far its lens
// goes, as an angle of the picture. A Pixel's log (docs/lab/device_logs.md) has 0.5 Hz, 0.025 rad.
struct Stabiliser {
  double corner_hz = 0.0;
  double travel_rad = std::numeric_limits<double>::infinity();
};

// The shape of an effect is CORNER or CORNER/TRAVEL.
std::optional<Stabiliser> StabiliserOf(const std::string& shape) {
  Stabiliser s;
  char* end = nullptr;
  s.corner_hz = std::strtod(shape.c_str(), &end);
  if (shape.empty() || !(s.corner_hz > 0.0)) return std::nullopt;
  if (*end == '/') {
    s.travel_rad = std::strtod(end + 1, &end);
    if (!(s.travel_rad > 0.0)) return std::nullopt;
  }
  if (*end != 0) return std::nullopt;
  return s;
}

// The angle that the lens makes up for at the gyro's samples, about the camera's x and y axes
// [rad]: angle' = omega - 2 pi corner angle, exact for rates that are linear between samples up to
// the second order of the step, and never further from zero than the lens goes, in any direction:
// what is beyond is lost, so that the lens leaves its stop as soon as the camera turns back.
Eigen::Matrix2Xd StabilisedAngle(const EffectSetup& setup, const Stabiliser& s) {
  const double a = 2.0 * M_PI * s.corner_hz;
  const std::vector<double>& times_s = setup.gyro->times_s;
  const auto n = static_cast<Eigen::Index>(times_s.size());
  if (n == 0) return Eigen::Matrix2Xd(2, 0);
  const Eigen::Vector3d mean = setup.gyro->values.rowwise().mean();  // the bias, nearly
  const Eigen::Matrix3Xd omega =
      setup.R_gyro_cam.transpose() * (setup.gyro->values.colwise() - mean);
  Eigen::Matrix2Xd angle = Eigen::Matrix2Xd::Zero(2, n);
  for (Eigen::Index i = 1; i < n; ++i) {
    const double dt = times_s[static_cast<size_t>(i)] - times_s[static_cast<size_t>(i) - 1];
    const double decay = std::exp(-a * dt);
    const Eigen::Vector2d input = 0.5 * (decay * omega.col(i - 1) + omega.col(i)).head<2>();
    angle.col(i) = decay * angle.col(i - 1) + dt * input;
    const double size = angle.col(i).norm();
    if (size > s.travel_rad) angle.col(i) *= s.travel_rad / size;
  }
  return angle;
}

// The picture shifts in proportion to the stabilised angle, by gain * f [px per rad]. Stabilisers
// have gains of 0.3 and more: a few px per rad are something else.
class OpticalStabilisation final : public Effect {
 public:
  OpticalStabilisation(const EffectSetup& setup, const Stabiliser& stabiliser)
      : Effect({{"shift_per_rad", "px/rad", 500.0, 30.0, 1e4}}),
        gyro_(setup.gyro),
        delays_s_(setup.frame_delays_s),
        readout_s_(setup.readout_s),
        angle_(StabilisedAngle(setup, stabiliser)) {
    for (const FrameTime& frame : setup.frames) stamps_s_.push_back(frame.stamp_s);
    delays_s_.resize(stamps_s_.size(), setup.delay_s);
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
  const Eigen::Matrix2Xd angle_;
};

// Where the lens reaches no stop, one is as good as another.
std::vector<std::string> ShapesFor(const EffectSetup& setup) {
  // Those of phones go 1 to 2 degrees; the lens is at its stop for at least so much of the time.
  constexpr double kAtStop = 0.05;
  if (!setup.has_pixels) return {};
  std::vector<std::string> shapes = {"0.15", "1", "0.5"};
  const Eigen::RowVectorXd size =
      StabilisedAngle(setup, {0.5, std::numeric_limits<double>::infinity()}).colwise().norm();
  for (const char* stop : {"0.5/0.015", "0.5/0.04", "0.5/0.025"}) {
    const Stabiliser s = *StabiliserOf(stop);
    const auto beyond = static_cast<double>((size.array() > s.travel_rad).count());
    if (beyond > kAtStop * static_cast<double>(size.size())) shapes.emplace_back(stop);
  }
  return shapes;
}

}  // namespace

// Shapes: the corner frequency in Hz, and how far the lens goes in rad, if it has stops. That of a
// Pixel is the last, which --effects=optical_stabilisation takes.
EffectEntry OpticalStabilisationEntry() {
  EffectEntry entry = {"optical_stabilisation", ModelPart::kLens,
                       "the lens moves against fast rotation, so that the picture turns less "
                       "than the camera",
                       "switch the optical stabilisation off; else the principal point is a "
                       "function of time, and only slow rotation shows the focal length"};
  entry.leads_astray = true;
  entry.shapes = ShapesFor;
  entry.make = [](const EffectSetup& setup,
                  const std::string& shape) -> std::shared_ptr<const Effect> {
    const std::optional<Stabiliser> stabiliser = StabiliserOf(shape);
    if (!setup.has_pixels || !stabiliser) return nullptr;
    return std::make_shared<OpticalStabilisation>(setup, *stabiliser);
  };
  return entry;
}

}  // namespace camgyro
