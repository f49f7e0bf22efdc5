// `camgyro stabilize RECORDING --calibration=FILE --out VIDEO`: the calibration that one can see.
#include <gflags/gflags.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <system_error>

#include "core/format.h"
#include "frontend/readers/read_recording.h"
#include "pipeline/frame_times_file.h"
#include "pipeline/moving_lens.h"
#include "pipeline/read_calibration.h"
#include "tools/commands.h"
#include "tools/progress_bar.h"
#include "tools/recording_input.h"
#include "tools/stabilization/stabilize.h"
#include "tools/summary.h"

DECLARE_string(calibration);
DECLARE_string(out);
DECLARE_bool(quiet);
DEFINE_double(smooth_s, 0.5,
              "how slowly the view follows the camera: standard deviation of the average over "
              "time; 0: the view is the camera's, only the rolling shutter is rectified");
DEFINE_double(zoom, 1.25, "of the view; 1: the recorded field of view; less shows its borders");
DEFINE_string(border, "avoid",
              "where the view would leave the recorded picture: avoid (it stays behind), black, "
              "stretch or mirror");
DEFINE_bool(side_by_side, false, "the recorded video to the left of the stabilised one");
DEFINE_int32(crf, 18, "quality of the H.264 video, 0 (lossless) to 51");

namespace camgyro {
namespace {

namespace fs = std::filesystem;

Result<StabilizeOptions> OptionsFromFlags() {
  StabilizeOptions options;
  if (FLAGS_border == "black") {
    options.border = BorderPolicy::kBlack;
  } else if (FLAGS_border == "stretch") {
    options.border = BorderPolicy::kStretch;
  } else if (FLAGS_border == "mirror") {
    options.border = BorderPolicy::kMirror;
  } else if (FLAGS_border != "avoid") {
    return BadUsage("--border=" + FLAGS_border + ": expected avoid, black, stretch or mirror");
  }
  if (!(FLAGS_smooth_s >= 0.0 && FLAGS_smooth_s <= 60.0)) {
    return BadUsage("--smooth_s: expected 0 to 60");
  }
  if (!(FLAGS_zoom >= 0.1 && FLAGS_zoom <= 10.0)) return BadUsage("--zoom: expected 0.1 to 10");
  options.zoom = FLAGS_zoom;
  if (FLAGS_crf < 0 || FLAGS_crf > 51) return BadUsage("--crf: expected 0 to 51");
  options.smooth_s = FLAGS_smooth_s;
  options.side_by_side = FLAGS_side_by_side;
  options.crf = FLAGS_crf;
  return options;
}

std::string RegistrationRow(const char* name, double recorded, const double* unsynchronised,
                            double calibrated) {
  return Format("  %s %8.3f px", name, recorded) +
         (unsynchronised != nullptr ? Format("      %8.3f px", *unsynchronised)
                                    : "               - ") +
         Format("   %8.3f px   (as recorded is %.1f times that)\n", calibrated,
                recorded / calibrated);
}

std::string Summary(const StabilizeReport& report) {
  std::string text = Format(
      "\nneighbouring frames lie on each other within (medians of %d pairs)\n", report.pairs);
  text += "                            as recorded   t_d = t_r = 0    calibrated\n";
  const auto& zero = report.unsynchronised;
  text += RegistrationRow("each turned by the gyro  ", report.as_recorded.turned_px,
                          zero ? &zero->turned_px : nullptr, report.calibrated.turned_px);
  text += RegistrationRow("by the best homography   ", report.as_recorded.homography_px,
                          zero ? &zero->homography_px : nullptr, report.calibrated.homography_px);
  if (!zero) text += "  (-: with a delay of 0 the frames are outside of the gyro's time)\n";
  text += Format("\nvideo      %d frames", report.frames) +
          Format(", %d x %d", report.width_px, report.height_px) + ", sound: " + report.sound +
          "\n";
  if (report.frames_dropped > 0) {
    text += Format(
        "           %d frames at the ends lie outside of the gyro's time and are left "
        "out\n",
        report.frames_dropped);
  }
  if (report.border_share > 0.0) {
    text += Format("           borders show in %.0f %% of the frames: more --zoom hides them\n",
                   100.0 * report.border_share);
  }
  return text + Format("time       %.1f s, %.0f frames/s, %.1f times real time\n", report.seconds,
                       report.frames / report.seconds, report.video_seconds / report.seconds);
}

Status RunStabilize(const std::vector<std::string>& arguments) {
  const Result<StabilizeOptions> options = OptionsFromFlags();
  if (!options) return tl::unexpected(options.error());
  if (FLAGS_calibration.empty()) return BadUsage("stabilize: --calibration=FILE is needed");
  const fs::path out = FLAGS_out;
  const std::string extension = out.extension().string();
  if (extension != ".mp4" && extension != ".mov" && extension != ".mkv") {
    return BadUsage("stabilize: --out: expected the name of a video, .mp4, .mov or .mkv");
  }
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
  std::error_code error;
  if (fs::exists(out, error) && !recording->video_file.empty() &&
      fs::equivalent(out, recording->video_file, error)) {
    return BadUsage("--out=" + FLAGS_out + ": is the recording's own video");
  }
  if (out.has_parent_path()) fs::create_directories(out.parent_path(), error);
  const fs::path temporary =
      out.parent_path() / ("." + out.filename().string() + ".tmp" + std::to_string(getpid()));
  if (!FLAGS_quiet) {
    std::printf("%s: %s\n%s", recording->path.c_str(), DescribeRecording(*recording).c_str(),
                Notes("input", recording->notes).c_str());
    std::fflush(stdout);
  }
  Result<StabilizeReport> report;
  {
    ProgressBar bar;
    report = Stabilize(*recording, *calibration, *options, temporary.string(), extension.substr(1),
                       [&](double done) { bar.Show("stabilizing", done); });
  }
  if (!report) {
    fs::remove(temporary, error);
    return tl::unexpected(report.error());
  }
  fs::rename(temporary, out, error);
  if (error) {
    const std::string why = error.message();
    fs::remove(temporary, error);
    return BadUsage("--out: cannot write " + FLAGS_out + ": " + why);
  }
  std::fputs(Summary(*report).c_str(), stdout);
  if (!FLAGS_quiet) std::printf("written    %s\n", FLAGS_out.c_str());
  return {};
}

}  // namespace

Command StabilizeCommand() {
  Command command;
  command.name = "stabilize";
  command.arguments = "RECORDING";
  command.summary =
      "rectified, stabilised video: the rolling shutter undone and the view smoothed with a "
      "calibration.yaml; says how much better neighbouring frames lie on each other";
  command.flags = {"calibration",  "out", "smooth_s", "zoom",   "border",
                   "side_by_side", "crf", "stamps",   "strict", "quiet"};
  command.run = RunStabilize;
  return command;
}

}  // namespace camgyro
