// A lens group that moves against fast rotation.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/effects/entries.h"
#include "core/format.h"
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

// Derivative of that angle by a change of the stabiliser.
Eigen::Matrix2Xd ByChange(const EffectSetup& setup, const OpticalStabiliser& stabiliser,
                          double step,
                          const std::function<void(double, OpticalStabiliser*)>& change) {
  OpticalStabiliser more = stabiliser, less = stabiliser;
  change(step, &more);
  change(-step, &less);
  return (AngleAtSamples(setup, more) - AngleAtSamples(setup, less)) / (2.0 * step);
}

// By time, where the lens follows late [rad/s].
Eigen::Matrix2Xd ByTime(const std::vector<double>& times_s, const Eigen::Matrix2Xd& angle) {
  Eigen::Matrix2Xd rate = Eigen::Matrix2Xd::Zero(2, angle.cols());
  for (Eigen::Index i = 1; i + 1 < angle.cols(); ++i) {
    const double from_s = times_s[static_cast<size_t>(i) - 1];
    rate.col(i) =
        (angle.col(i + 1) - angle.col(i - 1)) / (times_s[static_cast<size_t>(i) + 1] - from_s);
  }
  return rate;
}

// Of the parameters, those that the shape's numbers take up.
enum { kOfShift = 0, kOfCorner = 1, kOfStop = 5 };

std::vector<EffectParameter> ParametersOf(const OpticalStabiliser& stabiliser) {
  // Stabilisers have gains of 0.3 and more: a few px per rad are something else. The rest of a
  // lens's shift, 500 px per rad or so: a corner and a stop within a factor of 1.6 of the shape, a
  // lag of 5 ms, and a tenth of it across, or more about x than about y.
  constexpr double kShift = 500.0, kAnother = 250.0, kLag = 2.5, kTenth = 50.0, kAny = 1e4;
  constexpr double kOffCentre_px = 5.0;
  std::vector<EffectParameter> parameters = {{"shift_per_rad", "px/rad", kShift, 30.0, kAny},
                                             {"corner_change", "px/rad", kAnother, -kAny, kAny},
                                             {"lag", "px s/rad", kLag, -kAny, kAny},
                                             {"cross_axis", "px/rad", kTenth, -kAny, kAny},
                                             {"axis_difference", "px/rad", kTenth, -kAny, kAny}};
  if (std::isfinite(stabiliser.travel_rad)) {
    parameters.push_back({"stop_change", "px/rad", kAnother, -kAny, kAny});
    parameters.push_back({"stop_centre_x", "px", kOffCentre_px, -kAny, kAny});
    parameters.push_back({"stop_centre_y", "px", kOffCentre_px, -kAny, kAny});
  }
  return parameters;
}

// The picture shifts in proportion to the stabilised angle, by gain * f [px per rad]. Corner and
// stop of the shape are not quite those of the lens: to first order, the shift times the relative
// (logarithmic) change of each is a parameter as well. So are a lag, axes that are turned or of
// different gains, and stops that are off the centre, all of which the lens of a Pixel has.
class OpticalStabilisation final : public Effect {
 public:
  OpticalStabilisation(const EffectSetup& setup, const OpticalStabiliser& stabiliser)
      : Effect(ParametersOf(stabiliser)),
        gyro_(setup.gyro),
        delays_s_(setup.frame_delays_s),
        readout_s_(setup.readout_s),
        found_px_per_rad_(setup.stabiliser ? setup.stabiliser_px_per_rad : 0.0),
        angles_({AngleAtSamples(setup, stabiliser)}) {
    constexpr double kLog = 0.02, kOffCentre = 0.001;
    angles_.push_back(ByChange(setup, stabiliser, kLog, [](double step, OpticalStabiliser* s) {
      s->corner_hz *= std::exp(step);
    }));
    angles_.push_back(-ByTime(gyro_->times_s, angles_[0]));
    angles_.push_back(Eigen::Matrix2Xd(2, angles_[0].cols()));
    angles_.back() << -angles_[0].row(1), angles_[0].row(0);
    angles_.push_back(Eigen::Vector2d(1.0, -1.0).asDiagonal() * angles_[0]);
    if (std::isfinite(stabiliser.travel_rad)) {
      angles_.push_back(ByChange(setup, stabiliser, kLog, [](double step, OpticalStabiliser* s) {
        s->travel_rad *= std::exp(step);
      }));
      for (const Eigen::Index axis : {0, 1}) {
        angles_.push_back(
            ByChange(setup, stabiliser, kOffCentre,
                     [axis](double step, OpticalStabiliser* s) { s->centre_rad[axis] += step; }));
      }
    }
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
    for (int k = 0; k < size(); ++k) {
      const Eigen::Matrix2Xd& at = angles_[static_cast<size_t>(k)];
      const Eigen::Vector2d angle = (1.0 - u) * at.col(i - 1) + u * at.col(i);
      columns(kCx, k) = angle.y();
      columns(kCy, k) = -angle.x();
    }
  }
  bool depends_on_calibration() const override { return true; }
  bool hides_turns() const override { return true; }
  void SetStart(double* values) const override { values[kOfShift] = found_px_per_rad_; }

 private:
  const std::shared_ptr<const SensorSamples> gyro_;
  std::vector<double> stamps_s_, delays_s_;  // of the frames
  const double readout_s_;
  const double found_px_per_rad_;
  std::vector<Eigen::Matrix2Xd> angles_;  // of each parameter
};

// The shape of a lens whose shift was logged: how late the log is, in seconds, after a slash. A log
// that is more than this late is of something else.
constexpr char kLogged[] = "logged";
constexpr double kMostLate_s = 0.1;

std::string NameOfLogged(double late_s) {
  const double whole_us = std::round(1e6 * late_s);
  return whole_us == 0.0 ? kLogged : kLogged + Format("/%.6g", 1e-6 * whole_us);
}

// How late a log of such a shape is; nothing for the name of another shape.
std::optional<double> LateOf(const std::string& shape) {
  if (shape == kLogged) return 0.0;
  const std::string begin = std::string(kLogged) + "/";
  if (shape.compare(0, begin.size(), begin) != 0) return std::nullopt;
  char* end = nullptr;
  const double late_s = std::strtod(shape.c_str() + begin.size(), &end);
  const bool good = shape.size() > begin.size() && *end == 0 && std::abs(late_s) <= kMostLate_s;
  return good ? std::optional<double>(late_s) : std::nullopt;
}

// The lens was where the log has it, but for its unit, how late the log is, and how the sensor lies
// to its axes. Nothing of it depends on the gyro.
class LoggedLens final : public Effect {
 public:
  enum { kScale, kLate, kCross, kDifference, kSize };

  LoggedLens(const EffectSetup& setup, double late_s)
      : Effect({{"logged_scale", "1", 1.0, 0.3, 3.0},
                {"log_lag", "s", 0.01, -kMostLate_s, kMostLate_s},
                {"cross_axis", "1", 0.1, -1.0, 1.0},
                {"axis_difference", "1", 0.1, -1.0, 1.0}}),
        shift_(setup.lens_shift),
        readout_s_(setup.readout_s),
        late_s_(late_s) {}
  void ChangeLens(const Observation& o, LensColumns columns) const override {
    const double t = o.frame.stamp_s + o.frame.offset_s + readout_s_ * o.px.y() / o.size_px.y();
    const Eigen::Vector2d shift = shift_->At(t + late_s_);
    columns.middleRows<2>(kCx) << shift, shift_->RateAt(t + late_s_),
        Eigen::Vector2d(-shift.y(), shift.x()), Eigen::Vector2d(shift.x(), -shift.y());
  }
  bool depends_on_calibration() const override { return true; }  // the readout time
  bool follows_own_time() const override { return true; }
  void SetStart(double* values) const override { values[kScale] = 1.0; }

 private:
  const std::shared_ptr<const LensShift> shift_;
  const double readout_s_, late_s_;
};

// That which was logged, or that which the start has found, if it has. Else those of a Pixel:
// without its stop, and with it, where the motion is so large.
std::vector<std::string> ShapesFor(const EffectSetup& setup) {
  const OpticalStabiliser pixel = {0.5, 0.025};
  constexpr double kAtStop = 0.05;  // the lens is there for at least so much of the time
  if (!setup.has_pixels) return {};
  if (setup.lens_shift) return {kLogged};
  if (setup.lens_is_held) return {};
  if (setup.stabiliser) return {NameOf(*setup.stabiliser)};
  const OpticalStabiliser without = {pixel.corner_hz};
  std::vector<std::string> shapes = {NameOf(without)};
  const Eigen::RowVectorXd size = AngleAtSamples(setup, without).colwise().norm();
  const auto beyond = static_cast<double>((size.array() > pixel.travel_rad).count());
  if (beyond > kAtStop * static_cast<double>(size.size())) shapes.push_back(NameOf(pixel));
  return shapes;
}

// The stabiliser that a fit says, or how late it says the log is: the shape with the changes that
// the values are. A fit far from the lens is no measure of it, so that changes are bounded, and it
// is asked again from there.
std::string ShapeByFit(const std::string& shape, double* values) {
  constexpr double kMostLog = 0.5;
  constexpr double kLeastShift_px = 1.0;  // per rad
  constexpr double kLeastScale = 0.1;     // of a log
  if (const std::optional<double> late_s = LateOf(shape)) {
    if (!(values[LoggedLens::kScale] > kLeastScale)) return shape;
    const double more_s =
        std::exchange(values[LoggedLens::kLate], 0.0) / values[LoggedLens::kScale];
    return NameOfLogged(std::clamp(*late_s + more_s, -kMostLate_s, kMostLate_s));
  }
  std::optional<OpticalStabiliser> s = StabiliserOf(shape);
  if (!s || !(values[kOfShift] > kLeastShift_px)) return shape;
  const auto factor = [&](double change) {
    return std::exp(std::clamp(change / values[kOfShift], -kMostLog, kMostLog));
  };
  s->corner_hz = std::clamp(s->corner_hz * factor(values[kOfCorner]), 0.05, 5.0);
  values[kOfCorner] = 0.0;
  if (std::isfinite(s->travel_rad)) {
    s->travel_rad = std::clamp(s->travel_rad * factor(values[kOfStop]), 0.005, 0.2);
    values[kOfStop] = 0.0;
  }
  return NameOf(*s);
}

}  // namespace

// Shapes: the corner frequency in Hz, and how far the lens goes in rad, if it has stops; or
// `logged`, with how late the log is.
EffectEntry OpticalStabilisationEntry() {
  EffectEntry entry = {"optical_stabilisation", ModelPart::kLens,
                       "the lens moves against fast rotation, so that the picture turns less "
                       "than the camera",
                       "switch the optical stabilisation off; else the principal point is a "
                       "function of time, and only slow rotation shows the focal length"};
  entry.leads_astray = true;
  entry.shapes = ShapesFor;
  entry.shape_by_fit = ShapeByFit;
  entry.found_at_start = [](const EffectSetup& setup) {
    return setup.has_pixels && setup.lens_shift != nullptr;
  };
  entry.make = [](const EffectSetup& setup,
                  const std::string& shape) -> std::shared_ptr<const Effect> {
    if (const std::optional<double> late_s = LateOf(shape)) {
      if (!setup.has_pixels || !setup.lens_shift) return nullptr;
      return std::make_shared<LoggedLens>(setup, *late_s);
    }
    const std::optional<OpticalStabiliser> stabiliser = StabiliserOf(shape);
    if (!setup.has_pixels || !stabiliser) return nullptr;
    return std::make_shared<OpticalStabilisation>(setup, *stabiliser);
  };
  return entry;
}

}  // namespace camgyro
