// `camgyro track RECORDING`: only the frontend.
#include <gflags/gflags.h>

#include <cstdio>
#include <filesystem>
#include <optional>

#include "core/recording_csv.h"
#include "frontend/track_recording.h"
#include "pipeline/read_calibration.h"
#include "pipeline/result_files.h"
#include "tools/commands.h"
#include "tools/progress_bar.h"
#include "tools/recording_input.h"
#include "tools/summary.h"

DECLARE_string(out);
DECLARE_bool(quiet);
DEFINE_string(
    calibration, "",
    "calibration.yaml of this camera and gyro (track: the gyro then predicts where corners "
    "go, and wrong is what is off its epipolar line)");
DEFINE_int32(max_points, 200, "corners followed per frame");

namespace camgyro {
namespace {

Status RunTrack(const std::vector<std::string>& arguments) {
  if (FLAGS_max_points < 1) return BadUsage("--max_points: expected at least 1");
  if (FLAGS_out.empty() && !std::filesystem::is_directory(arguments[0])) {
    return BadUsage("track: a recording that is not a folder needs --out=DIR");
  }
  FileSet files(FLAGS_out.empty() ? arguments[0] : FLAGS_out);
  if (Status writable = files.CheckWritable(); !writable) return writable;
  Result<Recording> recording = OpenRecording(arguments[0]);
  if (!recording) return tl::unexpected(recording.error());
  if (!recording->HasImages()) {
    return BadInput(recording->path + ": has neither images nor a video to track in");
  }
  std::optional<Calibration> calibration;
  if (!FLAGS_calibration.empty()) {
    const Result<Calibration> read = ReadCalibration(FLAGS_calibration);
    if (!read) return tl::unexpected(read.error());
    calibration = *read;
  }
  TrackerOptions options;
  options.max_points = FLAGS_max_points;
  Result<TrackingSummary> summary;
  {
    ProgressBar bar;
    summary = TrackRecording(
        options, calibration ? &*calibration : nullptr,
        [&](double done) { bar.Show("tracking", done); }, &*recording);
  }
  if (!summary) return tl::unexpected(summary.error());
  if (Status strict = CheckStrict(*recording); !strict) return strict;
  files.Add("cam0/tracks.csv", [&](std::ostream* out) { WriteTracksCsv(*recording, 4, out); });
  if (Status written = files.Write(); !written) return written;
  if (FLAGS_quiet) return {};
  std::printf("%s: %s\n%s%s", recording->path.c_str(), DescribeRecording(*recording).c_str(),
              Notes("input", recording->notes).c_str(), MotionLine(*recording, *summary).c_str());
  std::printf("time       %.1f s, %.0f frames/s\nwritten    %s/cam0/tracks.csv\n", summary->seconds,
              static_cast<double>(recording->frames.size()) / summary->seconds,
              files.folder().c_str());
  return {};
}

}  // namespace

Command TrackCommand() {
  Command command;
  command.name = "track";
  command.arguments = "RECORDING";
  command.summary =
      "follows corners through the pictures: writes cam0/tracks.csv into the recording (or --out), "
      "where other commands take it instead of the pictures";
  command.flags = {"out", "calibration", "max_points", "stamps", "strict", "threads", "quiet"};
  command.run = RunTrack;
  return command;
}

}  // namespace camgyro
