// `camgyro delay RECORDING`: only the delay search.
#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <utility>

#include "core/format.h"
#include "estimator/start/axis_permutation.h"
#include "estimator/start/find_start.h"
#include "estimator/start/focal_scan.h"
#include "estimator/start/slerp_delay_search.h"
#include "frontend/camera_rotations.h"
#include "frontend/lens_from_matches.h"
#include "frontend/two_view_rotation.h"
#include "pipeline/result_files.h"
#include "pipeline/run.h"
#include "tools/commands.h"
#include "tools/progress_bar.h"
#include "tools/recording_input.h"
#include "tools/summary.h"

DECLARE_string(out);
DECLARE_bool(quiet);
DECLARE_double(search_s);

namespace camgyro {
namespace {

constexpr int kPlotWidth = 72, kPlotHeight = 9;

// The curve as text: the smallest residual of each column, best at the bottom.
std::string Plot(const std::vector<DelayResidual>& curve) {
  const double first = curve.front().delay_s, last = curve.back().delay_s;
  std::vector<double> columns(kPlotWidth, 1.0);
  for (const DelayResidual& point : curve) {
    const double place = (point.delay_s - first) / std::max(1e-12, last - first);
    double& column = columns[static_cast<size_t>(std::lround(place * (kPlotWidth - 1)))];
    column = std::min(column, point.residual);
  }
  std::string plot;
  for (int row = kPlotHeight; row >= 0; --row) {
    plot += row % 3 == 0 ? Format("%8.0f %% ", 100.0 * row / kPlotHeight) : std::string(10, ' ');
    std::string line;
    for (const double value : columns) {
      line += static_cast<int>(std::lround(value * kPlotHeight)) == row ? '*' : ' ';
    }
    line.erase(line.find_last_not_of(' ') + 1);
    plot += "|" + line + "\n";
  }
  const std::string axis =
      Format("%11s%-*.3f%*.3f s\n", "", kPlotWidth / 2, first, kPlotWidth / 2, last);
  return plot + std::string(10, ' ') + "+" + std::string(kPlotWidth, '-') + "\n" + axis;
}

// Start of the `count` rotations in a row, each beginning where the one before ends, that turn
// most; -1 if there is no such row.
int LiveliestRow(const std::vector<CameraRotation>& rotations, int count) {
  int best = -1, run = 0;
  double best_angle = 0.0;
  for (int i = 0; i < static_cast<int>(rotations.size()); ++i) {
    const auto& rotation = rotations[static_cast<size_t>(i)];
    run = i > 0 && rotations[static_cast<size_t>(i - 1)].frame_b == rotation.frame_a ? run + 1 : 1;
    if (run < count) continue;
    double angle = 0.0;
    for (int k = i - count + 1; k <= i; ++k) {
      angle +=
          rotations[static_cast<size_t>(k)].q_a_b.angularDistance(Eigen::Quaterniond::Identity());
    }
    if (best < 0 || angle > best_angle) {
      best = i - count + 1;
      best_angle = angle;
    }
  }
  return best;
}

struct DelayReport {
  StartResult start;
  Result<SlerpDelay> slerp = CannotEstimate("fewer than 50 rotations in a row");
};

Result<DelayReport> FindDelay(const Recording& recording, ProgressBar* bar) {
  StartOptions options;
  options.search_s = FLAGS_search_s;
  bar->Show("delay", 0.0);
  std::vector<CameraRotation> rotations;
  Result<StartResult> start = CannotEstimate("");
  if (recording.HasOnlyAttitudes()) {
    rotations = CameraRotationsFromAttitudes(recording.q_cam_world, 1);
    start = FindStart(recording, rotations, options);
  } else {
    start = FindStartAndFocal(recording, RotationsFrom(recording), options, {});
  }
  if (!start) return tl::unexpected(start.error());
  if (start->focal) {
    const RotationTrial trial{start->focal->value_px,
                              RoughlyAligned(*start, start->readout->value_s)};
    rotations = CameraRotationsOf(recording, PairsForRotations(recording), {trial}).front();
  }
  DelayReport report;
  report.start = std::move(*start);
  SlerpOptions slerp;
  slerp.centre_s = report.start.delay_middle_row_s;
  // The paper's choice interpolates between camera frames: 3 to 10 ms of scatter between windows of
  // tablet-attitude D03, D11 and tools/sample; this one 1 to 3 ms.
  slerp.reference = SlerpReference::kCamera;
  const int first = LiveliestRow(rotations, slerp.window_pairs);
  if (first >= 0) {
    report.slerp = SlerpDelaySearch(recording, rotations, first, report.start.q_gyro_cam,
                                    report.start.bias_gyro_rad_s, slerp);
  }
  return report;
}

std::string SlerpCsv(const SlerpDelay& slerp) {
  std::ostringstream out;
  out.precision(10);
  out << "#delay_s,mean_square_rad2\n";
  for (const SlerpDelayPoint& point : slerp.curve) {
    out << point.delay_s << "," << point.mean_square_rad2 << "\n";
  }
  return out.str();
}

std::string Scanned(bool determined, double value, double sigma, const char* unit) {
  return Format(determined ? "%.1f ± %.1f %s" : "%.1f (± %.1f) %s", value, sigma, unit);
}

Status RunDelay(const std::vector<std::string>& arguments) {
  if (!(FLAGS_search_s > 0.0)) return BadUsage("--search_s: expected a positive number");
  FileSet files(FLAGS_out);
  if (!FLAGS_out.empty()) {
    if (Status writable = files.CheckWritable(); !writable) return writable;
  }
  Result<Recording> recording = OpenRecording(arguments[0]);
  if (!recording) return tl::unexpected(recording.error());
  Result<DelayReport> report = CannotEstimate("");
  {
    ProgressBar bar;
    const Result<TrackingSummary> tracking = EnsureImageMotion(
        [&](const std::string& stage, double done) { bar.Show(stage, done); }, &*recording);
    if (!tracking) return tl::unexpected(tracking.error());
    if (Status strict = CheckStrict(*recording); !strict) return strict;
    report = FindDelay(*recording, &bar);
  }
  if (!report) return tl::unexpected(Refusal(*recording, report.error()));
  const StartResult& start = report->start;
  if (!FLAGS_out.empty()) {
    files.Add("delay.csv", DelayCsv(start.curve));
    if (report->slerp) files.Add("delay_slerp.csv", SlerpCsv(*report->slerp));
    if (Status written = files.Write(); !written) return written;
  }

  std::printf("delay      %.2f ± %.2f ms   gyro clock = camera stamp + delay, in the middle row\n",
              1e3 * start.delay_middle_row_s, 1e3 * start.delay_sigma_s);
  if (FLAGS_quiet) return {};
  if (report->slerp) {
    std::printf("           %.2f ms by 50 rotations in a row (Feng et al.)\n",
                1e3 * report->slerp->delay_s);
  } else {
    std::printf("           no search of Feng et al.: %s\n", report->slerp.error().message.c_str());
  }
  std::printf("mounting   %s, turned by %.1f deg\n",
              DescribePermutation(start.nearest_permutation).c_str(),
              57.29577951308232 * start.permutation_angle_rad);
  if (start.focal && start.readout) {
    std::printf("camera     for a start: focal length %s, readout %s\n",
                Scanned(start.focal->determined, start.focal->value_px, start.focal->sigma_px, "px")
                    .c_str(),
                Scanned(start.readout->determined, 1e3 * start.readout->value_s,
                        1e3 * start.readout->sigma_s, "ms")
                    .c_str());
  }
  if (const auto lens = FindLensFromMatches(*recording)) {
    std::printf("           by the matches, the lens moves corners by %.1f ± %.1f %%%s%s\n",
                100.0 * lens->lambda, 100.0 * lens->sigma,
                recording->camera.distortion_model == DistortionModel::kNone
                    ? ""
                    : " beside what is declared",
                recording->camera.division_lambda != 0.0 ? ": looked through" : "");
  }
  if (start.stabiliser) {
    const StartStabiliser& lens = *start.stabiliser;
    std::printf("lens       makes up for %.1f ± %.1f %% of fast turns: %s\n", 100.0 * lens.gain,
                100.0 * lens.gain_sigma,
                lens.follows_turns ? "stabilised"
                : lens.is_held     ? "not stabilised"
                                   : "these rotations do not tell whether it is stabilised");
  }
  std::printf(
      "trust      the camera explains %.0f %% of the gyro's motion; the next best delay, "
      "%.3f s,\n           leaves %.0f times as much unexplained\n",
      100.0 * start.explained, start.runner_up_delay_s,
      1.0 / std::max(1e-3, start.runner_up_ratio));
  std::printf("%s\n  unexplained, by delay\n%s", Notes("note", start.notes).c_str(),
              Plot(start.curve).c_str());
  if (!FLAGS_out.empty()) std::printf("written    %s/delay.csv\n", files.folder().c_str());
  return {};
}

}  // namespace

Command DelayCommand() {
  Command command;
  command.name = "delay";
  command.arguments = "RECORDING";
  command.summary =
      "delay between camera and gyro, by rotations alone: with its curve (--out: delay.csv, and "
      "delay_slerp.csv of the windowed search)";
  command.flags = {"out", "search_s"};
  for (const std::string& name : InputFlags()) command.flags.push_back(name);
  command.flags.push_back("quiet");
  command.run = RunDelay;
  return command;
}

}  // namespace camgyro
