// `camgyro rectify RECORDING --calibration=FILE --out=DIR`: a recording for programs that know
// neither rolling shutters nor two clocks.
#include <gflags/gflags.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <system_error>

#include "core/format.h"
#include "core/recording_csv.h"
#include "frontend/readers/read_recording.h"
#include "pipeline/frame_times_file.h"
#include "pipeline/moving_lens.h"
#include "pipeline/read_calibration.h"
#include "pipeline/result_files.h"
#include "tools/commands.h"
#include "tools/export/export.h"
#include "tools/progress_bar.h"
#include "tools/recording_input.h"
#include "tools/stabilization/rectify.h"
#include "tools/summary.h"

DECLARE_string(calibration);
DECLARE_string(format);
DECLARE_string(out);
DECLARE_bool(quiet);
DEFINE_bool(undistort, false,
            "take the lens distortion out as well: pixels of a pinhole of the same focal length");
DEFINE_bool(remove_bias, false, "subtract the calibration's gyro bias from the rates");

namespace camgyro {
namespace {

namespace fs = std::filesystem;

// A folder that appears whole under its name, or not at all.
class NewFolder {
 public:
  explicit NewFolder(const std::string& name) : folder_(fs::path(name).lexically_normal()) {
    if (!folder_.has_filename()) folder_ = folder_.parent_path();
    temporary_ = folder_.parent_path() /
                 ("." + folder_.filename().string() + ".tmp" + std::to_string(getpid()));
  }
  ~NewFolder() {
    std::error_code ignored;
    fs::remove_all(temporary_, ignored);
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  std::string path() const { return temporary_.string(); }

  Status Make() {
    std::error_code error;
    if (fs::exists(folder_, error) && !fs::is_empty(folder_, error)) {
      return BadUsage("--out=" + folder_.string() + ": expected a new or empty folder");
    }
    fs::create_directories(temporary_ / "cam0/data", error);
    if (error) return BadUsage("--out=" + folder_.string() + ": " + error.message());
    return {};
  }

  Status Finish() {
    std::error_code error;
    fs::remove(temporary_ / "cam0/data", error);  // if it is empty
    error.clear();
    fs::rename(temporary_, folder_, error);
    if (error) return BadUsage("--out=" + folder_.string() + ": " + error.message());
    return {};
  }

 private:
  fs::path folder_, temporary_;
};

Status WriteTables(const Rectified& rectified, const ExportFormat* format,
                   const std::string& folder) {
  FileSet files(folder);
  const Recording& recording = rectified.recording;
  files.Add("cam0/data.csv", FramesCsv(recording.frames));
  if (!recording.tracks.empty()) {
    files.Add("cam0/tracks.csv", [&](std::ostream* out) { WriteTracksCsv(recording, 6, out); });
  }
  files.Add("imu0/data.csv", ImuCsv(recording));
  ExportInput input;
  input.source = fs::path(FLAGS_calibration).filename().string() + ", rectified";
  input.calibration = rectified.calibration;
  input.recording = &recording;
  for (ExportedFile& file : FindExportFormat("euroc")->make(input)) {
    files.Add(file.name, std::move(file.text));
  }
  if (format != nullptr) {
    for (ExportedFile& file : format->make(input)) {
      files.Add(format->name + "/" + file.name, std::move(file.text));
    }
  }
  return files.Write();
}

std::string Summary(const Rectified& rectified) {
  const Recording& recording = rectified.recording;
  std::string text = Format("rectified  %zu frames", recording.frames.size());
  if (rectified.shift_px > 0.0) {
    text += Format(", points moved by %.2f px rms", rectified.shift_px);
  }
  text += "\n";
  if (rectified.frames_dropped > 0) {
    text +=
        Format("           %d frames at the ends lie outside of the gyro's time and are left out\n",
               rectified.frames_dropped);
  }
  return text;
}

Status RunRectify(const std::vector<std::string>& arguments) {
  if (FLAGS_calibration.empty()) return BadUsage("rectify: --calibration=FILE is needed");
  if (FLAGS_out.empty()) return BadUsage("rectify: --out=DIR is needed");
  Result<ExportFormat> format;
  if (!FLAGS_format.empty()) {
    format = FindExportFormat(FLAGS_format);
    if (!format) return tl::unexpected(format.error());
  }
  NewFolder folder(FLAGS_out);
  if (Status made = folder.Make(); !made) return made;
  Result<Calibration> calibration = ReadCalibrationOfRows(FLAGS_calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  const Result<ReadOptions> reading = ReadOptionsFromFlags();
  if (!reading) return tl::unexpected(reading.error());
  Result<Recording> recording = ReadRecording(arguments[0], *reading);
  if (!recording) return tl::unexpected(recording.error());
  if (const Status read = ApplyFrameTimes(FLAGS_calibration, &*recording); !read) return read;
  if (const Status lens = AddMovingLens(FLAGS_calibration, *recording, &*calibration); !lens) {
    return lens;
  }
  RectifyOptions options;
  options.undistort = FLAGS_undistort;
  options.remove_bias = FLAGS_remove_bias;
  const Result<Rectified> rectified = Rectify(*calibration, options, &*recording);
  if (!rectified) return tl::unexpected(rectified.error());
  if (recording->HasImages()) {
    ProgressBar bar;
    const Status pictures =
        RectifyPictures(*recording, *calibration, *rectified, folder.path() + "/cam0/data",
                        [&](double done) { bar.Show("rectifying", done); });
    if (!pictures) return pictures;
  }
  const Status tables =
      WriteTables(*rectified, FLAGS_format.empty() ? nullptr : &*format, folder.path());
  if (!tables) return tables;
  if (Status finished = folder.Finish(); !finished) return finished;
  if (FLAGS_quiet) return {};
  std::printf("%s: %s\n%s%swritten    %s\n", recording->path.c_str(),
              DescribeRecording(*recording).c_str(), Notes("input", recording->notes).c_str(),
              Summary(*rectified).c_str(), FLAGS_out.c_str());
  return {};
}

}  // namespace

Command RectifyCommand() {
  Command command;
  command.name = "rectify";
  command.arguments = "RECORDING";
  command.summary =
      "a recording for programs that want a global shutter and one clock: an EuRoC folder (--out) "
      "with stamps of the gyro's clock and every pixel turned to the time of its frame's middle "
      "row";
  command.flags = {"calibration", "out",    "undistort", "remove_bias",
                   "format",      "stamps", "strict",    "quiet"};
  command.run = RunRectify;
  return command;
}

}  // namespace camgyro
