// A calibration in the files of other programs: one file of this folder per program.
//
// What each program means by time, with t_d and t_r as in core/calibration.h (t_d of row 0):
//   - kalibr, euroc, json: the stamp is row 0's: t_d as it is, line delay or readout beside it.
//   - vins, openvins: the stamp is the middle row's: t_d + t_r / 2.
//   - gyroflow: the stamp is the middle row's, and its offset is subtracted from the video's time
//     where ours is added: -(t_d + t_r / 2).
// Rotations: R_gyro_cam is q_gyro_cam as a matrix, camera vectors into the gyro (IMU) frame.
#ifndef CAMGYRO_TOOLS_EXPORT_EXPORT_H_
#define CAMGYRO_TOOLS_EXPORT_EXPORT_H_

#include <optional>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"

namespace camgyro {

struct ExportInput {
  std::string source;  // name of the calibration file, for comments
  Calibration calibration;
  // Brings noise densities, rates, and the samples of a gyro log. Without it: typical values,
  // marked.
  std::optional<Recording> recording;
};

struct ExportedFile {
  std::string name;  // relative to the output folder
  std::string text;
};

struct ExportFormat {
  std::string name;     // as in --format
  std::string program;  // whose files these are
  std::vector<ExportedFile> (*make)(const ExportInput& input);
};

// All formats, in the order of the help.
const std::vector<ExportFormat>& ExportFormats();

// camchain-imucam.yaml, imu.yaml.
std::vector<ExportedFile> ExportKalibr(const ExportInput& input);
// vins_mono.yaml.
std::vector<ExportedFile> ExportVinsMono(const ExportInput& input);
// vins_fusion.yaml, cam0_pinhole.yaml.
std::vector<ExportedFile> ExportVinsFusion(const ExportInput& input);
// estimator_config.yaml, kalibr_imucam_chain.yaml, kalibr_imu_chain.yaml.
std::vector<ExportedFile> ExportOpenVins(const ExportInput& input);
// lens_profile.json, sync.gyroflow; with a recording gyro.gcsv, in the axes of the camera.
std::vector<ExportedFile> ExportGyroflow(const ExportInput& input);
// cam0/sensor.yaml, imu0/sensor.yaml: also camgyro's own initial guess.
std::vector<ExportedFile> ExportEuroc(const ExportInput& input);
// calibration.json: everything, covariance included.
std::vector<ExportedFile> ExportJson(const ExportInput& input);

// Delay of the row in the middle of the picture, v = h / 2 [s].
inline double MiddleRowDelayS(const Calibration& c) { return c.delay_s + 0.5 * c.readout_s; }

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_EXPORT_EXPORT_H_
