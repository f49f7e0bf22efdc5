#include "tools/recording_input.h"

#include <gflags/gflags.h>

#include <opencv2/core/utility.hpp>

#include "core/format.h"
#include "core/parallel.h"
#include "core/time.h"
#include "frontend/readers/read_recording.h"
#include "tools/command_line.h"

DEFINE_double(focal_px, 0.0, "first guess of the focal length; default: sensor.yaml's, else found");
DEFINE_double(
    readout_ms, 0.0,
    "first guess of the readout time, first to last row; default: sensor.yaml's, else found");
DEFINE_double(delay_ms, 0.0,
              "centre of the delay search, gyro clock minus camera stamp; default: sensor.yaml's, "
              "else 0");
DEFINE_string(stamps, "auto",
              "gyro stamps: recorded, repaired (laid on the sampling clock behind them), or auto: "
              "repaired where they are clearly times of arrival");
DEFINE_int32(threads, 0,
             "threads to work in; without: one per core. The result is the same with any number");
DEFINE_bool(strict, false, "refuse recordings whose data have to be repaired");

namespace camgyro {
std::vector<std::string> InputFlags() {
  return {"focal_px", "readout_ms", "delay_ms", "stamps", "strict", "threads"};
}

Result<ReadOptions> ReadOptionsFromFlags() {
  ReadOptions options;
  options.strict = FLAGS_strict;
  if (FLAGS_stamps == "recorded") {
    options.stamps = StampsMode::kRecorded;
  } else if (FLAGS_stamps == "repaired") {
    options.stamps = StampsMode::kRepaired;
  } else if (FLAGS_stamps != "auto") {
    return BadUsage("--stamps=" + FLAGS_stamps + ": expected auto, recorded or repaired");
  }
  return options;
}

Result<Recording> OpenRecording(const std::string& path) {
  if (FlagGiven("focal_px") && !(FLAGS_focal_px > 0.0)) {
    return BadUsage("--focal_px: expected a positive number");
  }
  if (FlagGiven("threads")) {
    if (FLAGS_threads < 1) return BadUsage("--threads: expected at least 1");
    LimitThreads(FLAGS_threads);
    cv::setNumThreads(FLAGS_threads);
  }
  const Result<ReadOptions> options = ReadOptionsFromFlags();
  if (!options) return tl::unexpected(options.error());
  Result<Recording> recording = ReadRecording(path, *options);
  if (!recording) return recording;
  CameraGuess& guess = recording->camera;
  if (FlagGiven("focal_px")) guess.focal_px = FLAGS_focal_px;
  if (FlagGiven("readout_ms")) guess.readout_s = 1e-3 * FLAGS_readout_ms;
  if (FlagGiven("delay_ms")) guess.delay_s = 1e-3 * FLAGS_delay_ms;
  return recording;
}

Status CheckStrict(const Recording& recording) {
  if (!FLAGS_strict || recording.faults.empty()) return {};
  return BadInput(recording.path + ": with --strict: " + recording.faults.back().finding);
}

std::string DescribeRecording(const Recording& recording) {
  // Of stamps that are rounded, the median interval is another: 35 ms of 33.3 in steps of 5.
  const auto interval_s = [](const std::optional<StampReport>& stamps, double median_s) {
    return stamps && stamps->kind == StampKind::kArrival ? stamps->period_s : median_s;
  };
  const double frame_s = interval_s(recording.camera_stamps, MedianInterval(recording.frames));
  const double gyro_s = interval_s(recording.gyro_stamps, MedianInterval(recording.gyro));
  const double span_s =
      SecondsSince(recording.frames.front().stamp_ns, recording.frames.back().stamp_ns);
  std::string size;
  if (recording.camera.width_px > 0) {
    size = std::to_string(recording.camera.width_px) + " x " +
           std::to_string(recording.camera.height_px) + ", ";
  }
  return Format("%s%zu frames in %.1f s (%.1f Hz), gyro %.0f Hz", size.c_str(),
                recording.frames.size(), span_s, frame_s > 0.0 ? 1.0 / frame_s : 0.0,
                gyro_s > 0.0 ? 1.0 / gyro_s : 0.0);
}

}  // namespace camgyro
