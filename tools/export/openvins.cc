// OpenVINS: estimator_config.yaml, kalibr_imucam_chain.yaml, kalibr_imu_chain.yaml, with the keys
// of its config/rpng_sim. OpenVINS has no rolling shutter; its time offset (calib_camimu_dt) shifts
// the whole picture, for which the middle row's is the best. Settings that camgyro knows nothing
// about are those of rpng_sim.
#include "tools/export/config_text.h"
#include "tools/export/export.h"

namespace camgyro {
namespace {

constexpr char kImuCam[] = R"(%YAML:1.0
# Made by `camgyro export` from @source@.
# Time: t_imu = t_cam + timeshift_cam_imu for the whole picture: of its middle row, half a readout
# later than camgyro's delay of row 0 (@delay@ s). OpenVINS has no rolling shutter; the readout
# is @readout@ s.
# T_imu_cam: camera vectors into the IMU frame. Its translation is not estimated: zero.
cam0:
  T_imu_cam:
@T_imu_cam@  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: @distortion@  # @distortion_names@
  distortion_model: @distortion_model@
  intrinsics: @intrinsics@  # fu, fv, cu, cv [px]
  resolution: [@width@, @height@]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: @middle_delay@  # [s] middle row
)";

constexpr char kOpenVinsImu[] = R"(%YAML:1.0
# Made by `camgyro export` from @source@.
# Noise of the IMU, which camgyro does not estimate.
imu0:
  T_i_b:
@identity4@  accelerometer_noise_density: @accel_noise@  # [m/s^2/sqrt(Hz)] @accel_noise_origin@
  accelerometer_random_walk: @accel_walk@  # [m/s^3/sqrt(Hz)] @accel_walk_origin@
  gyroscope_noise_density: @gyro_noise@  # [rad/s/sqrt(Hz)] @gyro_noise_origin@
  gyroscope_random_walk: @gyro_walk@  # [rad/s^2/sqrt(Hz)] @gyro_walk_origin@
  rostopic: /imu0
  time_offset: 0.0
  update_rate: @imu_rate@  # [Hz] @imu_rate_origin@
  model: "kalibr"
  Tw:
@identity3@  R_IMUtoGYRO:
@identity3@  Ta:
@identity3@  R_IMUtoACC:
@identity3@  Tg:
@zero3@)";

constexpr char kEstimator[] = R"(%YAML:1.0
# Made by `camgyro export` from @source@.
verbosity: "INFO"

use_fej: true
integration: "rk4"
use_stereo: false
max_cameras: 1

# The translation between camera and IMU is not known: let OpenVINS find it.
calib_cam_extrinsics: true
calib_cam_intrinsics: true
calib_cam_timeoffset: true
calib_imu_intrinsics: false
calib_imu_g_sensitivity: false

max_clones: 11
max_slam: 50
max_slam_in_update: 25
max_msckf_in_update: 40
dt_slam_delay: 2
gravity_mag: 9.81
feat_rep_msckf: "GLOBAL_3D"
feat_rep_slam: "ANCHORED_MSCKF_INVERSE_DEPTH"
feat_rep_aruco: "ANCHORED_MSCKF_INVERSE_DEPTH"

try_zupt: false
zupt_chi2_multipler: 0
zupt_max_velocity: 0.1
zupt_noise_multiplier: 10
zupt_max_disparity: 0.5
zupt_only_at_beginning: false

init_window_time: 2.0
init_imu_thresh: 1.5
init_max_disparity: 10.0
init_max_features: 50
init_dyn_use: true
init_dyn_mle_opt_calib: false
init_dyn_mle_max_iter: 50
init_dyn_mle_max_time: 0.05
init_dyn_mle_max_threads: 6
init_dyn_num_pose: 6
init_dyn_min_deg: 10.0
init_dyn_inflation_ori: 10
init_dyn_inflation_vel: 100
init_dyn_inflation_bg: 10
init_dyn_inflation_ba: 100
init_dyn_min_rec_cond: 1e-12
init_dyn_bias_g: @bias@  # [rad/s] camgyro's; subtracted from the measured rates, as here
init_dyn_bias_a: [0.0, 0.0, 0.0]

record_timing_information: false
record_timing_filepath: "/tmp/traj_timing.txt"
save_total_state: false
filepath_est: "/tmp/ov_estimate.txt"
filepath_std: "/tmp/ov_estimate_std.txt"
filepath_gt: "/tmp/ov_groundtruth.txt"

use_klt: true
num_pts: 200
fast_threshold: 20
grid_x: 5
grid_y: 5
min_px_dist: 10
knn_ratio: 0.70
track_frequency: 31.0
downsample_cameras: false
num_opencv_threads: 4
histogram_method: "HISTOGRAM"
use_aruco: false
num_aruco: 1024
downsize_aruco: true

up_msckf_sigma_px: 1
up_msckf_chi2_multipler: 1
up_slam_sigma_px: 1
up_slam_chi2_multipler: 1
up_aruco_sigma_px: 1
up_aruco_chi2_multipler: 1
use_mask: false

relative_config_imu: "kalibr_imu_chain.yaml"
relative_config_imucam: "kalibr_imucam_chain.yaml"
)";

}  // namespace

std::vector<ExportedFile> ExportOpenVins(const ExportInput& input) {
  const Eigen::Vector3d& bias = input.calibration.bias_gyro_rad_s;
  auto values = CommonValues(input);
  values["T_imu_cam"] = Rows(Pose(input.calibration.q_gyro_cam), "    - ");
  values["identity4"] = Rows(Eigen::Matrix4d::Identity(), "    - ");
  values["identity3"] = Rows(Eigen::Matrix3d::Identity(), "    - ");
  values["zero3"] = Rows(Eigen::Matrix3d::Zero(), "    - ");
  values["bias"] = List({bias.x(), bias.y(), bias.z()});
  return {{"estimator_config.yaml", FillIn(kEstimator, values)},
          {"kalibr_imucam_chain.yaml", FillIn(kImuCam, values)},
          {"kalibr_imu_chain.yaml", FillIn(kOpenVinsImu, values)}};
}

}  // namespace camgyro
