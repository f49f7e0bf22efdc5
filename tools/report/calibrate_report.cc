#include "tools/report/calibrate_report.h"

#include <array>
#include <functional>

#include "core/parallel.h"
#include "estimator/residual_table.h"
#include "tools/report/frame_times_section.h"
#include "tools/report/recording_sections.h"
#include "tools/report/residual_sections.h"

namespace camgyro {
namespace {

constexpr size_t kMaxResidualPairs = 600;  // for the maps; spread over longer recordings

// The calibration that the fit started from: what the files declare and the delay search found.
Calibration StartOf(const Recording& recording, const StartResult& start) {
  Calibration calibration = MakePrior(recording, start).mean;
  calibration.bias_gyro_rad_s = start.bias_gyro_rad_s;
  return calibration;
}

std::vector<TimedPair> EvenlyChosen(std::vector<TimedPair> pairs) {
  if (pairs.size() <= kMaxResidualPairs) return pairs;
  std::vector<TimedPair> some;
  for (size_t i = 0; i < kMaxResidualPairs; ++i) {
    some.push_back(std::move(pairs[i * pairs.size() / kMaxResidualPairs]));
  }
  return some;
}

}  // namespace

Result<std::vector<ReportSection>> CalibrationSections(const Recording& recording,
                                                       const SmallPictures& pictures,
                                                       const CalibrationReport& report,
                                                       const RunInfo& run) {
  const bool attitudes = recording.HasOnlyAttitudes();
  const Calibration& calibration = report.calibration;
  std::vector<ReportSection> sections = {SummarySection(recording, report, attitudes),
                                         MotionSection(recording, report, attitudes),
                                         ConvergenceSection(report), DelaySection(report.start)};
  // What takes long, beside each other.
  ReportSection rates;
  std::vector<TitledResiduals> fits = {{"at the start", {}}, {"calibrated", {}}};
  Result<ReportSection> matches;
  const auto make_rates = [&] { rates = RatesSection(recording, calibration); };
  if (!attitudes) {
    const EstimationInput input = OutlineOf(recording, SelectPairs(recording));
    std::vector<TimedPair> pairs = EvenlyChosen(input.pairs);
    AddMatches(recording, &pairs);
    PairGraphOptions options;
    options.match_noise = recording.match_noise;
    options.residual = report.residual;
    const double noise_px = report.quality.noise_px;
    const std::array<std::function<void()>, 3> parts = {
        [&] {
          fits[1].residuals = ComputeResiduals(input, pairs, calibration, noise_px, options);
          matches = MatchesSection(recording, pictures, fits[1].residuals);
        },
        make_rates,
        [&] {
          fits[0].residuals =
              ComputeResiduals(input, pairs, StartOf(recording, report.start), noise_px, options);
        }};
    ParallelFor(parts.size(), [&](size_t i) { parts.at(i)(); });
    if (!matches) return tl::unexpected(matches.error());
    sections.push_back(std::move(rates));
    sections.push_back(ResidualSection("residuals", "What is left unexplained", fits,
                                       calibration.width_px, calibration.height_px, noise_px));
    sections.push_back(FitSection(report, attitudes));
    sections.push_back(std::move(*matches));
  } else {
    make_rates();
    sections.push_back(std::move(rates));
    sections.push_back(FitSection(report, attitudes));
  }
  if (!report.frame_times.empty()) sections.push_back(FrameTimesSection(recording, report));
  sections.push_back(ReproductionSection(run));
  return sections;
}

Result<std::string> CalibrationReportHtml(const Recording& recording, const SmallPictures& pictures,
                                          const CalibrationReport& report, const RunInfo& run) {
  const Result<std::vector<ReportSection>> sections =
      CalibrationSections(recording, pictures, report, run);
  if (!sections) return tl::unexpected(sections.error());
  return ReportPage("Calibration of " + recording.path, run.recording, *sections);
}

}  // namespace camgyro
