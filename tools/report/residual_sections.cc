#include "tools/report/residual_sections.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/robust_statistics.h"
#include "tools/report/charts.h"

namespace camgyro {
namespace {

constexpr size_t kMinCount = 12;  // matches in a cell or bin
constexpr int kMapColumns = 16;
constexpr int kBins = 30;

// What a cell of the picture has seen.
struct Cell {
  std::vector<double> residuals;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();  // of corrections, gross errors left out
  int count = 0;                                  // of them
};

ImageMap MapOf(const TitledResiduals& fit, int width_px, int height_px) {
  const int columns = kMapColumns;
  const int rows = std::max(1, columns * height_px / std::max(1, width_px));
  std::vector<Cell> cells(static_cast<size_t>(columns * rows));
  std::vector<double> all;
  for (const MatchResidual& r : fit.residuals) all.push_back(r.residual_px);
  const double gross = 4.0 * TypicalResidual(all, 1);  // by this fit's own standard
  for (const MatchResidual& r : fit.residuals) {
    const int column =
        std::clamp(static_cast<int>(columns * r.match.px_b.x() / width_px), 0, columns - 1);
    const int row = std::clamp(static_cast<int>(rows * r.match.px_b.y() / height_px), 0, rows - 1);
    Cell& cell = cells[static_cast<size_t>(row * columns + column)];
    cell.residuals.push_back(r.residual_px);
    if (std::abs(r.residual_px) > gross) continue;
    ++cell.count;
    cell.sum += r.correction_px;
  }
  ImageMap map;
  map.title = fit.title;
  map.value.resize(rows, columns);
  map.arrow_x.resize(rows, columns);
  map.arrow_y.resize(rows, columns);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Cell& cell = cells[static_cast<size_t>(row * columns + column)];
      map.value(row, column) = TypicalResidual(cell.residuals, kMinCount);
      const Eigen::Vector2d mean = cell.count >= static_cast<int>(kMinCount)
                                       ? Eigen::Vector2d(cell.sum / cell.count)
                                       : Eigen::Vector2d(std::nan(""), std::nan(""));
      map.arrow_x(row, column) = mean.x();
      map.arrow_y(row, column) = mean.y();
    }
  }
  return map;
}

// Typical residuals over bins of a quantity; bins of equal width over the 0.5 to 99.5 % range.
std::string Profile(const std::string& id, const std::string& title, const std::string& x_label,
                    const std::vector<TitledResiduals>& fits, double noise_px,
                    const std::function<double(const MatchResidual&)>& quantity) {
  std::vector<double> all;
  for (const TitledResiduals& fit : fits) {
    for (const MatchResidual& r : fit.residuals) all.push_back(quantity(r));
  }
  if (all.size() < kMinCount) return "";
  std::sort(all.begin(), all.end());
  const double low = all[all.size() / 200], high = all[all.size() - 1 - all.size() / 200];
  const double width = std::max(1e-12, high - low) / kBins;
  LineChart chart;
  chart.id = id;
  chart.title = title;
  chart.x_label = x_label;
  chart.y_label = "typical residual [px]";
  chart.log_y = true;
  for (int i = 0; i < kBins; ++i) chart.x.push_back(low + (i + 0.5) * width);
  for (size_t f = 0; f < fits.size(); ++f) {
    std::vector<std::vector<double>> bins(kBins);
    for (const MatchResidual& r : fits[f].residuals) {
      const double place = (quantity(r) - low) / width;
      if (place < 0.0 || place > kBins) continue;
      bins[static_cast<size_t>(std::min(kBins - 1, static_cast<int>(place)))].push_back(
          r.residual_px);
    }
    ChartSeries series{fits[f].title, {}, {}, false, false};
    for (const auto& bin : bins) series.y.push_back(TypicalResidual(bin, kMinCount));
    chart.series.push_back(std::move(series));
  }
  chart.series.push_back({"noise", std::vector<double>(kBins, noise_px), {}, false, true});
  return LineChartHtml(chart);
}

}  // namespace

double TypicalResidual(const std::vector<double>& residuals_px, size_t min_count) {
  if (residuals_px.size() < std::max<size_t>(1, min_count)) return std::nan("");
  std::vector<double> magnitudes;
  for (const double r : residuals_px) magnitudes.push_back(std::abs(r));
  return kSigmaOfMedian * MedianInPlace(&magnitudes);
}

ReportSection ResidualSection(const std::string& id, const std::string& title,
                              const std::vector<TitledResiduals>& fits, int width_px, int height_px,
                              double noise_px) {
  std::vector<ImageMap> maps;
  for (const TitledResiduals& fit : fits) maps.push_back(MapOf(fit, width_px, height_px));
  std::string html =
      Paragraph(
          "Distance of matched features from where the calibration wants them (across their "
          "epipolar lines): the standard deviation of each cell or bin, robust against "
          "outliers. A right model leaves noise, the same everywhere; a pattern is something "
          "that the model lacks.",
          "note") +
      ImageMapsHtml(id + "-image",
                    "Over the picture. Arrows: the mean correction of a cell, which noise "
                    "alone would make vanish.",
                    maps, width_px, height_px, "px");
  html += ChartGrid({Profile(id + "-row", "Over the row", "row [px]", fits, noise_px,
                             [](const MatchResidual& r) { return r.match.px_b.y(); }),
                     Profile(id + "-time", "Over time", "time since the first gyro sample [s]",
                             fits, noise_px, [](const MatchResidual& r) { return r.time_s; }),
                     Profile(id + "-rate", "Over the rate", "rate of rotation [rad/s]", fits,
                             noise_px, [](const MatchResidual& r) { return r.rate_rad_s; })});
  return {id, title, html};
}

}  // namespace camgyro
