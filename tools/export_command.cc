// `camgyro export CALIBRATION --format=FORMAT --out=DIR`: a calibration for other programs.
#include <gflags/gflags.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "frontend/readers/read_recording.h"
#include "pipeline/frame_times_file.h"
#include "pipeline/read_calibration.h"
#include "pipeline/result_files.h"
#include "tools/commands.h"
#include "tools/export/export.h"
#include "tools/summary.h"

DECLARE_string(out);
DECLARE_bool(quiet);
// gflags keeps the pointer.
static const std::string kFormatHelp = "one of " + camgyro::ExportFormatNames();
DEFINE_string(format, "", kFormatHelp.c_str());
DEFINE_string(recording, "",
              "the recording: noise densities and rates of its sensor.yaml and stamps; for "
              "gyroflow its gyro log");

namespace camgyro {
namespace {

std::string Join(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// What the files do not say, or say without grounds.
std::vector<std::string> Caveats(const ExportInput& input, const std::vector<ListedEffect>& effects,
                                 const ExportFormat& format) {
  std::vector<std::string> notes;
  std::vector<std::string> undetermined;
  for (size_t i = 0; i < kStateSize; ++i) {
    if (!input.calibration.determined[i]) undetermined.push_back(StateNames()[i]);
  }
  if (!undetermined.empty()) {
    notes.push_back("not determined by the motion, and exported as they are: " +
                    Join(undetermined));
  }
  // Those of the lens stand in the file's `camera` section, and so in the exports.
  std::vector<std::string> lost;
  for (const auto& [name, shape, values] : effects) {
    if (name != "radial_distortion" && name != "tangential_distortion" && name != "aspect_ratio") {
      lost.push_back(name);
    }
  }
  if (!lost.empty()) notes.push_back("effects that this format does not hold: " + Join(lost));
  if (!input.recording && !format.without_recording.empty()) {
    notes.push_back(format.without_recording);
  }
  return notes;
}

Status RunExport(const std::vector<std::string>& arguments) {
  const Result<ExportFormat> format = FindExportFormat(FLAGS_format);
  if (!format) return tl::unexpected(format.error());
  if (FLAGS_out.empty()) return BadUsage("--out: expected a folder to write into");
  FileSet files(FLAGS_out);
  if (Status writable = files.CheckWritable(); !writable) return writable;

  const Result<Calibration> calibration = ReadCalibration(arguments[0]);
  if (!calibration) return tl::unexpected(calibration.error());
  const Result<std::vector<ListedEffect>> effects = ReadEffects(arguments[0]);
  if (!effects) return tl::unexpected(effects.error());
  Recording of_densities;
  ExportInput input;
  input.source = std::filesystem::path(arguments[0]).filename().string();
  input.calibration = *calibration;
  if (!FLAGS_recording.empty()) {
    Result<Recording> recording = ReadRecording(FLAGS_recording);
    if (!recording) return tl::unexpected(recording.error());
    if (const Status read = ApplyFrameTimes(arguments[0], &*recording); !read) return read;
    const CameraGuess& camera = recording->camera;
    if (camera.width_px > 0 &&
        (camera.width_px != calibration->width_px || camera.height_px != calibration->height_px)) {
      return BadInput(FLAGS_recording + ": its pictures have " + std::to_string(camera.width_px) +
                      " x " + std::to_string(camera.height_px) + " pixels, but " + arguments[0] +
                      " is of " + std::to_string(calibration->width_px) + " x " +
                      std::to_string(calibration->height_px) + "; expected the same");
    }
    of_densities = std::move(*recording);
    input.recording = &of_densities;
  }

  std::vector<std::string> names;
  for (ExportedFile& file : format->make(input)) {
    names.push_back(file.name);
    files.Add(file.name, std::move(file.text));
  }
  if (Status written = files.Write(); !written) return written;
  if (FLAGS_quiet) return {};
  std::printf("%swritten    %s/%s for %s\n",
              Notes("note", Caveats(input, *effects, *format)).c_str(), files.folder().c_str(),
              Join(names).c_str(), format->program.c_str());
  return {};
}

}  // namespace

Command ExportCommand() {
  Command command;
  command.name = "export";
  command.arguments = "CALIBRATION";
  command.summary =
      "a calibration for other programs, into --out: " + ExportPrograms() + " (docs/export.md)";
  command.flags = {"format", "out", "recording", "quiet"};
  command.run = RunExport;
  return command;
}

}  // namespace camgyro
