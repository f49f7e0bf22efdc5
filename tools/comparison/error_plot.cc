#include "tools/comparison/error_plot.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/format.h"

namespace camgyro::comparison {
namespace {

constexpr int kColumns = 4, kRows = 3;
constexpr double kPanelWidth = 290, kPanelHeight = 190;             // with its labels
constexpr double kLeft = 52, kTop = 30, kRight = 14, kBottom = 30;  // of a panel, around its axes
constexpr double kTitleHeight = 34;
constexpr size_t kMaxPoints = 250;  // of a line

const char* ColorOf(const std::string& estimator) {
  if (estimator == "ekf") return "#c2410c";
  if (estimator == "window") return "#1d4ed8";
  return "#15803d";
}

std::string TextAt(double x, double y, const char* style, const std::string& text) {
  return Format("<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, style) + text + "</text>\n";
}

// "c_x" with its index lowered.
std::string Label(const std::string& name) {
  const size_t underscore = name.find('_');
  if (underscore == std::string::npos) return "<tspan font-style=\"italic\">" + name + "</tspan>";
  return "<tspan font-style=\"italic\">" + name.substr(0, underscore) +
         "</tspan><tspan font-size=\"9\" dy=\"3\">" + name.substr(underscore + 1) +
         "</tspan><tspan dy=\"-3\"> </tspan>";
}

struct Line {
  std::vector<std::pair<double, double>> points;  // frame, value as shown
};

// Thins out long lines, and keeps their ends.
std::vector<size_t> Selection(size_t count) {
  std::vector<size_t> indices;
  const size_t step = std::max<size_t>(1, (count + kMaxPoints - 1) / kMaxPoints);
  for (size_t i = 0; i < count; i += step) indices.push_back(i);
  if (count > 0 && indices.back() + 1 != count) indices.push_back(count - 1);
  return indices;
}

class Panel {
 public:
  // linear: half height of the linear part; largest: the largest value to show.
  Panel(double x, double y, double last_frame, double linear, double largest)
      : left_(x + kLeft),
        top_(y + kTop),
        width_(kPanelWidth - kLeft - kRight),
        height_(kPanelHeight - kTop - kBottom),
        last_frame_(std::max(1.0, last_frame)),
        linear_(linear),
        largest_(largest) {}

  double X(double frame) const { return left_ + width_ * std::min(1.0, frame / last_frame_); }
  double Y(double value) const {
    const double share = std::asinh(value / linear_) / std::asinh(largest_ / linear_);
    return top_ + 0.5 * height_ * (1.0 - std::clamp(share, -1.0, 1.0));
  }

  std::string Axes(const StateParameter& unit, bool with_frames) const {
    std::string svg = Format(
        "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"none\" "
        "stroke=\"#9ca3af\"/>\n",
        left_, top_, width_, height_);
    svg += TextAt(left_, top_ - 8, "font-size=\"12\"",
                  Label(unit.symbol) + " [" + unit.error_unit + "]");
    double labelled_y = 1e9;  // of the last label above zero; those below mirror it
    std::vector<double> ticks = {0.0};
    for (double power = std::pow(10.0, std::floor(std::log10(0.3 * linear_))); power < largest_;
         power *= 10.0) {
      for (const double tick : {power, 3.0 * power}) {
        if (tick > 0.3 * linear_ && tick < 0.95 * largest_) ticks.push_back(tick);
      }
    }
    for (const double tick : ticks) {
      const bool labelled = labelled_y - Y(tick) >= 11.0;
      if (labelled) labelled_y = Y(tick);
      for (const double value : {tick, -tick}) {
        svg += Format(
            "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" "
            "stroke-width=\"%s\"/>\n",
            left_, left_ + width_, Y(value), Y(value), tick == 0.0 ? "#6b7280" : "#e5e7eb",
            tick == 0.0 ? "0.8" : "0.6");
        if (labelled) {
          svg += TextAt(left_ - 5, Y(value) + 3.5, "font-size=\"10\" text-anchor=\"end\"",
                        Format("%s%g", value < 0.0 ? "−" : "", std::abs(value)));
        }
        if (tick == 0.0) break;
      }
    }
    const double step = NiceStep(last_frame_ / 4.0);
    for (double frame = 0.0; frame <= last_frame_; frame += step) {
      svg += Format("<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#9ca3af\"/>\n",
                    X(frame), X(frame), top_ + height_, top_ + height_ + 3);
      svg += TextAt(X(frame), top_ + height_ + 13, "font-size=\"10\" text-anchor=\"middle\"",
                    Format("%g", frame));
    }
    if (with_frames) {
      svg += TextAt(left_ + 0.5 * width_, top_ + height_ + 26,
                    "font-size=\"10\" text-anchor=\"middle\"", "frame");
    }
    return svg;
  }

  std::string Path(const Line& line, const char* color, const char* more) const {
    std::string points;
    for (const auto& [frame, value] : line.points) {
      points += Format("%.1f,%.1f ", X(frame), Y(value));
    }
    return Format("<polyline fill=\"none\" stroke=\"%s\" %s points=\"", color, more) + points +
           "\"/>\n";
  }

  std::string Band(const Line& half, const char* color) const {
    std::string points;
    for (const auto& [frame, value] : half.points) {
      points += Format("%.1f,%.1f ", X(frame), Y(value));
    }
    for (auto it = half.points.rbegin(); it != half.points.rend(); ++it) {
      points += Format("%.1f,%.1f ", X(it->first), Y(-it->second));
    }
    return Format("<polygon fill=\"%s\" fill-opacity=\"0.10\" stroke=\"none\" points=\"", color) +
           points + "\"/>\n";
  }

  std::string Mark(double value, double half, const char* color) const {
    const double x = left_ + width_ - 4.0;
    return Format(
        "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" "
        "stroke-width=\"1.6\"/><circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.6\" fill=\"%s\"/>\n",
        x, x, Y(value - half), Y(value + half), color, x, Y(value), color);
  }

 private:
  static double NiceStep(double step) {
    const double power = std::pow(10.0, std::floor(std::log10(step)));
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor * power >= step) return factor * power;
    }
    return 10.0 * power;
  }

  double left_, top_, width_, height_, last_frame_, linear_, largest_;
};

std::string Legend(double x, double y, const SeedRun& run) {
  std::string svg;
  const auto row = [&](const std::string& symbol, const std::string& text) {
    svg += symbol + TextAt(x + kLeft + 40, y + 4, "font-size=\"12\"", text);
    y += 20;
  };
  const auto line = [&](const char* color, const char* more) {
    return Format("<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" %s/>\n",
                  x + kLeft, x + kLeft + 30, y, y, color, more);
  };
  for (const EstimatorRun& e : run.estimators) {
    if (!e.failure.empty()) continue;
    const char* color = ColorOf(e.estimator);
    if (e.trace.empty()) {
      row(Format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.6\" fill=\"%s\"/>\n", x + kLeft + 15, y,
                 color),
          e.estimator + ": result, ±3 sigma");
    } else {
      row(line(color, "stroke-width=\"1.6\""), e.estimator + ": error");
      row(line(color, "stroke-width=\"0.8\" stroke-opacity=\"0.7\""), e.estimator + ": ±3 sigma");
    }
  }
  if (!run.bound.empty()) {
    row(line("#111827", "stroke-width=\"1\" stroke-dasharray=\"4 3\""), "bound: ±3 sigma");
  }
  y += 4;
  svg += TextAt(x + kLeft, y, "font-size=\"10\" fill=\"#4b5563\"",
                "vertical: linear near 0, logarithmic beyond");
  return svg;
}

std::string DrawPanel(double x, double y, int parameter, double last_frame, const SeedRun& run) {
  const StateParameter& unit = StateTable()[static_cast<size_t>(parameter)];
  // The linear part holds the best final +-3 sigma.
  double linear = 1e300, largest = 0.0;
  for (const EstimatorRun& e : run.estimators) {
    if (!e.failure.empty()) continue;
    linear =
        std::min(linear, 3.0 * unit.error_scale * std::sqrt(e.covariance(parameter, parameter)));
    for (const TracePoint& point : e.trace) {
      largest = std::max({largest, unit.error_scale * std::abs(point.error[parameter]),
                          3.0 * unit.error_scale * point.sigma[parameter]});
    }
    largest = std::max(largest, unit.error_scale * std::abs(e.error[parameter]));
  }
  largest = 1.1 * std::max(largest, linear);
  const Panel panel(x, y, last_frame, linear, largest);
  std::string svg = panel.Axes(unit, y > kTitleHeight + 1.5 * kPanelHeight);
  std::string errors;
  for (const EstimatorRun& e : run.estimators) {
    if (!e.failure.empty()) continue;
    const char* color = ColorOf(e.estimator);
    if (e.trace.empty()) {
      errors +=
          panel.Mark(unit.error_scale * e.error[parameter],
                     3.0 * unit.error_scale * std::sqrt(e.covariance(parameter, parameter)), color);
      continue;
    }
    Line error, above, below;
    for (const size_t i : Selection(e.trace.size())) {
      const TracePoint& point = e.trace[i];
      error.points.emplace_back(point.frame, unit.error_scale * point.error[parameter]);
      above.points.emplace_back(point.frame, 3.0 * unit.error_scale * point.sigma[parameter]);
      below.points.emplace_back(point.frame, -3.0 * unit.error_scale * point.sigma[parameter]);
    }
    svg += panel.Band(above, color);
    const char* thin = "stroke-width=\"0.8\" stroke-opacity=\"0.7\"";
    svg += panel.Path(above, color, thin) + panel.Path(below, color, thin);
    errors += panel.Path(error, color, "stroke-width=\"1.6\"");
  }
  if (!run.bound.empty()) {
    Line above, below;
    for (const size_t i : Selection(run.bound.size())) {
      const double half = 3.0 * unit.error_scale * std::sqrt(run.bound[i](parameter, parameter));
      above.points.emplace_back(i + 1, half);
      below.points.emplace_back(i + 1, -half);
    }
    const char* dashed = "stroke-width=\"1\" stroke-dasharray=\"4 3\"";
    svg += panel.Path(above, "#111827", dashed) + panel.Path(below, "#111827", dashed);
  }
  return svg + errors;
}

}  // namespace

std::string ErrorPlotSvg(const std::string& title, const SeedRun& run) {
  const double width = kColumns * kPanelWidth, height = kTitleHeight + kRows * kPanelHeight;
  std::string svg = Format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" "
      "height=\"%.0f\" font-family=\"Helvetica, Arial, sans-serif\" fill=\"#111827\">\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
      width, height, width, height);
  svg += TextAt(kLeft, 22, "font-size=\"15\" font-weight=\"bold\"", title);
  double last_frame = static_cast<double>(run.bound.size());
  for (const EstimatorRun& e : run.estimators) {
    if (!e.trace.empty()) last_frame = std::max<double>(last_frame, e.trace.back().frame);
  }
  // Lens and clock in the first row and a bit, then bias, then mounting, then the legend.
  for (int i = 0; i < kStateSize; ++i) {
    const int row = i / kColumns, column = i % kColumns;
    svg += DrawPanel(kPanelWidth * column, kTitleHeight + kPanelHeight * row, i, last_frame, run);
  }
  const int row = kStateSize / kColumns, column = kStateSize % kColumns;
  svg += Legend(kPanelWidth * column, kTitleHeight + kPanelHeight * row + kTop + 8, run);
  return svg + "</svg>\n";
}

}  // namespace camgyro::comparison
