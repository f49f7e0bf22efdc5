// `camgyro odometry RECORDING [--calibration=FILE] --out=DIR`: where the device went.
#include <gflags/gflags.h>

#include <chrono>
#include <cstdio>
#include <sstream>

#include "core/format.h"
#include "core/free_memory.h"
#include "core/pair_model.h"
#include "estimator/odometry/follow_recording.h"
#include "estimator/odometry/gyro_rate_trajectory.h"
#include "pipeline/find_loops.h"
#include "pipeline/frame_times_file.h"
#include "pipeline/moving_lens.h"
#include "pipeline/read_calibration.h"
#include "pipeline/result_files.h"
#include "pipeline/run.h"
#include "tools/commands.h"
#include "tools/fit_flags.h"
#include "tools/odometry_files.h"
#include "tools/progress_bar.h"
#include "tools/recording_input.h"
#include "tools/report/odometry_report.h"
#include "tools/summary.h"

DECLARE_string(calibration);
DECLARE_string(out);
DECLARE_bool(quiet);
DEFINE_int32(
    keyframes, 16,
    "keyframes in the sliding window, 6 to 60: more are slower and a little more accurate");
DEFINE_string(loops, "on",
              "on: look for places that pictures show again, and close the way there; off: do not, "
              "as in the experiments of Feng, Li & Dai");
DEFINE_string(rate, "frame",
              "frame: poses of frames and keyframes; gyro: a trajectory at every gyro sample as "
              "well, through what is finally known of the keyframes");
DEFINE_double(gravity, 0.0,
              "length of gravity where the recording was made [m/s^2]; without: 9.80665");
DEFINE_string(lever_arm_mm, "0,0,0",
              "position of the camera in the gyro's frame, as far as it is known: x,y,z");
DEFINE_double(lever_arm_sigma_mm, 50.0, "how well it is known, per axis");

namespace camgyro {
namespace {

Result<OdometryOptions> OptionsFromFlags() {
  OdometryOptions options;
  if (FLAGS_keyframes < 6 || FLAGS_keyframes > 60) {
    return BadUsage("--keyframes: expected 6 to 60");
  }
  options.keyframes = FLAGS_keyframes;
  if (FLAGS_loops != "on" && FLAGS_loops != "off") {
    return BadUsage("--loops=" + FLAGS_loops + ": expected on or off");
  }
  if (FLAGS_rate != "frame" && FLAGS_rate != "gyro") {
    return BadUsage("--rate=" + FLAGS_rate + ": expected frame or gyro");
  }
  if (FLAGS_gravity != 0.0) options.gravity_m_s2 = FLAGS_gravity;
  if (!(options.gravity_m_s2 > 9.0 && options.gravity_m_s2 < 10.5)) {
    return BadUsage("--gravity: expected 9 to 10.5 m/s^2");
  }
  std::istringstream words(FLAGS_lever_arm_mm);
  char comma = ',', second = ',';
  Eigen::Vector3d& arm = options.p_gyro_cam_m;
  if (!(words >> arm.x() >> comma >> arm.y() >> second >> arm.z()) || comma != ',' ||
      second != ',' || !(words >> std::ws).eof() || !arm.allFinite()) {
    return BadUsage("--lever_arm_mm=" + FLAGS_lever_arm_mm + ": expected x,y,z in mm");
  }
  arm *= 1e-3;
  if (!(FLAGS_lever_arm_sigma_mm > 0.0 && FLAGS_lever_arm_sigma_mm <= 1e4)) {
    return BadUsage("--lever_arm_sigma_mm: expected more than 0, at most 10000");
  }
  options.p_gyro_cam_sigma_m = 1e-3 * FLAGS_lever_arm_sigma_mm;
  return options;
}

// That of --calibration, or the recording's own.
Result<Calibration> CalibrationOf(Recording* recording, ProgressBar* bar) {
  if (!FLAGS_calibration.empty()) {
    Result<Calibration> calibration = ReadCalibrationOfRows(FLAGS_calibration);
    if (!calibration) return calibration;
    if (Status still = RefuseStabilisedLens(FLAGS_calibration); !still) {
      return tl::unexpected(still.error());
    }
    if (Status read = ApplyFrameTimes(FLAGS_calibration, recording); !read) {
      return tl::unexpected(read.error());
    }
    return calibration;
  }
  const Result<DeviceClass> device = DeviceFromFlag();
  if (!device) return tl::unexpected(device.error());
  CalibrateOptions options;
  options.effects = EffectsFromFlag(*device);
  Result<CalibrationRun> run = RunCalibration(
      options, OnlineEstimator::kWindow, *device,
      [&](const std::string& stage, double done) { bar->Show(stage, done); }, recording);
  if (!run) return tl::unexpected(run.error());
  const Calibration& fit = run->report.calibration;
  if (ReadsColumns(fit.readout_s, ColumnReadoutOf(fit))) {
    return BadInput(std::string("calibration: ") + kReadsColumns);
  }
  if (const Status still = RefuseStabilisedLens(fit); !still) {
    return tl::unexpected(still.error());
  }
  ApplyFrameTimes(run->report.frame_times, recording);
  return run->report.calibration;
}

Result<LoopClosure> LoopsOf(const Recording& recording, const OdometryRun& run, double gravity_m_s2,
                            ProgressBar* bar) {
  if (FLAGS_loops == "off") {
    LoopClosure off;
    off.unavailable = "--loops=off";
    return off;
  }
  return FindLoops(recording, run, gravity_m_s2, [&](double done) { bar->Show("loops", done); });
}

std::string Summary(const OdometryRun& run, const LoopClosure& loops, double recorded_s,
                    double seconds) {
  std::string text = "verdict    " + VerdictOf(run) + "\n";
  if (run.segments > 0) {
    const OdometryPose& last = run.poses.back();
    const Eigen::Vector3d sigma =
        last.covariance.block<3, 3>(kNavPosition, kNavPosition).diagonal().cwiseSqrt();
    text += Format(
        "path       %.2f m in %zu keyframes; the last frame at (%.2f, %.2f, %.2f) m +- %.2g %.2g "
        "%.2g\n",
        run.path_m, run.keyframes.size(), last.state.p_world_m.x(), last.state.p_world_m.y(),
        last.state.p_world_m.z(), sigma.x(), sigma.y(), sigma.z());
    text +=
        Format("lens       %.2f px of noise%s; camera at (%.3f, %.3f, %.3f) m in the gyro frame\n",
               run.noise_px, run.tracks_drift ? ", added at every frame" : "", run.p_gyro_cam_m.x(),
               run.p_gyro_cam_m.y(), run.p_gyro_cam_m.z());
  }
  if (run.segments > 0) text += "loops      " + LoopsInWords(loops) + "\n";
  text += Format("time       %.1f s for %.1f s of recording\n", seconds, recorded_s);
  return text;
}

// What there is once the odometry has started.
void AddTrajectories(const Recording& recording, const OdometryRun& run, const LoopClosure& loops,
                     double gravity_m_s2, FileSet* files) {
  files->Add("trajectory.tum", TrajectoryTum(run.poses));
  files->Add("keyframes.tum", TrajectoryTum(run.keyframes));
  files->Add("trajectory.csv", PosesCsv(run.poses));
  files->Add("keyframes.csv", PosesCsv(run.keyframes));
  files->Add("points.ply", PointsPly(run.points));
  const auto at_gyro_rate = [&](const std::vector<OdometryPose>& keyframes) {
    return TrajectoryTum(AtGyroRate(recording.gyro, recording.accel, keyframes, gravity_m_s2));
  };
  if (FLAGS_rate == "gyro") files->Add("gyro_rate.tum", at_gyro_rate(run.keyframes));
  if (loops.Believed() == 0) return;
  files->Add("closed.tum", TrajectoryTum(loops.poses));
  files->Add("closed.csv", PosesCsv(loops.poses));
  if (FLAGS_rate == "gyro") files->Add("closed_gyro_rate.tum", at_gyro_rate(loops.keyframes));
}

Status RunOdometry(const std::vector<std::string>& arguments) {
  const Result<OdometryOptions> options = OptionsFromFlags();
  if (!options) return tl::unexpected(options.error());
  FileSet files(FLAGS_out.empty() ? "odometry" : FLAGS_out);
  if (Status writable = files.CheckWritable(); !writable) return writable;
  Result<Recording> recording = OpenRecording(arguments[0]);
  if (!recording) return tl::unexpected(recording.error());
  if (Status sound = CheckCanBeFollowed(*recording); !sound) return sound;
  if (!FLAGS_quiet) {
    std::printf("%s: %s\n%s", recording->path.c_str(), DescribeRecording(*recording).c_str(),
                Notes("input", recording->notes).c_str());
    std::fflush(stdout);
  }
  Result<Calibration> calibration = CannotEstimate("");
  Result<OdometryRun> run = CannotEstimate("");
  Result<LoopClosure> loops = CannotEstimate("");
  double seconds = 0.0;
  {
    ProgressBar bar;
    const Progress progress = [&](const std::string& stage, double done) { bar.Show(stage, done); };
    if (Result<TrackingSummary> tracked = EnsureImageMotion(progress, &*recording); !tracked) {
      return tl::unexpected(tracked.error());
    }
    calibration = CalibrationOf(&*recording, &bar);
    if (!calibration) return tl::unexpected(calibration.error());
    const auto begin = std::chrono::steady_clock::now();
    run =
        FollowRecording(*recording, *calibration, WithDeclaredNoise(*options, recording->gyro_info),
                        [&](double done) { bar.Show("odometry", done); });
    if (!run) return tl::unexpected(run.error());
    loops = LoopsOf(*recording, *run, options->gravity_m_s2, &bar);
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  if (!loops) return tl::unexpected(loops.error());
  // No file needs them: of an hour of 150 tracks, they are half a gigabyte.
  recording->tracks = {};
  GiveBackFreeMemory();

  const std::string yaml = OdometryYaml(*run, *loops);
  files.Add("odometry.yaml", yaml);
  if (run->segments > 0) {
    AddTrajectories(*recording, *run, *loops, options->gravity_m_s2, &files);
    const Command command = OdometryCommand();
    files.Add("report.html",
              OdometryReportHtml(*run, *loops,
                                 {CommandLineOf(command, arguments), DescribeRecording(*recording),
                                  FlagValues(command), yaml, "odometry.yaml"}));
  }
  if (Status written = files.Write(); !written) return written;
  const double recorded_s = recording->frames.empty()
                                ? 0.0
                                : 1e-9 * static_cast<double>(recording->frames.back().stamp_ns -
                                                             recording->frames.front().stamp_ns);
  if (!FLAGS_quiet) {
    std::printf("%swritten    %s/odometry.yaml%s%s%s\n",
                Summary(*run, *loops, recorded_s, seconds).c_str(), files.folder().c_str(),
                run->segments > 0 ? ", report.html, trajectory.tum, keyframes.tum, trajectory.csv, "
                                    "keyframes.csv, points.ply"
                                  : "",
                loops->Believed() > 0 ? ", closed.tum, closed.csv" : "",
                run->segments == 0 || FLAGS_rate != "gyro" ? ""
                : loops->Believed() > 0                    ? ", gyro_rate.tum, closed_gyro_rate.tum"
                                                           : ", gyro_rate.tum");
  }
  if (run->segments == 0) {
    return CannotEstimate("odometry did not start: " + run->start_explanation);
  }
  return {};
}

}  // namespace

Command OdometryCommand() {
  Command command;
  command.name = "odometry";
  command.arguments = "RECORDING";
  command.summary =
      "where the device went: positions, velocities and biases of a recording with an "
      "accelerometer, by a sliding window that knows the rolling shutter and both clocks; without "
      "--calibration the recording is calibrated first";
  command.flags = {"calibration", "out",  "effects", "device",       "keyframes",
                   "loops",       "rate", "gravity", "lever_arm_mm", "lever_arm_sigma_mm"};
  for (const std::string& flag : InputFlags()) command.flags.push_back(flag);
  command.flags.emplace_back("quiet");
  command.run = RunOdometry;
  return command;
}

}  // namespace camgyro
