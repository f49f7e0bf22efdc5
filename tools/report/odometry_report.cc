#include "tools/report/odometry_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/format.h"
#include "core/time.h"
#include "tools/report/charts.h"
#include "tools/report/page.h"

namespace camgyro {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Points further away than this many times the path's size would make it a dot.
constexpr double kShownPoints = 1.0;

// Charts and views are some 600 pixels wide; an hour has a hundred thousand poses and landmarks.
constexpr size_t kMostShown = 5000;

// Every n-th.
template <typename T>
std::vector<const T*> Shown(const std::vector<T>& all) {
  const size_t stride = (all.size() + kMostShown - 1) / kMostShown;
  std::vector<const T*> shown;
  for (size_t i = 0; i < all.size(); i += stride) shown.push_back(&all[i]);
  return shown;
}

// A projection of the world: the path with the landmarks around it.
struct PathView {
  std::string title;
  int right = 0, up = 1;  // axes of the world
};

Vector2d OnView(const PathView& view, const Vector3d& p) {
  return {p[view.right], -p[view.up]};  // SVG's y points down
}

// A round length of about a fifth of the picture.
double ScaleBar(double extent_m) {
  const double wanted = std::max(1e-3, extent_m / 5.0);
  const double decade = std::pow(10.0, std::floor(std::log10(wanted)));
  for (const double step : {5.0, 2.0}) {
    if (step * decade <= wanted) return step * decade;
  }
  return decade;
}

std::string Polyline(const PathView& view, const std::vector<OdometryPose>& poses,
                     const std::string& attributes) {
  std::string line = "<polyline" + attributes + " points=\"";
  for (const OdometryPose& pose : poses) {
    const Vector2d p = OnView(view, pose.state.p_world_m);
    line += Format("%.3f,%.3f ", p.x(), p.y());
  }
  return line + "\"/>";
}

// The way with its loops closed, and where they are: each between the two places of its keyframes
// as the odometry has them, which are one.
std::string LoopsSvg(const PathView& view, const OdometryRun& run, const LoopClosure& loops) {
  if (loops.loops.empty()) return "";
  std::string svg = "<g class=\"loops\">";
  for (const FoundLoop& loop : loops.loops) {
    const Vector2d a = OnView(view, run.keyframes[loop.edge.older].state.p_world_m);
    const Vector2d b = OnView(view, run.keyframes[loop.edge.newer].state.p_world_m);
    svg += Format(
        "<line%s x1=\"%.3f\" y1=\"%.3f\" x2=\"%.3f\" y2=\"%.3f\"><title>%s of keyframes %zu and "
        "%zu, %d points</title></line>",
        loop.believed ? "" : " class=\"left-out\"", a.x(), a.y(), b.x(), b.y(),
        loop.believed ? "loop" : "loop that is not believed,", loop.edge.older, loop.edge.newer,
        loop.sightings);
  }
  svg += "</g>";
  return loops.Believed() > 0 ? svg + Polyline(view, loops.keyframes, " class=\"closed\"") : svg;
}

std::string PathSvg(const PathView& view, const OdometryRun& run, const LoopClosure& loops) {
  Vector2d low = OnView(view, run.keyframes.front().state.p_world_m), high = low;
  for (const OdometryPose& pose : run.keyframes) {
    low = low.cwiseMin(OnView(view, pose.state.p_world_m));
    high = high.cwiseMax(OnView(view, pose.state.p_world_m));
  }
  const double extent_m = std::max(0.1, (high - low).maxCoeff());
  low.array() -= 0.15 * extent_m;
  high.array() += 0.15 * extent_m;
  const Vector2d size = high - low;
  const double unit = size.maxCoeff() / 600.0;
  std::string points;
  for (const MappedPoint* point : Shown(run.points)) {
    const Vector2d p = OnView(view, point->p_world_m);
    const Vector2d outside = (p - 0.5 * (low + high)).cwiseAbs() - kShownPoints * 0.5 * size;
    if (outside.maxCoeff() > 0.0) continue;
    points += Format("<circle cx=\"%.3f\" cy=\"%.3f\" r=\"%.3f\"/>", p.x(), p.y(), unit);
  }
  std::string paths, ends;
  for (size_t i = 0; i < run.keyframes.size();) {
    const int segment = run.keyframes[i].segment;
    const Vector2d first = OnView(view, run.keyframes[i].state.p_world_m);
    paths += "<polyline points=\"";
    for (; i < run.keyframes.size() && run.keyframes[i].segment == segment; ++i) {
      const Vector2d p = OnView(view, run.keyframes[i].state.p_world_m);
      paths += Format("%.3f,%.3f ", p.x(), p.y());
    }
    paths += "\"/>";
    ends += Format(
        "<circle cx=\"%.3f\" cy=\"%.3f\" r=\"%.3f\"><title>start of segment %d</title></circle>",
        first.x(), first.y(), 5.0 * unit, segment);
  }
  const double bar_m = ScaleBar(size.x());
  const Vector2d corner(low.x() + 15.0 * unit, high.y() - 15.0 * unit);
  const std::string bar = Format(
      "<line class=\"bar-line\" x1=\"%.3f\" y1=\"%.3f\" x2=\"%.3f\" y2=\"%.3f\"/>"
      "<text x=\"%.3f\" y=\"%.3f\" font-size=\"%.3f\">%g m</text>",
      corner.x(), corner.y(), corner.x() + bar_m, corner.y(), corner.x(), corner.y() - 6.0 * unit,
      14.0 * unit, bar_m);
  return "<figure><figcaption>" + EscapeHtml(view.title) + "</figcaption>" +
         Format("<svg class=\"map path\" viewBox=\"%.3f %.3f %.3f %.3f\">", low.x(), low.y(),
                size.x(), size.y()) +
         "<g class=\"landmarks\">" + points + "</g>" + paths + LoopsSvg(view, run, loops) +
         "<g class=\"start\">" + ends + "</g>" + bar + "</svg></figure>\n";
}

using Component = double (*)(const OdometryPose& pose, int axis);

LineChart Chart(const OdometryRun& run, const std::string& id, const std::string& title,
                const std::string& unit, Component value, Component sigma) {
  LineChart chart;
  chart.id = id;
  chart.title = title;
  chart.x_label = "time [s]";
  chart.y_label = unit;
  chart.group = "time";
  const int64_t begin_ns = run.poses.front().time_ns;
  const std::vector<const OdometryPose*> poses = Shown(run.poses);
  for (const OdometryPose* pose : poses) {
    chart.x.push_back(SecondsSince(begin_ns, pose->time_ns));
  }
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    ChartSeries series;
    series.name = kAxes[static_cast<size_t>(axis)];
    for (const OdometryPose* pose : poses) {
      series.y.push_back(value(*pose, axis));
      if (sigma != nullptr) series.band.push_back(3.0 * sigma(*pose, axis));
    }
    chart.series.push_back(std::move(series));
  }
  for (const OdometryEvent& event : run.events) {
    chart.marks.emplace_back(
        SecondsSince(begin_ns, event.time_ns),
        event.kind == OdometryEvent::Kind::kStarted ? "started" : "lost: " + event.explanation);
  }
  return chart;
}

template <int First>
double SigmaAt(const OdometryPose& pose, int axis) {
  return std::sqrt(std::max(0.0, pose.covariance(First + axis, First + axis)));
}

ReportSection OverTime(const OdometryRun& run) {
  const std::vector<std::string> charts = {
      LineChartHtml(Chart(
          run, "position", "Position, with 3 sigma", "m",
          [](const OdometryPose& p, int axis) { return p.state.p_world_m[axis]; },
          SigmaAt<kNavPosition>)),
      LineChartHtml(Chart(run, "position-sigma", "Its sigma", "m", SigmaAt<kNavPosition>, nullptr)),
      LineChartHtml(Chart(
          run, "velocity", "Velocity, with 3 sigma", "m/s",
          [](const OdometryPose& p, int axis) { return p.state.v_world_m_s[axis]; },
          SigmaAt<kNavVelocity>)),
      LineChartHtml(Chart(
          run, "bias-gyro", "Gyro bias, with 3 sigma", "rad/s",
          [](const OdometryPose& p, int axis) { return p.state.bias_gyro_rad_s[axis]; },
          SigmaAt<kNavBiasGyro>)),
      LineChartHtml(Chart(
          run, "bias-accel", "Accelerometer bias, with 3 sigma", "m/s^2",
          [](const OdometryPose& p, int axis) { return p.state.bias_accel_m_s2[axis]; },
          SigmaAt<kNavBiasAccel>))};
  LineChart tracks = Chart(
      run, "tracks", "Tracks with a landmark", "",
      [](const OdometryPose& p, int) { return static_cast<double>(p.mapped_tracks); }, nullptr);
  tracks.series.resize(1);
  tracks.series.front().name = "tracks";
  return {"over-time", "Over time", ChartGrid(charts) + LineChartHtml(tracks)};
}

ReportSection Calibrated(const OdometryRun& run) {
  const Calibration& c = run.calibration;
  const StateVector sigma = c.sigma();
  ReportTable table;
  table.header = {"Parameter", "value", "sigma", "unit"};
  const auto row = [&](const std::string& name, double value, double s, const std::string& unit) {
    table.rows.push_back({{name, "", 0.0},
                          {Format("%.4g", value), "", 0.0},
                          {Format("%.2g", s), "", 0.0},
                          {unit, "", 0.0}});
  };
  row("focal length", c.lens[kFocal], sigma[kStateFocal], "px");
  row("readout time", 1e3 * c.readout_s, 1e3 * sigma[kStateReadout], "ms");
  row("delay", 1e3 * c.delay_s, 1e3 * sigma[kStateDelay], "ms");
  for (int axis = 0; axis < 3; ++axis) {
    row(std::string("camera in the gyro frame, ") + "xyz"[axis], run.p_gyro_cam_m[axis],
        run.p_gyro_cam_sigma_m[axis], "m");
  }
  return {"calibration", "Calibration as refined on the way", TableHtml(table)};
}

}  // namespace

std::string OdometryReportHtml(const OdometryRun& run, const LoopClosure& loops,
                               const RunInfo& info) {
  std::vector<std::string> events;
  const int64_t begin_ns = run.poses.front().time_ns;
  for (const OdometryEvent& event : run.events) {
    events.push_back(Format("%.2f s: ", SecondsSince(begin_ns, event.time_ns)) +
                     (event.kind == OdometryEvent::Kind::kStarted ? "started, " : "lost, ") +
                     event.explanation);
  }
  events.push_back("loops: " + LoopsInWords(loops) +
                   (loops.Believed() > 0 ? " (green: the way with them)" : ""));
  const std::string lead = Format("%.2f m in %.1f s, %zu keyframes, %zu landmarks", run.path_m,
                                  SecondsSince(begin_ns, run.poses.back().time_ns),
                                  run.keyframes.size(), run.points.size());
  std::vector<ReportSection> sections;
  sections.push_back({"path", "Path",
                      "<div class=\"side-by-side\"><div>" +
                          PathSvg({"From above: x to the right, y up", 0, 1}, run, loops) +
                          "</div><div>" +
                          PathSvg({"From the side: x to the right, z up", 0, 2}, run, loops) +
                          "</div></div>\n" + BulletList(events)});
  sections.push_back(OverTime(run));
  sections.push_back(Calibrated(run));
  sections.push_back(ReproductionSection(info));
  return ReportPage("camgyro odometry", lead, sections);
}

}  // namespace camgyro
