#include "tools/report/frame_times_section.h"

#include <algorithm>
#include <cmath>

#include "core/format.h"
#include "core/time.h"
#include "tools/report/charts.h"

namespace camgyro {
namespace {

// Offsets that the matches tell better than their spread alone does: the camera turned.
bool IsTold(const FrameOffset& frame, double spread_s) { return frame.sigma_s < 0.5 * spread_s; }

LineChart OverTime(const Recording& recording, const CalibrationReport& report) {
  LineChart chart;
  chart.id = "frame-times";
  chart.title = "Frame time less its stamp";
  chart.x_label = "time [s]";
  chart.y_label = "ms";
  ChartSeries series{"offset ± σ", {}, {}, true, false};
  const double first_s =
      SecondsSince(recording.gyro.front().stamp_ns, recording.frames.front().stamp_ns);
  for (const FrameOffset& frame : report.frame_times) {
    chart.x.push_back(1e-9 * static_cast<double>(frame.frame) - first_s);
    series.y.push_back(1e3 * frame.offset_s);
    series.band.push_back(1e3 * frame.sigma_s);
  }
  chart.series = {series};
  return chart;
}

// Shares of the offsets in bins of half a spread, beside the Gaussian that the fit assumes.
LineChart Distribution(const CalibrationReport& report, double spread_s) {
  constexpr int kBins = 33;  // up to 8 spreads on either side
  constexpr double kBinSpreads = 0.5;
  std::vector<int> counts(kBins, 0);
  int told = 0;
  for (const FrameOffset& frame : report.frame_times) {
    if (!IsTold(frame, spread_s)) continue;
    const int bin =
        static_cast<int>(std::lround(frame.offset_s / (kBinSpreads * spread_s))) + kBins / 2;
    ++counts[static_cast<size_t>(std::clamp(bin, 0, kBins - 1))];
    ++told;
  }
  LineChart chart;
  chart.id = "frame-times-distribution";
  chart.title = Format("Distribution over %d frames", told);
  chart.x_label = "frame time less its stamp [ms]";
  chart.y_label = "share of the frames [%]";
  ChartSeries found{"found", {}, {}, false, false}, assumed{"assumed", {}, {}, false, true};
  for (int i = 0; i < kBins; ++i) {
    const int from_middle = i - kBins / 2;
    const double at = kBinSpreads * from_middle;
    chart.x.push_back(1e3 * spread_s * at);
    found.y.push_back(100.0 * counts[static_cast<size_t>(i)] / std::max(1, told));
    assumed.y.push_back(100.0 * kBinSpreads / std::sqrt(2.0 * M_PI) * std::exp(-0.5 * at * at));
  }
  chart.series = {found, assumed};
  return chart;
}

}  // namespace

ReportSection FrameTimesSection(const Recording& recording, const CalibrationReport& report) {
  const Calibration& c = report.calibration;
  const int column = c.effects->frame_time_spread();
  const double spread_s = c.effect_values[column];
  std::vector<double> distances;
  for (const FrameOffset& frame : report.frame_times) {
    if (IsTold(frame, spread_s)) distances.push_back(std::abs(frame.offset_s));
  }
  std::sort(distances.begin(), distances.end());
  std::string text = Format(
      "The frames' stamps scatter around the times at which they were taken with a standard "
      "deviation of %.2f ± %.2f ms.",
      1e3 * spread_s, 1e3 * std::sqrt(c.effect_covariance(column, column)));
  if (!distances.empty()) {
    text += Format(
        " Of the %zu frames whose time the matches tell, half are within %.2f ms of their stamp, "
        "95 %% within %.2f ms, all within %.2f ms.",
        distances.size(), 1e3 * distances[distances.size() / 2],
        1e3 * distances[distances.size() * 95 / 100], 1e3 * distances.back());
  }
  return {"frame-times", "The frames' own times",
          Paragraph(text) +
              Paragraph("While the camera hardly turns, a frame's time cannot be told: it stays "
                        "near its stamp, with the whole spread as its sigma. The times are in "
                        "frame_times.csv.",
                        "note") +
              ChartGrid({LineChartHtml(OverTime(recording, report)),
                         LineChartHtml(Distribution(report, spread_s))})};
}

}  // namespace camgyro
