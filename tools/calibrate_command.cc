// `camgyro calibrate RECORDING --out DIR`: the main job.
#include <gflags/gflags.h>

#include <cstdio>
#include <utility>

#include "pipeline/input_yaml.h"
#include "pipeline/result_files.h"
#include "pipeline/run.h"
#include "tools/commands.h"
#include "tools/fit_flags.h"
#include "tools/progress_bar.h"
#include "tools/recording_input.h"
#include "tools/report/calibrate_report.h"
#include "tools/required.h"
#include "tools/summary.h"

DEFINE_string(out, "",
              "folder to write into, made if absent; without: ./calibration (calibrate), the "
              "recording (track), no files (delay, compare); stabilize: the video, .mp4, .mov or "
              ".mkv");
DEFINE_string(estimator, "window",
              "online estimator: window, or ekf, the filter of the paper, without refinement");
DEFINE_bool(refine, true,
            "skip the last step, all frames in one problem: the online estimate is the result");
DEFINE_string(effects, "",
              "effects to fit as well, separated by commas, each with a shape after a colon if it "
              "has several: radial_distortion,focal_drift:linear (names: docs/effects.md)");
DEFINE_double(search_s, 2.0, "half range of the delay search");
DECLARE_bool(quiet);

namespace camgyro {
namespace {

Result<CalibrateOptions> OptionsFromFlags() {
  CalibrateOptions options;
  if (FLAGS_estimator != "window" && FLAGS_estimator != "ekf") {
    return BadUsage("--estimator=" + FLAGS_estimator + ": expected window or ekf");
  }
  if (Status read = ReadFitFlags(&options.window.graph); !read) {
    return tl::unexpected(read.error());
  }
  const PairResidual::Facts& residual = options.window.graph.residual->facts();
  if (!residual.with_effects && !FLAGS_effects.empty()) {
    return BadUsage("--effects=" + FLAGS_effects +
                    ": expected none with --residual=" + residual.name);
  }
  if (!(FLAGS_search_s > 0.0)) return BadUsage("--search_s: expected a positive number");
  if (Status known = CheckRequireFlag(); !known) return tl::unexpected(known.error());
  options.start.search_s = FLAGS_search_s;
  options.refine = FLAGS_refine;
  options.effects = FLAGS_effects;
  return options;
}

Status RunCalibrate(const std::vector<std::string>& arguments) {
  const Result<CalibrateOptions> options = OptionsFromFlags();
  if (!options) return tl::unexpected(options.error());
  const Result<DeviceClass> device = DeviceFromFlag();
  if (!device) return tl::unexpected(device.error());
  FileSet files(FLAGS_out.empty() ? "calibration" : FLAGS_out);
  if (Status writable = files.CheckWritable(); !writable) return writable;
  Result<Recording> recording = OpenRecording(arguments[0]);
  if (!recording) return tl::unexpected(recording.error());
  if (!FLAGS_quiet) {
    std::printf("%s: %s\n%s", recording->path.c_str(), DescribeRecording(*recording).c_str(),
                Notes("input", recording->notes).c_str());
    std::fflush(stdout);
  }

  Result<CalibrationRun> run = CannotEstimate("");
  const size_t shown = recording->notes.size();
  {
    ProgressBar bar;
    run = RunCalibration(
        *options, FLAGS_estimator == "ekf" ? OnlineEstimator::kPaperEkf : OnlineEstimator::kWindow,
        *device, [&](const std::string& stage, double done) { bar.Show(stage, done); },
        &*recording);
  }
  if (!run) return tl::unexpected(run.error());
  if (Status strict = CheckStrict(*recording); !strict) return strict;
  const CalibrationReport* report = &run->report;
  const TrackingSummary* tracking = &run->tracking;

  const bool attitudes = recording->HasOnlyAttitudes();
  files.Add("trace.csv", TraceCsv(report->trace));
  files.Add("delay.csv", DelayCsv(report->start.curve));
  const bool has_frame_times = !report->frame_times.empty();
  if (has_frame_times) {
    files.Add("frame_times.csv", FrameTimesCsv(*recording, report->frame_times));
  }
  const std::string yaml = CalibrationYaml(*report, attitudes) + InputYaml(*recording);
  files.Add("calibration.yaml", yaml);
  const Command command = CalibrateCommand();
  const Result<std::string> html =
      CalibrationReportHtml(*recording, *report,
                            {CommandLineOf(command, arguments), DescribeRecording(*recording),
                             FlagValues(command), yaml});
  if (!html) return tl::unexpected(html.error());
  files.Add("report.html", *html);
  if (Status written = files.Write(); !written) return written;

  std::printf("\n%s", ParameterTable(report->calibration, attitudes).c_str());
  if (!FLAGS_quiet) {
    const std::vector<std::string> found(recording->notes.begin() + static_cast<long>(shown),
                                         recording->notes.end());
    std::printf("\n%s%s%s%s%s%s%s%s", SystematicLine(*report).c_str(),
                Notes("input", found).c_str(), MotionLine(*recording, *tracking).c_str(),
                StartLine(report->start).c_str(), QualityLine(*report, attitudes).c_str(),
                TimeLine(*report, tracking->seconds, recording->frames.size()).c_str(),
                Notes("note", report->notes).c_str(), Notes("doubt", report->doubts).c_str());
    std::printf("written    %s/calibration.yaml, report.html, trace.csv, delay.csv%s\n",
                files.folder().c_str(), has_frame_times ? ", frame_times.csv" : "");
  }
  return CheckDetermined(report->calibration);
}

}  // namespace

Command CalibrateCommand() {
  Command command;
  command.name = "calibrate";
  command.arguments = "RECORDING";
  command.summary =
      "focal length, readout time, delay, mounting and gyro bias: with their uncertainty, into "
      "calibration.yaml (trace.csv: the online estimate over time; delay.csv: the delay search)";
  command.flags = {"out", "effects"};
  for (const std::string& name : FitFlags()) command.flags.push_back(name);
  command.flags.insert(command.flags.end(), {"device", "estimator", "refine"});
  for (const std::string& name : InputFlags()) command.flags.push_back(name);
  command.flags.insert(command.flags.end(), {"require", "search_s", "quiet"});
  command.run = RunCalibrate;
  return command;
}

}  // namespace camgyro
