// Kalibr: camchain-imucam.yaml and imu.yaml (github.com/ethz-asl/kalibr/wiki/yaml-formats;
// `line_delay` as kalibr_calibrate_rs_cameras writes it since pull request 416).
#include "tools/export/config_text.h"
#include "tools/export/export.h"

namespace camgyro {
namespace {

constexpr char kCamchain[] =
    R"(# Made by `camgyro export` from @source@.
# Time: t_imu = t_cam + timeshift_cam_imu for row 0 of the picture; row v is exposed line_delay * v
# later. A program that takes the whole picture at once needs the shift of the middle row instead:
# timeshift_cam_imu: @middle_delay@
# T_cam_imu: IMU vectors into the camera frame (x right, y down, z forward). Its translation is not
# estimated: zero.
cam0:
  camera_model: pinhole
  intrinsics: @intrinsics@  # fu, fv, pu, pv [px]
  distortion_model: @distortion_model@
  distortion_coeffs: @distortion@  # @distortion_names@
  resolution: [@width@, @height@]
  line_delay: @line_delay@  # [s] per row; negative: bottom to top
  timeshift_cam_imu: @delay@  # [s] of row 0
  T_cam_imu:
@T_cam_imu@  cam_overlaps: []
  rostopic: /cam0/image_raw
)";

constexpr char kKalibrImu[] =
    R"(# Made by `camgyro export` from @source@.
# Noise of the IMU, which camgyro does not estimate.
gyroscope_noise_density: @gyro_noise@  # [rad/s/sqrt(Hz)] @gyro_noise_origin@
gyroscope_random_walk: @gyro_walk@  # [rad/s^2/sqrt(Hz)] @gyro_walk_origin@
accelerometer_noise_density: @accel_noise@  # [m/s^2/sqrt(Hz)] @accel_noise_origin@
accelerometer_random_walk: @accel_walk@  # [m/s^3/sqrt(Hz)] @accel_walk_origin@
update_rate: @imu_rate@  # [Hz] @imu_rate_origin@
rostopic: /imu0
)";

}  // namespace

std::vector<ExportedFile> ExportKalibr(const ExportInput& input) {
  auto values = CommonValues(input);
  values["T_cam_imu"] = Rows(Pose(input.calibration.q_gyro_cam.conjugate()), "  - ");
  return {{"camchain-imucam.yaml", FillIn(kCamchain, values)},
          {"imu.yaml", FillIn(kKalibrImu, values)}};
}

}  // namespace camgyro
