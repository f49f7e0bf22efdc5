// Gyroflow: lens_profile.json, sync.gyroflow (a project file with nothing but the offset) and, with
// a recording, gyro.gcsv (docs.gyroflow.xyz/app/technical-details/gcsv-format).
//
// Time, from its FrameTransform: row v of h is read at t - t_r / 2 + t_r v / h where t is the
// picture's time in the video, so t is the middle row's; the gyro's time is t - offset. With ours,
//   t_gyro = t + t_d + t_r / 2  =>  offset = -(t_d + t_r / 2),
// and less by what the two clocks' zeros differ: the video counts from its first picture, the log
// from its first sample.
//
// Axes, from its integrator (omega = (-g_y, g_x, g_z)) and the signs that FrameTransform puts on
// the rotation (those of diag(1, -1, -1)): orientation "XYZ" means
//   g = (-w_y, -w_x, -w_z) of a rate w in our camera frame (x right, y down, z forward),
// that is x up, y left, z to the user: an Android phone's axes when it is held in landscape.
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/time.h"
#include "tools/export/config_text.h"
#include "tools/export/export.h"

namespace camgyro {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kStandardGravity = 9.80665;

Eigen::Vector3d GyroflowAxes(const Eigen::Vector3d& cam) { return {-cam.y(), -cam.x(), -cam.z()}; }

Json LensProfile(const ExportInput& input) {
  const Calibration& c = input.calibration;
  const LensParameters& lens = c.lens;
  const bool wide = c.distortion_model == DistortionModel::kKannalaBrandt;
  const Eigen::Vector4d k = lens.segment<4>(FirstCoefficient(c.distortion_model));
  const Json size = {{"w", c.width_px}, {"h", c.height_px}};
  const double frame_s = input.recording ? MedianInterval(input.recording->frames) : 0.0;
  return {{"name", "camgyro " + std::to_string(c.width_px) + "x" + std::to_string(c.height_px)},
          {"note", "made by camgyro export from " + input.source},
          {"calibrated_by", "camgyro"},
          {"camera_brand", ""},
          {"camera_model", ""},
          {"lens_model", ""},
          {"camera_setting", ""},
          {"calib_dimension", size},
          {"orig_dimension", size},
          {"output_dimension", size},
          {"frame_readout_time", 1e3 * c.readout_s},  // [ms], negative: bottom to top
          {"gyro_lpf", nullptr},
          {"input_horizontal_stretch", 1.0},
          {"input_vertical_stretch", 1.0},
          {"num_images", 0},
          {"fps", frame_s > 0.0 ? 1.0 / frame_s : 0.0},
          {"crop", nullptr},
          {"official", false},
          {"asymmetrical", true},  // use the principal point
          {"fisheye_params",
           {{"RMS_error", 0.0},
            {"camera_matrix",
             {{lens[kFocal] * lens[kAspect], 0.0, lens[kCx]},
              {0.0, lens[kFocal], lens[kCy]},
              {0.0, 0.0, 1.0}}},
            {"distortion_coeffs", {k[0], k[1], k[2], k[3]}},
            {"radial_distortion_limit", nullptr}}},
          {"identifier", ""},
          {"calibrator_version", "camgyro"},
          {"date", ""},
          {"compatible_settings", Json::array()},
          {"distortion_model", wide ? "opencv_fisheye" : "opencv_standard"},
          {"global_shutter", c.readout_s == 0.0}};
}

// Bias removed, turned into the camera, and from there into Gyroflow's axes.
std::string GyroLog(const Calibration& c, const Recording& recording) {
  std::ostringstream out;
  out << "GYROFLOW IMU LOG\nversion,1.3\nid,camgyro\norientation,XYZ\n"
      << "note,made by camgyro export: in the camera's axes; without the bias; t counts from the "
         "first sample; the offset is in sync.gyroflow\n"
      << "frame_readout_time," << Number(1e3 * std::abs(c.readout_s)) << "\n"
      << "frame_readout_direction," << (c.readout_s < 0.0 ? 1 : 0) << "\n"
      << "tscale,0.000001\ngscale,1\nascale,1\n";
  // Accelerations only where they have the gyro's stamps, as a row needs both.
  const bool with_accel =
      recording.accel.size() == recording.gyro.size() &&
      std::equal(recording.gyro.begin(), recording.gyro.end(), recording.accel.begin(),
                 [](const GyroSample& gyro, const AccelSample& accel) {
                   return gyro.stamp_ns == accel.stamp_ns;
                 });
  out << (with_accel ? "t,gx,gy,gz,ax,ay,az\n" : "t,gx,gy,gz\n");
  const Eigen::Matrix3d R_cam_gyro = c.q_gyro_cam.toRotationMatrix().transpose();
  for (size_t i = 0; i < recording.gyro.size(); ++i) {
    const GyroSample& sample = recording.gyro[i];
    const Eigen::Vector3d g =
        GyroflowAxes(R_cam_gyro * (sample.omega_gyro_rad_s - c.bias_gyro_rad_s));
    out << std::llround(1e6 * SecondsSince(recording.gyro.front().stamp_ns, sample.stamp_ns));
    for (const double value : g) out << "," << Number(value);
    if (with_accel) {
      const Eigen::Vector3d a = GyroflowAxes(R_cam_gyro * recording.accel[i].accel_gyro_m_s2);
      for (const double value : a) out << "," << Number(value / kStandardGravity);
    }
    out << "\n";
  }
  return out.str();
}

}  // namespace

std::vector<ExportedFile> ExportGyroflow(const ExportInput& input) {
  const Calibration& c = input.calibration;
  double offset_s = -MiddleRowDelayS(c);
  if (input.recording) {
    offset_s -= SecondsSince(input.recording->gyro.front().stamp_ns,
                             input.recording->frames.front().stamp_ns);
  }
  const Json lens = LensProfile(input);
  // Keys of "offsets" are video times [us], values [ms].
  const Json sync = {{"title", "Gyroflow data file"},
                     {"version", 3},
                     {"calibration_data", lens},
                     {"gyro_source", {{"imu_orientation", "XYZ"}}},
                     {"offsets", {{"0", 1e3 * offset_s}}}};
  const auto dump = [](const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  };
  std::vector<ExportedFile> files = {{"lens_profile.json", dump(lens)},
                                     {"sync.gyroflow", dump(sync)}};
  if (input.recording) files.push_back({"gyro.gcsv", GyroLog(c, *input.recording)});
  return files;
}

}  // namespace camgyro
