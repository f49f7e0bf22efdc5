// `camgyro batch MANIFEST --out=DIR`: many recordings, of one device or of many.
#include <gflags/gflags.h>
#include <sys/prctl.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <thread>
#include <utility>

#include "core/format.h"
#include "pipeline/device.h"
#include "pipeline/read_calibration.h"
#include "pipeline/result_files.h"
#include "tools/batch/manifest.h"
#include "tools/batch/outcome.h"
#include "tools/batch/tables.h"
#include "tools/commands.h"
#include "tools/comparison/processes.h"
#include "tools/fit_flags.h"
#include "tools/progress_bar.h"
#include "tools/recording_input.h"
#include "tools/report/build_info.h"
#include "tools/summary.h"

DECLARE_string(out);
DECLARE_int32(jobs);
DECLARE_int32(threads);
DECLARE_bool(quiet);
DEFINE_string(only, "",
              "a device of the manifest: works on its recordings alone, and writes nothing outside "
              "of its folder, so that several machines may work on one --out");

namespace camgyro {
namespace {

namespace fs = std::filesystem;
using batch::BatchDevice;
using batch::BatchRecording;
using batch::BatchResult;
using batch::Outcome;

// A worker that crashed or was killed; `camgyro` itself does not end with it.
constexpr int kCrashed = 1;

std::string FolderOf(const BatchRecording& row) {
  return (fs::path(FLAGS_out) / row.folder).string();
}

// What makes a result another one: the flags that a worker obeys, and the program.
std::string CommandOf(const BatchRecording& row) {
  Command calibrate = BatchCommand();
  calibrate.name = "calibrate";
  const auto of_batch = [](const std::string& name) {
    return name == "out" || name == "only" || name == "jobs" || name == "threads" ||
           name == "quiet";
  };
  calibrate.flags.erase(std::remove_if(calibrate.flags.begin(), calibrate.flags.end(), of_batch),
                        calibrate.flags.end());
  return CommandLineOf(calibrate, {row.path}) + Format(" (camgyro %s, %s)", kVersion, kGitCommit);
}

// Calibrates one recording, in a process of its own, which ends with this one: nobody would wait
// for it.
Result<std::string> Work(const BatchRecording& row) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const Result<Outcome> done = batch::RunLogged(FolderOf(row), CommandOf(row), [&] {
    FLAGS_out = FolderOf(row);
    FLAGS_quiet = false;
    return CalibrateCommand().run({row.path});
  });
  if (!done) return tl::unexpected(done.error());
  return std::string();
}

// Runs what has no outcome yet, or one of another command. Messages of workers that had none to
// leave, by row.
std::vector<std::string> RunMissing(const std::vector<BatchRecording>& rows) {
  std::vector<size_t> missing;
  for (size_t i = 0; i < rows.size(); ++i) {
    const auto outcome = batch::ReadOutcome(FolderOf(rows[i]));
    if (!outcome || outcome->command != CommandOf(rows[i])) missing.push_back(i);
  }
  if (!FLAGS_quiet) {
    std::printf("%zu recordings, %zu of them done before\n", rows.size(),
                rows.size() - missing.size());
  }
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const int jobs = FLAGS_jobs > 0 ? FLAGS_jobs : cores;
  if (FLAGS_threads == 0) FLAGS_threads = std::max(1, cores / jobs);
  ProgressBar bar;
  const auto answers = comparison::RunInProcesses(
      static_cast<int>(missing.size()), jobs,
      [&](int i) { return Work(rows[missing[static_cast<size_t>(i)]]); },
      [&](int done) {
        bar.Show("recordings", static_cast<double>(done) / static_cast<double>(missing.size()));
      });
  std::vector<std::string> crashes(rows.size());
  for (size_t i = 0; i < answers.size(); ++i) {
    if (!answers[i]) crashes[missing[i]] = answers[i].error().message;
  }
  return crashes;
}

BatchResult ResultOf(const BatchRecording& row, const std::string& crash) {
  BatchResult result;
  result.recording = row;
  const auto outcome = batch::ReadOutcome(FolderOf(row));
  if (!outcome) {
    result.outcome = {CommandOf(row), kCrashed, crash, 0.0};
    result.left_out = "not calibrated";
    return result;
  }
  result.outcome = *outcome;
  const std::string file = FolderOf(row) + "/calibration.yaml";
  if (!fs::exists(file)) {
    result.left_out = "not calibrated";
    return result;
  }
  Result<CalibrationReport> report = ReadCalibrationReport(file);
  if (report) {
    result.report = *std::move(report);
  } else {
    result.left_out = report.error().message;
  }
  return result;
}

std::string NameOf(const BatchResult& result) {
  return fs::path(result.recording.folder).filename().string();
}

// What the device's recordings say together. One that cannot be of the camera of the first one is
// left out.
Status CombineDevice(BatchDevice* device) {
  std::vector<std::string> names;
  std::vector<const CalibrationReport*> reports;
  for (BatchResult& result : device->results) {
    if (!result.left_out.empty()) continue;
    if (!names.empty()) {
      const Result<DeviceReport> pair = CombineToDevice({names.front(), NameOf(result)},
                                                        {reports.front(), &*result.report}, false);
      if (!pair) {
        result.left_out = pair.error().message;
        continue;
      }
    }
    names.push_back(NameOf(result));
    reports.push_back(&*result.report);
  }
  if (names.empty()) return {};
  Result<DeviceReport> combined = CombineToDevice(names, reports, /*attitudes=*/false);
  if (!combined) return tl::unexpected(combined.error());
  device->combined = *std::move(combined);
  return {};
}

// Relative to --out.
std::string TableOfRecordings() { return (fs::path(FLAGS_only) / "recordings.csv").string(); }

Status WriteTables(const std::vector<BatchDevice>& devices) {
  FileSet files(FLAGS_out);
  for (const BatchDevice& device : devices) {
    files.Add(device.name + "/device.csv", batch::DeviceCsv(device));
    files.Add(device.name + "/device.html", batch::DevicePage(device));
    if (device.combined) files.Add(device.name + "/calibration.yaml", DeviceYaml(*device.combined));
  }
  files.Add(TableOfRecordings(), batch::RecordingsCsv(devices));
  return files.Write();
}

void PrintDevice(const BatchDevice& device) {
  std::printf("\n%s: ", device.name.c_str());
  if (device.combined) {
    std::printf("%s", DeviceTable(*device.combined).c_str());
  } else {
    std::printf("none of its recordings could be calibrated\n");
  }
  for (const BatchResult& result : device.results) {
    if (result.outcome.exit_code == 0 && result.left_out.empty()) continue;
    const std::string why =
        result.outcome.message.empty() ? result.left_out : result.outcome.message;
    std::printf("%s", Notes("failed", {result.recording.folder +
                                       Format(" (exit code %d): ", result.outcome.exit_code) + why})
                          .c_str());
  }
}

// Of the worst recording: bad input before what the data do not determine.
Status ExitOf(const std::vector<BatchDevice>& devices) {
  size_t recordings = 0, failed = 0;
  ErrorKind kind = ErrorKind::kCannotEstimate;
  for (const BatchDevice& device : devices) {
    recordings += device.results.size();
    for (const BatchResult& result : device.results) {
      if (result.outcome.exit_code == 0) continue;
      ++failed;
      if (result.outcome.exit_code < static_cast<int>(ErrorKind::kCannotEstimate)) {
        kind = ErrorKind::kBadInput;
      }
    }
  }
  if (failed == 0) return {};
  return tl::unexpected(
      Error{kind, Format("%zu of %zu recordings failed; %s/%s says why", failed, recordings,
                         FLAGS_out.c_str(), TableOfRecordings().c_str())});
}

// Those of the workers, too: before all of them complain.
Status CheckFlags() {
  if (FLAGS_out.empty()) return BadUsage("--out: expected a folder for the results");
  if (FLAGS_jobs < 0) return BadUsage("--jobs: expected a number above zero");
  PairGraphOptions unused;
  if (Status fit = ReadFitFlags(&unused); !fit) return fit;
  if (const auto device = DeviceFromFlag(); !device) return tl::unexpected(device.error());
  if (const auto read = ReadOptionsFromFlags(); !read) return tl::unexpected(read.error());
  return {};
}

// Of the manifest, those that --only leaves.
Result<std::vector<BatchRecording>> RowsOf(const std::string& manifest) {
  Result<std::vector<BatchRecording>> rows = batch::ReadManifest(manifest);
  if (!rows || FLAGS_only.empty()) return rows;
  const auto of_another = [](const BatchRecording& row) { return row.device != FLAGS_only; };
  rows->erase(std::remove_if(rows->begin(), rows->end(), of_another), rows->end());
  if (rows->empty()) return BadUsage("--only: " + manifest + " has no device " + FLAGS_only);
  return rows;
}

Status RunBatch(const std::vector<std::string>& arguments) {
  if (Status flags = CheckFlags(); !flags) return flags;
  if (Status writable = FileSet(FLAGS_out).CheckWritable(); !writable) return writable;
  const Result<std::vector<BatchRecording>> rows = RowsOf(arguments[0]);
  if (!rows) return tl::unexpected(rows.error());
  const std::vector<std::string> crashes = RunMissing(*rows);
  std::vector<BatchDevice> devices;
  for (const std::string& name : batch::DevicesOf(*rows)) {
    BatchDevice& device = devices.emplace_back();
    device.name = name;
    for (size_t i = 0; i < rows->size(); ++i) {
      if ((*rows)[i].device == name) device.results.push_back(ResultOf((*rows)[i], crashes[i]));
    }
    if (Status combined = CombineDevice(&device); !combined) return combined;
  }
  if (Status written = WriteTables(devices); !written) return written;
  for (const BatchDevice& device : devices) PrintDevice(device);
  if (!FLAGS_quiet) {
    std::printf("\nwritten    %s/%s; of each device device.csv, device.html, calibration.yaml\n",
                FLAGS_out.c_str(), TableOfRecordings().c_str());
  }
  return ExitOf(devices);
}

}  // namespace

Command BatchCommand() {
  Command command;
  command.name = "batch";
  command.arguments = "MANIFEST";
  command.summary =
      "many recordings, resumable, and a table per device: MANIFEST is a csv file with the columns "
      "device and recording; every recording gets a folder below --out, every device its "
      "calibration and how well its recordings repeat it; what is done is not done again";
  command.flags = {"out", "only", "jobs"};
  for (const std::string& name : FitFlags()) command.flags.push_back(name);
  command.flags.push_back("device");
  for (const std::string& name : InputFlags()) command.flags.push_back(name);
  command.flags.insert(command.flags.end(), {"search_s", "quiet"});
  command.run = RunBatch;
  return command;
}

}  // namespace camgyro
