// EuRoC/ASL: cam0/sensor.yaml and imu0/sensor.yaml, the layout of docs/recording_format.md. Put
// into a recording, they are camgyro's own initial guess.
#include "tools/export/config_text.h"
#include "tools/export/export.h"

namespace camgyro {
namespace {

constexpr char kCamera[] = R"(# Made by `camgyro export` from @source@.
sensor_type: camera
comment: calibrated by camgyro
# T_BS: camera vectors into the body frame, which is the gyro's. Its translation is not estimated.
T_BS:
  cols: 4
  rows: 4
  data: @T_BS@
@rate@resolution: [@width@, @height@]
camera_model: pinhole
intrinsics: @intrinsics@  # fu, fv, cu, cv [px]
distortion_model: @distortion_model@
distortion_coefficients: @distortion_list@
# Not EuRoC's: t_gyro = t_camera + timeshift_cam_imu + readout_time * v / h for row v of h.
readout_time: @readout@  # [s] first to last row; negative: bottom to top
timeshift_cam_imu: @delay@  # [s] of row 0
)";

constexpr char kEurocImu[] = R"(# Made by `camgyro export` from @source@.
sensor_type: imu
comment: noise is not estimated by camgyro
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
rate_hz: @imu_rate@  # @imu_rate_origin@
gyroscope_noise_density: @gyro_noise@  # [rad/s/sqrt(Hz)] @gyro_noise_origin@
gyroscope_random_walk: @gyro_walk@  # [rad/s^2/sqrt(Hz)] @gyro_walk_origin@
accelerometer_noise_density: @accel_noise@  # [m/s^2/sqrt(Hz)] @accel_noise_origin@
accelerometer_random_walk: @accel_walk@  # [m/s^3/sqrt(Hz)] @accel_walk_origin@
)";

}  // namespace

std::vector<ExportedFile> ExportEuroc(const ExportInput& input) {
  const Calibration& c = input.calibration;
  const bool distorted = c.distortion_model != DistortionModel::kNone;
  auto values = CommonValues(input);
  values["T_BS"] = RowMajor(Pose(c.q_gyro_cam));
  values["rate"] = input.recording
                       ? "rate_hz: " + Number(1.0 / MedianInterval(input.recording->frames)) +
                             "  # from the recording\n"
                       : "";
  if (c.distortion_model == DistortionModel::kRadTan) {
    values["distortion_model"] = "radial-tangential";
  } else if (!distorted) {
    values["distortion_model"] = "none";
  }
  values["distortion_list"] = distorted ? values["distortion"] : "[]";
  return {{"cam0/sensor.yaml", FillIn(kCamera, values)},
          {"imu0/sensor.yaml", FillIn(kEurocImu, values)}};
}

}  // namespace camgyro
