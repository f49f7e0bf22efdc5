// vins_tables: the tables of docs/lab/vins.md.
#include <gflags/gflags.h>
#include <glog/logging.h>

#include <cstdio>
#include <string>
#include <vector>

#include "pipeline/run.h"
#include "tools/vins_tables/vins_tables.h"

DEFINE_string(what, "initialisation", "initialisation, or delay: Feng's search over a recording");
DEFINE_string(simulate, "walking,running,handheld", "motions to simulate, comma-separated");
DEFINE_int32(seeds, 2, "simulated recordings of each motion");
DEFINE_double(duration_s, 62.0, "of each simulated recording");
DEFINE_double(step_s, 1.0, "between the beginnings of windows of 2 s");
DEFINE_string(curves, "", "delay: append all residual curves to this csv file");

namespace camgyro {
namespace {

std::vector<std::string> Split(const std::string& list) {
  std::vector<std::string> words;
  for (size_t begin = 0; begin < list.size();) {
    const size_t end = std::min(list.find(',', begin), list.size());
    if (end > begin) words.push_back(list.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

Status Tabulate(const RecordingWithTruth& r) {
  const Result<CalibrationReport> report =
      CalibrateRecording(r.recording, RotationsFrom(r.recording), {});
  if (!report) return tl::unexpected(report.error());
  if (FLAGS_what == "delay") {
    return TabulateDelaySearch(r.name, r.recording, report->calibration, FLAGS_curves);
  }
  TabulateInitialisation(r, report->calibration, FLAGS_step_s);
  return {};
}

Status Run(const std::vector<std::string>& paths) {
  if (FLAGS_what == "delay") {
    std::printf(
        "| recording | reference | windows | refused | median [ms] | spread [ms] | range [ms] | "
        "median / least residual | calibration, middle row [ms] |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  } else if (FLAGS_what == "initialisation") {
    std::printf(
        "| recording | synchronised by | windows | with a state | ready and good | ready, not good "
        "| scale error | gravity [deg] | velocity [m/s] | drift in 10 s [m] |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  } else {
    return BadUsage("--what=" + FLAGS_what + ": expected initialisation or delay");
  }
  for (const std::string& motion : Split(FLAGS_simulate)) {
    for (int seed = 1; seed <= FLAGS_seeds; ++seed) {
      const auto recording =
          SimulateWithTruth(motion + " " + std::to_string(seed),
                            {"motion.kind=" + motion, "seed=" + std::to_string(seed),
                             "duration_s=" + std::to_string(FLAGS_duration_s),
                             "camera.delay_s=0.03", "tracks.noise_px=0.5"});
      if (!recording) return tl::unexpected(recording.error());
      if (Status done = Tabulate(*recording); !done) return done;
    }
  }
  for (const std::string& path : paths) {
    const auto recording = ReadWithTruth(path);
    if (!recording) return tl::unexpected(recording.error());
    if (Status done = Tabulate(*recording); !done) return done;
  }
  return {};
}

}  // namespace
}  // namespace camgyro

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  FLAGS_minloglevel = google::GLOG_FATAL;
  gflags::SetUsageMessage(
      "[--what=initialisation|delay] [--simulate=MOTION,...] [RECORDING...]\n"
      "RECORDING: a folder with tracks, accelerometer and truth.yaml");
  gflags::ParseCommandLineFlags(&argc, &argv, /*remove_flags=*/true);
  const camgyro::Status status = camgyro::Run({argv + 1, argv + argc});
  if (status) return 0;
  std::fprintf(stderr, "vins_tables: %s\n", status.error().message.c_str());
  return static_cast<int>(status.error().kind);
}
