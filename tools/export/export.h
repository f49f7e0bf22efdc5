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

#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

struct ExportInput {
  std::string source;  // name of the calibration file, for comments
  Calibration calibration;
  // Brings noise densities, rates, and the samples of a gyro log. Without it: typical values,
  // marked. Outlives the input.
  const Recording* recording = nullptr;
};

struct ExportedFile {
  std::string name;  // relative to the output folder
  std::string text;
};

struct ExportFormat {
  std::string name;     // as in --format
  std::string program;  // whose files these are
  std::vector<ExportedFile> (*make)(const ExportInput& input);
  std::string without_recording;  // a note where there is no recording; empty: nothing is lost
};

// All formats, in the order of the help. A new one is a file of this folder and a row of the table
// in export.cc.
const std::vector<ExportFormat>& ExportFormats();

// The format of this name. Error: kBadUsage, with the names that there are.
Result<ExportFormat> FindExportFormat(const std::string& name);

// The column `name`, or `program`, of all formats, separated by commas.
std::string ExportFormatNames();
std::string ExportPrograms();

// Delay of the row in the middle of the picture, v = h / 2 [s].
inline double MiddleRowDelayS(const Calibration& c) { return c.delay_s + 0.5 * c.readout_s; }

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_EXPORT_EXPORT_H_
