#include "tools/export/export.h"

// One row per format: its name in --format, the program, the function of its file in this folder,
// what is lost without a recording.
#define CAMGYRO_EXPORT_FORMATS(ROW)                                                                \
  ROW("kalibr", "Kalibr", ExportKalibr, "")                                                        \
  ROW("vins_mono", "VINS-Mono", ExportVinsMono, "")                                                \
  ROW("vins_fusion", "VINS-Fusion", ExportVinsFusion, "")                                          \
  ROW("openvins", "OpenVINS", ExportOpenVins, "")                                                  \
  ROW("gyroflow", "Gyroflow", ExportGyroflow,                                                      \
      "no gyro.gcsv without --recording; the offset is then for a log whose times are the gyro's " \
      "stamps and a video whose times are the camera's")                                           \
  ROW("euroc", "EuRoC/ASL sensor.yaml", ExportEuroc, "")                                           \
  ROW("json", "plain JSON", ExportJson, "")

namespace camgyro {

#define CAMGYRO_DECLARE(name, program, make, note) \
  std::vector<ExportedFile> make(const ExportInput& input);
CAMGYRO_EXPORT_FORMATS(CAMGYRO_DECLARE)
#undef CAMGYRO_DECLARE

namespace {

std::string Column(std::string ExportFormat::*column) {
  std::string text;
  for (const ExportFormat& format : ExportFormats()) {
    text += (text.empty() ? "" : ", ") + format.*column;
  }
  return text;
}

}  // namespace

const std::vector<ExportFormat>& ExportFormats() {
#define CAMGYRO_ROW(name, program, make, note) {name, program, make, note},
  static const std::vector<ExportFormat> formats = {CAMGYRO_EXPORT_FORMATS(CAMGYRO_ROW)};
#undef CAMGYRO_ROW
  return formats;
}

Result<ExportFormat> FindExportFormat(const std::string& name) {
  for (const ExportFormat& format : ExportFormats()) {
    if (format.name == name) return format;
  }
  return BadUsage("--format=" + name + ": expected one of " + ExportFormatNames());
}

std::string ExportFormatNames() { return Column(&ExportFormat::name); }
std::string ExportPrograms() { return Column(&ExportFormat::program); }

}  // namespace camgyro
