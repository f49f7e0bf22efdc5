// One effect of the catalogue: a way in which cameras and gyros differ from the plain model, as a
// change, mostly linear, of one part of the measurement function (docs/architecture.md).
#ifndef CAMGYRO_CORE_EFFECTS_EFFECT_H_
#define CAMGYRO_CORE_EFFECTS_EFFECT_H_

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/lens.h"
#include "core/lens_shift.h"
#include "core/optical_stabiliser.h"

namespace camgyro {

// The part of the measurement function that an effect changes; kPicture: what was recorded is not
// what the lens imaged, so that no parameter repairs it.
enum class ModelPart { kLens, kShutterClock, kRate, kBaseline, kPicture };

struct EffectParameter {
  std::string name;
  std::string unit;
  double spread;  // standard deviation of a weak prior around zero (no effect)
  double plausible_min, plausible_max;  // what real devices show
};

// A frame, as effects of the clock may depend on it. Seconds after the first gyro stamp.
struct FrameTime {
  double stamp_s;         // recorded, camera clock
  double exposure_s;      // NaN: not recorded
  double offset_s = 0.0;  // of the frame's own time from its stamp, where that is estimated
  FrameTime(double stamp = 0.0, double exposure = std::numeric_limits<double>::quiet_NaN())
      : stamp_s(stamp), exposure_s(exposure) {}
  FrameTime Moved(double by_s) const {
    FrameTime moved = *this;
    moved.offset_s += by_s;
    return moved;
  }
};

// One observed pixel.
struct Observation {
  Eigen::Vector2d px;
  Eigen::Vector2d size_px;  // width, height of the picture
  FrameTime frame;
};

// What every pair of frames has of its own, with a prior of its own width.
enum class PairLatent {
  kTurn,  // of the translation direction [rad/s], factors/coplanarity_plane.h
};

// Columns: the parameters. What one unit of each changes:
using LensColumns = Eigen::Ref<Eigen::Matrix<double, kLensSize, Eigen::Dynamic>>;  // lens block
// Row 0: time of exposure [s]; rows 1, 2: its derivative by the pixel's u, v [s/px].
using TimeColumns = Eigen::Ref<Eigen::Matrix<double, 3, Eigen::Dynamic>>;
using RateColumns = Eigen::Ref<Eigen::Matrix3Xd>;  // the gyro's reading [rad/s]

// Parameters zero: no effect. Functions write their columns, which come zeroed.
class Effect {
 public:
  explicit Effect(std::vector<EffectParameter> parameters) : parameters_(std::move(parameters)) {}
  virtual ~Effect() = default;
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  const std::vector<EffectParameter>& parameters() const { return parameters_; }
  int size() const { return static_cast<int>(parameters_.size()); }

  virtual void ChangeLens(const Observation& /*observation*/, LensColumns /*columns*/) const {}
  // Derivatives of ChangeLens by the pixel's u and v, where it depends on the pixel: noise of the
  // pixel goes through them.
  virtual void ChangeLensSlope(const Observation& /*observation*/, LensColumns /*by_u*/,
                               LensColumns /*by_v*/) const {}
  virtual bool has_lens_slope() const { return false; }
  virtual void ChangeTime(const Observation& /*observation*/, TimeColumns /*columns*/) const {}
  // omega: true rate at that time, gyro frame [rad/s].
  virtual void ChangeRate(double /*time_gyro_s*/, const Eigen::Vector3d& /*omega_gyro_rad_s*/,
                          RateColumns /*columns*/) const {}
  // The change at parameters `values` [rad/s], and in the columns its derivatives by them: for
  // effects that are linear only while they are small, which override this one.
  virtual Eigen::Vector3d ChangeRateBy(double time_gyro_s, const Eigen::Vector3d& omega_gyro_rad_s,
                                       const double* values, RateColumns columns) const {
    ChangeRate(time_gyro_s, omega_gyro_rad_s, columns);
    return columns.lazyProduct(Eigen::Map<const Eigen::VectorXd>(values, size()));
  }
  // Derivative of the changed reading by the true rate, less the identity, at parameters `values`.
  virtual Eigen::Matrix3d RateByRate(const double* /*values*/) const {
    return Eigen::Matrix3d::Zero();
  }
  // The change of the lens is the same for every pixel and all the time: a part of the lens block.
  virtual bool is_constant_lens() const { return false; }
  // Made from a calibration so exactly that it is to be made anew when that has moved.
  virtual bool depends_on_calibration() const { return false; }
  // What it changes depends on the frame's own time (FrameTime::offset_s), not on its stamp alone.
  virtual bool follows_own_time() const { return false; }
  // Made of the gyro's rates, it takes turns of the camera out of the picture: rotations between
  // pictures then tell no focal length.
  virtual bool hides_turns() const { return false; }
  // An effect without parameters, that of every pair's latents instead: the standard deviation
  // which it needs their prior to have, in the latent's unit; 0: as it is.
  virtual double widened_sigma(PairLatent /*latent*/) const { return 0.0; }
  bool widens_prior() const { return widened_sigma(PairLatent::kTurn) > 0.0; }
  // Where a fit begins, if not at zero: `values` has size() of them, zero.
  virtual void SetStart(double* /*values*/) const {}
  // Stamp of the first frame on which it acts [s], for effects that EffectEntry::step_at makes.
  virtual std::optional<double> first_stamp_s() const { return std::nullopt; }
  // Every frame has a time of its own, and the only parameter is their spread [s]: no residual
  // depends on it, and it is estimated from the times themselves (estimator/window/frame_times.h).
  virtual bool frees_frame_times() const { return false; }

 private:
  const std::vector<EffectParameter> parameters_;
};

// Vectors of a sensor over time, one column per time.
struct SensorSamples {
  std::vector<double> times_s;  // after the first gyro stamp
  Eigen::Matrix3Xd values;
};

// What an effect may know of the recording that it is made for.
struct EffectSetup {
  Eigen::Vector2d size_px = Eigen::Vector2d::Zero();
  std::vector<FrameTime> frames;  // at least two
  // Never null. Effects that look up in them keep the pointer: an hour's copy would be 23 MB.
  std::shared_ptr<const SensorSamples> gyro =  // readings [rad/s]
      std::make_shared<SensorSamples>();
  std::shared_ptr<const SensorSamples> accel =  // specific force in the gyro frame [m/s^2], or none
      std::make_shared<SensorSamples>();
  double delay_s = 0.0, readout_s = 0.0;  // as far as they are known
  double clock_skew = 0.0;                // that the start has found [s/s]; 0: none
  // A lens that follows the camera's turns, if the start has found one, and its shift [px/rad]; or
  // the start has seen that the lens is held.
  std::optional<OpticalStabiliser> stabiliser;
  double stabiliser_px_per_rad = 0.0;
  bool lens_is_held = false;
  // Where a stabilised lens was, logged; times as the frames' stamps. Null: nobody logged it.
  std::shared_ptr<const LensShift> lens_shift;
  // Standard deviation of the frames' stamps around a clock where they are times of arrival [s]; 0:
  // they are not, or nobody has looked.
  double frame_stamp_jitter_s = 0.0;
  std::vector<double> frame_delays_s;  // of each frame with the effects on time; empty: delay_s
  Eigen::Matrix3d R_gyro_cam = Eigen::Matrix3d::Identity();
  bool has_pixels = true;  // false: attitudes
  double edge_rad = 1.0;   // angle between the axis and a corner of the picture, about
  DistortionModel distortion_model = DistortionModel::kNone;  // declared
  double division_lambda = 0.0;  // of a lens that nothing declares (CameraGuess::division_lambda)

  // The frames' span on the gyro clock [s].
  double from_s() const { return frames.front().stamp_s + delay_s; }
  double to_s() const { return frames.back().stamp_s + delay_s; }
};

// An effect with the name of its shape.
struct ShapedEffect {
  std::string shape;
  std::shared_ptr<const Effect> effect;  // null: there is none such
};

// An entry of the catalogue. What diagnosis does with an effect beyond its columns stands here and
// in Effect: the loop knows no effect by its name.
struct EffectEntry {
  std::string name;
  ModelPart part;
  std::string explanation;  // one sentence for people: what it is
  std::string advice;       // what to do about it
  // Shapes that this recording can show, by name, the usual one last (it is taken where none is
  // asked for); empty where it has not what the effect needs. Effects without parameters of their
  // own have none.
  std::function<std::vector<std::string>(const EffectSetup&)> shapes = {};
  // The effect in a shape (also one with a number that shapes() does not list, where the entry's
  // file says so); null if there is no such shape here.
  std::function<std::shared_ptr<const Effect>(const EffectSetup&, const std::string& shape)> make =
      {};
  // For an effect whose shape has numbers that a fit tells better: the shape by the values of a fit
  // with it (as many as the effect's parameters, which become what they are in the new shape). Null
  // for all others.
  std::function<std::string(const std::string& shape, double* values)> shape_by_fit = {};
  // For an effect that changes t_d by a step and whose shape is the time of that step, which
  // diagnosis searches: the effect from the first frame on whose stamp is not before `stamp_s`.
  // Null for all others.
  std::function<ShapedEffect(const EffectSetup&, double stamp_s)> step_at = {};
  // What the start finds beyond doubt is in the model from then on. Null: it does not look for it.
  std::function<bool(const EffectSetup&)> found_at_start = {};
  // What a note then says of it, where the start itself says nothing.
  std::string start_note = {};
  // Several of it add up, as steps do; of others, one shape takes the place of another.
  bool adds_up = false;
  // At sizes that real devices have, the plain model without it is so far off that its linear
  // gain says little: where a fit has gone astray, a refit with it is tried in any case.
  bool leads_astray = false;
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_EFFECT_H_
