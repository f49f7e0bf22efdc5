// Attitudes that were reconstructed from pictures of a rolling shutter as if all rows were of one
// time.
//
// While the camera turns by omega, a row v below the middle has turned on by omega k v, k the time
// between rows one focal length apart. Structure from motion, whose pose knows one time, takes that
// field for a rotation and a translation. Of yaw omega_y it makes the shear u = -k v omega_y, of
// which the share <v^2> / (<u^2> + <v^2>) is roll, whatever the depths; and roll omega_z it shows
// as yaw, of the other sign and about as much where the scene is a wall, whose yaw and sideways
// translation look alike, and not at all where depths are scattered. Pitch stretches the picture,
// which is no rotation. (Least squares of all six: docs/lab/attitudes.md.)
#include "core/effects/entries.h"
#include "core/effects/rate_derivatives.h"
#include "core/effects/shapes.h"

namespace camgyro {
namespace {

// The attitude is turned by e: about the camera's z by roll_by_yaw omega_y, and about its y by
// yaw_by_roll omega_z. So it turns by e' + omega x e faster than the camera, which is what the gyro
// reads. (The second part looks like a bias: docs/lab/attitudes.md.)
class AttitudeRollingShutter final : public Effect {
 public:
  explicit AttitudeRollingShutter(const EffectSetup& setup)
      : Effect({{"roll_by_yaw", "s", 0.01, -0.04, 0.04}, {"yaw_by_roll", "s", 0.01, -0.04, 0.04}}),
        derivatives_(setup),
        R_gyro_cam_(setup.R_gyro_cam) {}
  void ChangeRate(double time_s, const Eigen::Vector3d& omega_gyro_rad_s,
                  RateColumns columns) const override {
    const Eigen::Index at = derivatives_.IndexAt(time_s);
    if (at < 0) return;
    const Eigen::Vector3d omega = R_gyro_cam_.transpose() * omega_gyro_rad_s;
    const Eigen::Vector3d alpha = R_gyro_cam_.transpose() * derivatives_.At(at).row(1).transpose();
    const Eigen::Vector3d y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
    columns.col(0) = -R_gyro_cam_ * (alpha.y() * z + omega.y() * omega.cross(z));
    columns.col(1) = -R_gyro_cam_ * (alpha.z() * y + omega.z() * omega.cross(y));
  }

 private:
  const RateDerivatives derivatives_;
  const Eigen::Matrix3d R_gyro_cam_;
};

}  // namespace

EffectEntry AttitudeRollingShutterEntry() {
  return WithOneShape<AttitudeRollingShutter>(
      {"attitude_rolling_shutter", ModelPart::kRate,
       "yaw of the camera shows as roll in its attitudes, and roll as yaw: they were made from the "
       "rows of a rolling shutter as if all were of one time",
       "make the attitudes with a model of the rolling shutter"},
      "rows", [](const EffectSetup& setup) {
        return !setup.has_pixels && RateDerivatives::Possible(setup);
      });
}

}  // namespace camgyro
