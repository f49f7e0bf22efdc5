// A lens group that moves against fast rotation.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/effects/entries.h"
#include "core/optical_stabiliser.h"

namespace camgyro {
namespace {

// The angle that the lens makes up for at the gyro's samples (core/optical_stabiliser.h).
Eigen::Matrix2Xd AngleAtSamples(const EffectSetup& setup, const OpticalStabiliser& stabiliser) {
  const Eigen::Matrix3Xd& values = setup.gyro->values;
  if (values.cols() == 0) return Eigen::Matrix2Xd(2, 0);
  const Eigen::Vector3d mean = values.rowwise().mean();  // the bias, nearly
  return StabilisedAngle(setup.gyro->times_s,
                         setup.R_gyro_cam.transpose() * (values.colwise() - mean), stabiliser);
}

// The picture shifts in proportion to the stabilised angle, by gain * f [px per rad]. Stabilisers
// have gains of 0.3 and more: a few px per rad are something else.
class OpticalStabilisation final : public Effect {
 public:
  OpticalStabilisation(const EffectSetup& setup, const OpticalStabiliser& stabiliser)
      : Effect({{"shift_per_rad", "px/rad", 500.0, 30.0, 1e4}}),
        gyro_(setup.gyro),
        delays_s_(setup.frame_delays_s),
        readout_s_(setup.readout_s),
        found_px_per_rad_(setup.stabiliser ? setup.stabiliser_px_per_rad : 0.0),
        angle_(AngleAtSamples(setup, stabiliser)) {
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
  void SetStart(double* values) const override { *values = found_px_per_rad_; }

 private:
  const std::shared_ptr<const SensorSamples> gyro_;
  std::vector<double> stamps_s_, delays_s_;  // of the frames
  const double readout_s_;
  const double found_px_per_rad_;
  const Eigen::Matrix2Xd angle_;
};

// That which the start has found, if it has. Else several: where the lens reaches no stop, one is
// as good as another.
std::vector<std::string> ShapesFor(const EffectSetup& setup) {
  // Those of phones go 1 to 2 degrees; the lens is at its stop for at least so much of the time.
  constexpr double kAtStop = 0.05;
  if (!setup.has_pixels || setup.lens_is_held) return {};
  if (setup.stabiliser) return {NameOf(*setup.stabiliser)};
  std::vector<std::string> shapes = {"0.15", "1", "0.5"};
  const Eigen::RowVectorXd size =
      AngleAtSamples(setup, {0.5, std::numeric_limits<double>::infinity()}).colwise().norm();
  for (const char* stop : {"0.5/0.015", "0.5/0.04", "0.5/0.025"}) {
    const OpticalStabiliser s = *StabiliserOf(stop);
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
    const std::optional<OpticalStabiliser> stabiliser = StabiliserOf(shape);
    if (!setup.has_pixels || !stabiliser) return nullptr;
    return std::make_shared<OpticalStabilisation>(setup, *stabiliser);
  };
  return entry;
}

}  // namespace camgyro
