#include "tools/report/charts.h"

extern "C" {
#include <libavutil/base64.h>
}

#include <algorithm>
#include <array>
#include <cmath>

#include "core/format.h"
#include "tools/report/page.h"

namespace camgyro {
namespace {

std::string JsonText(const std::string& text) {
  std::string json = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') json += '\\';
    // A '<' could end the script element that holds the data.
    json += c == '<' ? std::string("\\u003c") : std::string(1, c);
  }
  return json + "\"";
}

std::string JsonNumbers(const std::vector<double>& values) {
  std::string json = "[";
  for (size_t i = 0; i < values.size(); ++i) {
    if (i > 0) json += ",";
    json += std::isfinite(values[i]) ? Format("%.7g", values[i]) : "null";
  }
  return json + "]";
}

// Dark blue to yellow, even in lightness and the same to colour-blind eyes (cividis, Nunez et al.
// 2018), at 0, 1/6, ... 1.
constexpr std::array<std::array<double, 3>, 7> kCividis = {{{0, 34, 78},
                                                            {42, 63, 109},
                                                            {87, 93, 109},
                                                            {124, 123, 120},
                                                            {165, 156, 116},
                                                            {210, 193, 94},
                                                            {254, 232, 56}}};

std::string Colour(double share) {
  const double place = std::clamp(share, 0.0, 1.0) * (kCividis.size() - 1);
  const size_t low = std::min(static_cast<size_t>(place), kCividis.size() - 2);
  const double weight = place - static_cast<double>(low);
  std::array<long, 3> rgb;
  for (size_t i = 0; i < 3; ++i) {
    rgb[i] = std::lround((1.0 - weight) * kCividis[low][i] + weight * kCividis[low + 1][i]);
  }
  return Format("#%02lx%02lx%02lx", rgb[0], rgb[1], rgb[2]);
}

struct MapScale {
  double low = 1.0, high = 1.0;  // of the colours
  double arrow = 0.0;            // longest arrow
  double Share(double value) const { return std::log(value / low) / std::log(high / low); }
};

MapScale ScaleOf(const std::vector<ImageMap>& maps) {
  std::vector<double> values;
  MapScale scale;
  for (const ImageMap& map : maps) {
    for (Eigen::Index i = 0; i < map.value.size(); ++i) {
      const double value = map.value.reshaped()[i];
      if (!(value > 0.0)) continue;
      values.push_back(value);
      if (map.arrow_x.size() == 0) continue;
      const double arrow = std::hypot(map.arrow_x.reshaped()[i], map.arrow_y.reshaped()[i]);
      if (std::isfinite(arrow)) scale.arrow = std::max(scale.arrow, arrow);
    }
  }
  if (values.empty()) return scale;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  scale.low = *low;
  scale.high = std::max(*high, 1.5 * *low);
  return scale;
}

std::string MapSvg(const ImageMap& map, double width, double height, const MapScale& scale,
                   const std::string& unit) {
  const double cell_x = width / static_cast<double>(map.value.cols());
  const double cell_y = height / static_cast<double>(map.value.rows());
  std::string svg = Format("<svg viewBox=\"0 0 %g %g\" class=\"map\">", width, height);
  std::string arrows;
  for (Eigen::Index row = 0; row < map.value.rows(); ++row) {
    for (Eigen::Index col = 0; col < map.value.cols(); ++col) {
      const double value = map.value(row, col);
      const double x = cell_x * static_cast<double>(col), y = cell_y * static_cast<double>(row);
      if (!(value > 0.0)) continue;
      svg += Format(
          "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\"><title>%.3g "
          "%s</title></rect>",
          x, y, cell_x, cell_y, Colour(scale.Share(value)).c_str(), value, unit.c_str());
      if (map.arrow_x.size() == 0 || !(scale.arrow > 0.0)) continue;
      const double length = 0.48 * std::min(cell_x, cell_y) / scale.arrow;
      const double dx = length * map.arrow_x(row, col), dy = length * map.arrow_y(row, col);
      if (!std::isfinite(dx)) continue;
      const double cx = x + 0.5 * cell_x, cy = y + 0.5 * cell_y;
      const std::string line = Format("x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"", cx - dx,
                                      cy - dy, cx + dx, cy + dy);
      arrows += "<line class=\"halo\" " + line + "/><line class=\"arrow\" " + line + "/>" +
                Format("<circle class=\"arrow\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/>", cx + dx,
                       cy + dy, 0.05 * std::min(cell_x, cell_y));
    }
  }
  return svg + arrows + "</svg>";
}

std::string ColourBar(const MapScale& scale, const std::string& unit) {
  constexpr int kSteps = 24;
  std::string svg = "<svg viewBox=\"0 0 240 12\" class=\"bar\">";
  for (int i = 0; i < kSteps; ++i) {
    svg += Format("<rect x=\"%d\" y=\"0\" width=\"10.5\" height=\"12\" fill=\"%s\"/>", 10 * i,
                  Colour((i + 0.5) / kSteps).c_str());
  }
  return Format("<span>%.2g %s</span> ", scale.low, unit.c_str()) + svg + "</svg>" +
         Format(" <span>%.2g %s (logarithmic)</span>", scale.high, unit.c_str());
}

std::string Base64(const std::vector<unsigned char>& bytes) {
  std::string text(static_cast<size_t>(AV_BASE64_SIZE(bytes.size())), '\0');
  av_base64_encode(text.data(), static_cast<int>(text.size()), bytes.data(),
                   static_cast<int>(bytes.size()));
  text.resize(text.find('\0'));
  return text;
}

}  // namespace

std::string LineChartHtml(const LineChart& chart) {
  std::string json = "{\"x\":" + JsonNumbers(chart.x) + ",\"xLabel\":" + JsonText(chart.x_label) +
                     ",\"yLabel\":" + JsonText(chart.y_label) +
                     ",\"logY\":" + (chart.log_y ? "true" : "false") +
                     ",\"group\":" + JsonText(chart.group);
  if (chart.y_range) {
    json += Format(",\"yRange\":[%.7g,%.7g]", chart.y_range->first, chart.y_range->second);
  }
  json += ",\"marks\":[";
  for (const auto& [x, text] : chart.marks) {
    json +=
        (json.back() == '[' ? "" : ",") + Format("{\"x\":%.7g,\"text\":", x) + JsonText(text) + "}";
  }
  json += "],\"series\":[";
  for (const ChartSeries& series : chart.series) {
    json += (json.back() == '[' ? "" : ",") + ("{\"name\":" + JsonText(series.name)) +
            ",\"y\":" + JsonNumbers(series.y);
    if (!series.band.empty()) json += ",\"band\":" + JsonNumbers(series.band);
    if (series.points) json += ",\"points\":true";
    if (series.dashed) json += ",\"dashed\":true";
    json += "}";
  }
  return "<figure class=\"chart\" id=\"" + chart.id + "\"><figcaption>" + EscapeHtml(chart.title) +
         "</figcaption><div class=\"legend\"></div><div class=\"plot\" role=\"img\" aria-label=\"" +
         EscapeHtml(chart.title + ": " + chart.y_label + " over " + chart.x_label) +
         "\"></div><script type=\"application/json\">" + json + "]}</script></figure>\n";
}

std::string ChartGrid(const std::vector<std::string>& charts) {
  std::string html = "<div class=\"grid\">\n";
  for (const std::string& chart : charts) html += chart;
  return html + "</div>\n";
}

std::string ImageMapsHtml(const std::string& id, const std::string& caption,
                          const std::vector<ImageMap>& maps, double width_px, double height_px,
                          const std::string& unit) {
  const MapScale scale = ScaleOf(maps);
  std::string html = "<figure class=\"maps\" id=\"" + id + "\"><figcaption>" + EscapeHtml(caption) +
                     "</figcaption><div class=\"side-by-side\">";
  for (const ImageMap& map : maps) {
    html += "<div><p class=\"map-title\">" + EscapeHtml(map.title) + "</p>" +
            MapSvg(map, width_px, height_px, scale, unit) + "</div>";
  }
  html += "</div><p class=\"scale\">" + ColourBar(scale, unit);
  if (scale.arrow > 0.0) {
    html += Format("; longest arrow: %.2g %s; dot: its head", scale.arrow, unit.c_str());
  }
  return html + "</p></figure>\n";
}

std::string MatchesHtml(const std::string& id, const std::string& caption, double width_px,
                        double height_px, const std::vector<unsigned char>& jpeg,
                        const std::vector<DrawnMatch>& matches) {
  std::string html = "<figure class=\"matches\" id=\"" + id + "\"><figcaption>" +
                     EscapeHtml(caption) + "</figcaption>" +
                     Format("<svg viewBox=\"0 0 %g %g\">", width_px, height_px);
  if (!jpeg.empty()) {
    html += Format("<image width=\"%g\" height=\"%g\" preserveAspectRatio=\"none\" ", width_px,
                   height_px) +
            "href=\"data:image/jpeg;base64," + Base64(jpeg) + "\"/>";
  }
  const double size = width_px / 200.0;
  // Outliers last: they lie on top.
  for (const bool inlier : {true, false}) {
    for (const DrawnMatch& match : matches) {
      if (match.inlier != inlier) continue;
      const double x = match.px_b.x(), y = match.px_b.y();
      html += inlier ? "<g class=\"inlier\">" : "<g class=\"outlier\">";
      html += Format("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>", match.px_a.x(),
                     match.px_a.y(), x, y);
      html += inlier ? Format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"/>", x, y, 0.6 * size)
                     : Format("<path d=\"M%.1f %.1fl%.1f %.1fm0 %.1fl%.1f %.1f\"/>", x - size,
                              y - size, 2 * size, 2 * size, -2 * size, -2 * size, 2 * size);
      html += "</g>";
    }
  }
  return html + "</svg></figure>\n";
}

}  // namespace camgyro
