// `camgyro diagnose RECORDING --out DIR`: the closed loop.
#include <gflags/gflags.h>

#include <cstdio>

#include "pipeline/input_yaml.h"
#include "pipeline/result_files.h"
#include "pipeline/run.h"
#include "tools/commands.h"
#include "tools/diagnosis_file.h"
#include "tools/diagnosis_report.h"
#include "tools/fit_flags.h"
#include "tools/progress_bar.h"
#include "tools/recording_input.h"
#include "tools/required.h"
#include "tools/summary.h"

DECLARE_string(out);
DECLARE_double(search_s);
DECLARE_bool(quiet);
DEFINE_double(significance, 0.01,
              "probability of naming an effect where there is none, all candidates of a round "
              "together");

namespace camgyro {
namespace {

Status RunDiagnose(const std::vector<std::string>& arguments) {
  DiagnoseOptions options;
  if (!(FLAGS_search_s > 0.0)) return BadUsage("--search_s: expected a positive number");
  if (Status known = CheckRequireFlag(); !known) return known;
  if (!(FLAGS_significance > 0.0 && FLAGS_significance < 1.0)) {
    return BadUsage("--significance: expected a number between 0 and 1");
  }
  options.calibrate.start.search_s = FLAGS_search_s;
  options.significance = FLAGS_significance;
  const Result<DeviceClass> device = DeviceFromFlag();
  if (!device) return tl::unexpected(device.error());
  options.calibrate.effects = EffectsFromFlag(*device);
  FileSet files(FLAGS_out.empty() ? "calibration" : FLAGS_out);
  if (Status writable = files.CheckWritable(); !writable) return writable;
  Result<Recording> recording = OpenRecording(arguments[0]);
  if (!recording) return tl::unexpected(recording.error());
  if (!FLAGS_quiet) {
    std::printf("%s: %s\n%s", recording->path.c_str(), DescribeRecording(*recording).c_str(),
                Notes("input", recording->notes).c_str());
    std::fflush(stdout);
  }
  Result<DiagnosisRun> run = CannotEstimate("");
  {
    ProgressBar bar;
    run = RunDiagnosis(
        options, *device, [&](const std::string& stage, double done) { bar.Show(stage, done); },
        &*recording);
  }
  if (!run) return tl::unexpected(run.error());
  if (Status strict = CheckStrict(*recording); !strict) return strict;
  const Diagnosis& diagnosis = run->diagnosis;
  const bool attitudes = recording->HasOnlyAttitudes();
  files.Add("diagnosis.yaml", DiagnosisYaml(diagnosis));
  if (diagnosis.before) {
    const std::string yaml = CalibrationYaml(diagnosis.result(), attitudes) + InputYaml(*recording);
    files.Add("calibration.yaml", yaml);
    const Command command = DiagnoseCommand();
    const Result<std::string> html =
        DiagnosisReportHtml(*recording, run->tracking.pictures, diagnosis,
                            {CommandLineOf(command, arguments), DescribeRecording(*recording),
                             FlagValues(command), yaml});
    if (!html) return tl::unexpected(html.error());
    files.Add("report.html", *html);
    files.Add("trace.csv", TraceCsv(diagnosis.before->trace));
    files.Add("delay.csv", DelayCsv(diagnosis.result().start.curve));
    files.Add("residual_maps.csv", ResidualMapsCsv(diagnosis));
    if (const auto& frame_times = diagnosis.result().frame_times; !frame_times.empty()) {
      files.Add("frame_times.csv", FrameTimesCsv(*recording, frame_times));
    }
    if (diagnosis.after) {
      files.Add("calibration_before.yaml", CalibrationYaml(*diagnosis.before, attitudes));
    }
  }
  if (Status written = files.Write(); !written) return written;
  if (diagnosis.before) {
    std::printf("\n%s\n%s", ParameterTable(diagnosis.result().calibration, attitudes).c_str(),
                SystematicLine(diagnosis.result()).c_str());
  }
  std::printf("%s", DiagnosisText(diagnosis, attitudes).c_str());
  if (!FLAGS_quiet && diagnosis.before) {
    std::printf("%s%s%s", HalvesLine(diagnosis.result().halves_chi2).c_str(),
                TimeLine(diagnosis.times, run->tracking.seconds, recording->frames.size()).c_str(),
                Notes("doubt", diagnosis.result().doubts).c_str());
  }
  if (!FLAGS_quiet) {
    std::printf("written    %s/diagnosis.yaml%s\n", files.folder().c_str(),
                diagnosis.before
                    ? ", calibration.yaml, report.html, residual_maps.csv, trace.csv, delay.csv"
                    : "");
  }
  if (diagnosis.refusal) return tl::unexpected(Refusal(*recording, *diagnosis.refusal));
  if (!diagnosis.not_tested.empty()) return CannotEstimate("diagnosis: " + diagnosis.not_tested);
  if (diagnosis.before) return CheckDetermined(diagnosis.result().calibration);
  return {};
}

}  // namespace

Command DiagnoseCommand() {
  Command command;
  command.name = "diagnose";
  command.arguments = "RECORDING";
  command.summary =
      "the closed loop: finds what the model lacks in frames that the fit has not seen, names the "
      "effect, adds it, and reports the error before and after, into diagnosis.yaml (and "
      "calibration.yaml with the effects, calibration_before.yaml without)";
  command.flags = {"out", "effects", "device", "significance"};
  for (const std::string& name : InputFlags()) command.flags.push_back(name);
  command.flags.insert(command.flags.end(), {"require", "search_s", "quiet"});
  command.run = RunDiagnose;
  return command;
}

}  // namespace camgyro
