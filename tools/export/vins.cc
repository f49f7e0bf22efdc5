// VINS-Mono and VINS-Fusion: the keys of their config/euroc files.
//
// Both add td to the picture's stamp: "image clock + td = real image clock (IMU clock)".
// VINS-Mono's ProjectionTdFactor moves a feature of row v by (td + rolling_shutter_tr / h * (v - h
// / 2)) * its velocity, so td is the middle row's, and rolling_shutter_tr the time of a whole
// picture (some of its configuration files say "per line"; the code divides by the rows).
// VINS-Fusion has no rolling shutter: one time for all rows, for which the middle row's is the
// best.
#include "tools/export/config_text.h"
#include "tools/export/export.h"

namespace camgyro {
namespace {

constexpr char kPinhole[] = R"(model_type: PINHOLE
camera_name: camera
image_width: @width@
image_height: @height@
distortion_parameters:
   k1: @k1@
   k2: @k2@
   p1: @k3@
   p2: @k4@
projection_parameters:
   fx: @fx@
   fy: @fy@
   cx: @cx@
   cy: @cy@
)";

// camodocal counts the coefficients from that of theta^1, which is 1.
constexpr char kKannalaBrandt[] = R"(model_type: KANNALA_BRANDT
camera_name: camera
image_width: @width@
image_height: @height@
projection_parameters:
   k2: @k1@
   k3: @k2@
   k4: @k3@
   k5: @k4@
   mu: @fx@
   mv: @fy@
   u0: @cx@
   v0: @cy@
)";

constexpr char kTracking[] = R"(
# features
max_cnt: 150
min_dist: 30
freq: 10
F_threshold: 1.0
show_track: 1
)";

constexpr char kSolver[] = R"(
# optimisation
max_solver_time: 0.04
max_num_iterations: 8
keyframe_parallax: 10.0

# noise of the IMU, which camgyro does not estimate; VINS likes it larger than the data sheet's
acc_n: 0.1
gyr_n: 0.01
acc_w: 0.001
gyr_w: 0.0001
g_norm: 9.81
)";

constexpr char kMonoHead[] = R"(%YAML:1.0
# VINS-Mono. Made by `camgyro export` from @source@.
# Time: t_imu = t_image + td + rolling_shutter_tr * (v - h / 2) / h for row v of h: td is the middle
# row's, half a readout later than camgyro's delay of row 0 (@delay@ s).
imu_topic: "/imu0"
image_topic: "/cam0/image_raw"
output_path: "output/"

)";

constexpr char kMonoExtrinsic[] = R"(
# 1: the rotation is estimated by camgyro, the translation is not; VINS refines both.
estimate_extrinsic: 1
# camera vectors into the IMU frame
extrinsicRotation: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: @R_imu_cam@
extrinsicTranslation: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [0, 0, 0]
)";

constexpr char kMonoTail[] = R"(
# time
estimate_td: 1
td: @middle_delay@  # [s] middle row
rolling_shutter: @rolling@
rolling_shutter_tr: @readout@  # [s] whole picture, first to last row; negative: bottom to top

equalize: 1
fisheye: 0
loop_closure: 0
load_previous_pose_graph: 0
fast_relocalization: 0
pose_graph_save_path: "output/pose_graph/"
save_image: 0
visualize_imu_forward: 0
visualize_camera_size: 0.4
)";

constexpr char kFusion[] = R"(%YAML:1.0
# VINS-Fusion, one camera. Made by `camgyro export` from @source@.
# Time: t_imu = t_image + td for the whole picture: td is the middle row's, half a readout later
# than camgyro's delay of row 0 (@delay@ s). VINS-Fusion has no rolling shutter; the readout
# is @readout@ s.
imu: 1
num_of_cam: 1
imu_topic: "/imu0"
image0_topic: "/cam0/image_raw"
output_path: "output/"
cam0_calib: "@camera_file@"
image_width: @width@
image_height: @height@

# 1: the rotation is estimated by camgyro, the translation is not; VINS refines both.
estimate_extrinsic: 1
# camera vectors into the IMU (body) frame
body_T_cam0: !!opencv-matrix
   rows: 4
   cols: 4
   dt: d
   data: @T_imu_cam@

multiple_thread: 1
)";

constexpr char kFusionTail[] = R"(
# time
estimate_td: 1
td: @middle_delay@  # [s] middle row

load_previous_pose_graph: 0
pose_graph_save_path: "output/pose_graph/"
save_image: 0
)";

// Name and text of the camera's file.
std::pair<std::string, std::string> CameraOf(const Calibration& c) {
  if (c.distortion_model == DistortionModel::kKannalaBrandt) {
    return {"cam0_kannala_brandt.yaml", kKannalaBrandt};
  }
  return {"cam0_pinhole.yaml", kPinhole};
}

}  // namespace

std::vector<ExportedFile> ExportVinsMono(const ExportInput& input) {
  auto values = CommonValues(input);
  values["R_imu_cam"] = RowMajor(input.calibration.q_gyro_cam.toRotationMatrix());
  values["rolling"] = input.calibration.readout_s == 0.0 ? "0" : "1";
  return {{"vins_mono.yaml", FillIn(kMonoHead + CameraOf(input.calibration).second +
                                        kMonoExtrinsic + kTracking + kSolver + kMonoTail,
                                    values)}};
}

std::vector<ExportedFile> ExportVinsFusion(const ExportInput& input) {
  auto values = CommonValues(input);
  values["T_imu_cam"] = RowMajor(Pose(input.calibration.q_gyro_cam));
  const auto [camera_file, camera] = CameraOf(input.calibration);
  values["camera_file"] = camera_file;
  return {
      {"vins_fusion.yaml",
       FillIn(std::string(kFusion) + kTracking + "flow_back: 1\n" + kSolver + kFusionTail, values)},
      {camera_file, FillIn("%YAML:1.0\n---\n" + camera, values)}};
}

}  // namespace camgyro
