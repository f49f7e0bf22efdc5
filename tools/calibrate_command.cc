// `camgyro calibrate RECORDING... --out DIR`: the main job.
#include <gflags/gflags.h>

#include <cstdio>
#include <filesystem>
#include <utility>

#include "pipeline/device.h"
#include "pipeline/input_yaml.h"
#include "pipeline/result_files.h"
#include "pipeline/run.h"
#include "tools/commands.h"
#include "tools/fit_flags.h"
#include "tools/folder_names.h"
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
DECLARE_string(effects);
DEFINE_double(search_s, 2.0, "half range of the delay search");
DECLARE_bool(quiet);

namespace camgyro {
namespace {

Result<CalibrateOptions> OptionsFromFlags(DeviceClass device) {
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
  options.effects = EffectsFromFlag(device);
  return options;
}

// A recording that was calibrated, with its files written and its result printed.
struct Calibrated {
  CalibrationReport report;
  bool attitudes = false;
};

Result<Calibrated> CalibrateOne(const std::string& path, const std::string& folder,
                                const CalibrateOptions& options, DeviceClass device) {
  FileSet files(folder);
  Result<Recording> recording = OpenRecording(path);
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
        options, FLAGS_estimator == "ekf" ? OnlineEstimator::kPaperEkf : OnlineEstimator::kWindow,
        device, [&](const std::string& stage, double done) { bar.Show(stage, done); }, &*recording);
  }
  if (!run) return tl::unexpected(run.error());
  if (Status strict = CheckStrict(*recording); !strict) return tl::unexpected(strict.error());
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
  const Result<std::string> html = CalibrationReportHtml(
      *recording, tracking->pictures, *report,
      {CommandLineOf(command, {path}), DescribeRecording(*recording), FlagValues(command), yaml});
  if (!html) return tl::unexpected(html.error());
  files.Add("report.html", *html);
  if (Status written = files.Write(); !written) return tl::unexpected(written.error());

  std::printf("%s%s", FLAGS_quiet ? "" : "\n",
              ParameterTable(report->calibration, attitudes).c_str());
  if (!FLAGS_quiet) {
    const std::vector<std::string> found(recording->notes.begin() + static_cast<long>(shown),
                                         recording->notes.end());
    std::printf("\n%s%s%s%s%s%s%s%s%s", SystematicLine(*report).c_str(),
                Notes("input", found).c_str(), MotionLine(*recording, *tracking).c_str(),
                StartLine(report->start).c_str(), QualityLine(*report, attitudes).c_str(),
                HalvesLine(report->halves_chi2).c_str(),
                TimeLine(report->times, tracking->seconds, recording->frames.size()).c_str(),
                Notes("note", report->notes).c_str(), Notes("doubt", report->doubts).c_str());
    std::printf("written    %s/calibration.yaml, report.html, trace.csv, delay.csv%s\n",
                files.folder().c_str(), has_frame_times ? ", frame_times.csv" : "");
  }
  return Calibrated{std::move(run->report), attitudes};
}

// Each recording by itself, then what they say of their device together. A recording that cannot be
// calibrated is named and left out.
Status CalibrateDevice(const std::vector<std::string>& paths, const std::string& folder,
                       const CalibrateOptions& options, DeviceClass device_class) {
  for (const std::string& path : paths) {  // before minutes of work, not after them
    if (std::filesystem::exists(path)) continue;
    if (Result<Recording> missing = OpenRecording(path); !missing) {
      return tl::unexpected(missing.error());
    }
  }
  const std::vector<std::string> names = FolderNames(paths);
  std::vector<Calibrated> all;
  std::vector<std::string> calibrated, refused;
  for (size_t i = 0; i < paths.size(); ++i) {
    // The description that heads a recording's table otherwise is no result.
    if (FLAGS_quiet) std::printf("%s:\n", names[i].c_str());
    Result<Calibrated> one = CalibrateOne(
        paths[i], (std::filesystem::path(folder) / names[i]).string(), options, device_class);
    if (!one && one.error().kind != ErrorKind::kCannotEstimate) {
      return tl::unexpected(one.error());
    }
    if (one) {
      calibrated.push_back(names[i]);
      all.push_back(*std::move(one));
    } else {
      refused.push_back(names[i] + " is left out: " + one.error().message);
      std::printf("%s", Notes("refused", {refused.back()}).c_str());
    }
    std::printf("\n");
  }
  if (all.size() < 2) {
    return CannotEstimate("fewer than two recordings could be calibrated: " + refused.front());
  }
  std::vector<const CalibrationReport*> reports;
  bool attitudes = true;
  for (const Calibrated& one : all) {
    reports.push_back(&one.report);
    attitudes = attitudes && one.attitudes;
  }
  const Result<DeviceReport> device = CombineToDevice(calibrated, reports, attitudes);
  if (!device) return tl::unexpected(device.error());
  FileSet files(folder);
  files.Add("calibration.yaml", DeviceYaml(*device));
  if (Status written = files.Write(); !written) return written;
  std::printf("%s", DeviceTable(*device).c_str());
  if (!FLAGS_quiet) {
    std::printf("%s%swritten    %s/calibration.yaml\n", SystematicLine(device->report).c_str(),
                Notes("refused", refused).c_str(), folder.c_str());
  }
  return CheckDetermined(device->report.calibration);
}

Status RunCalibrate(const std::vector<std::string>& arguments) {
  const Result<DeviceClass> device = DeviceFromFlag();
  if (!device) return tl::unexpected(device.error());
  const Result<CalibrateOptions> options = OptionsFromFlags(*device);
  if (!options) return tl::unexpected(options.error());
  const std::string folder = FLAGS_out.empty() ? "calibration" : FLAGS_out;
  if (Status writable = FileSet(folder).CheckWritable(); !writable) return writable;
  if (arguments.size() > 1) return CalibrateDevice(arguments, folder, *options, *device);
  const Result<Calibrated> one = CalibrateOne(arguments[0], folder, *options, *device);
  if (!one) return tl::unexpected(one.error());
  return CheckDetermined(one->report.calibration);
}

}  // namespace

Command CalibrateCommand() {
  Command command;
  command.name = "calibrate";
  command.arguments = "RECORDING...";
  command.summary =
      "focal length, readout time, delay, mounting and gyro bias: with their uncertainty, into "
      "calibration.yaml (trace.csv: the online estimate over time; delay.csv: the delay search); "
      "several recordings: of one device, each into a folder of its own, and the device's "
      "calibration";
  command.flags = {"out", "effects"};
  for (const std::string& name : FitFlags()) command.flags.push_back(name);
  command.flags.insert(command.flags.end(), {"device", "estimator", "refine"});
  for (const std::string& name : InputFlags()) command.flags.push_back(name);
  command.flags.insert(command.flags.end(), {"require", "search_s", "quiet"});
  command.run = RunCalibrate;
  return command;
}

}  // namespace camgyro
