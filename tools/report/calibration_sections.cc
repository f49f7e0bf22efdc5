#include "tools/report/calibration_sections.h"

extern "C" {
#include <libavutil/avutil.h>
}

#include <ceres/version.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core/version.hpp>

#include "core/format.h"
#include "core/time.h"
#include "estimator/start/axis_permutation.h"
#include "tools/report/build_info.h"
#include "tools/report/charts.h"
#include "tools/report/parameter_rows.h"

namespace camgyro {
namespace {

// Where a parameter is in calibration.yaml, in the order of StateIndex.
struct YamlPlace {
  const char* path;
  const char* sigma;
  int element;  // -1: not a list
};
constexpr std::array<YamlPlace, kStateSize> kYamlPlaces = {
    {{"camera.focal_px", "sigma", -1},
     {"camera.principal_px", "sigma", 0},
     {"camera.principal_px", "sigma", 1},
     {"shutter.readout_s", "sigma", -1},
     {"clock.delay_s", "sigma", -1},
     {"gyro.bias_rad_s", "sigma", 0},
     {"gyro.bias_rad_s", "sigma", 1},
     {"gyro.bias_rad_s", "sigma", 2},
     {"extrinsics.q_gyro_cam_wxyz", "sigma_rad", 0},
     {"extrinsics.q_gyro_cam_wxyz", "sigma_rad", 1},
     {"extrinsics.q_gyro_cam_wxyz", "sigma_rad", 2}}};

std::string YamlKey(const YamlPlace& place, const std::string& what) {
  return std::string(place.path) + "." + what +
         (place.element < 0 ? "" : "." + std::to_string(place.element));
}

std::string Verdict(const CalibrationReport& report, const std::vector<ParameterRow>& rows) {
  std::string open;
  for (const ParameterRow& row : rows) {
    if (!row.determined) open += (open.empty() ? "" : ", ") + row.name;
  }
  const std::string doubts =
      report.doubts.empty() ? "" : " There are reasons for doubt: read them below.";
  if (!open.empty()) {
    return "Not everything was determined by this recording. The numbers of these are not "
           "measurements: " +
           open + "." + doubts;
  }
  if (!report.doubts.empty()) {
    return "Every parameter was determined, but take the result with care." + doubts;
  }
  return "A sound calibration: the recording determined every parameter, and no check speaks "
         "against it.";
}

const char* Advice(int index) {
  switch (index) {
    case kStateFocal:
      return "Focal length: turn left and right and up and down by 20 to 30 degrees, back and "
             "forth, with the lens at the same zoom and focus.";
    case kStateCx:
    case kStateCy:
      return "Principal point: roll the camera about its viewing axis, and turn about the other "
             "two axes in between; keep features in all corners of the picture.";
    case kStateReadout:
      return "Readout time: faster turns left and right and up and down (above 1 rad/s), with "
             "features from the top row to the bottom row.";
    case kStateDelay:
      return "Delay: sudden starts and stops; a steady turn looks the same a moment later.";
    case kStateRotation:
      return "Mounting about x: pan left and right, and roll: turns about the x axis itself do not "
             "show it.";
    case kStateRotation + 1:
      return "Mounting about y: tilt up and down, and roll: turns about the y axis itself do not "
             "show it.";
    case kStateRotation + 2:
      return "Mounting about z: pan left and right and tilt up and down: rolling does not show it.";
    default:
      return "Gyro bias: a longer recording, with sharp features in view all the time.";
  }
}

// Rms of the rates about the camera's axes while frames were taken [rad/s].
Eigen::Vector3d RateRms(const Recording& recording, const Calibration& calibration) {
  const int64_t origin = recording.gyro.front().stamp_ns;
  const double first =
      SecondsSince(origin, recording.frames.front().stamp_ns) + calibration.delay_s;
  const double last = SecondsSince(origin, recording.frames.back().stamp_ns) + calibration.delay_s;
  Eigen::Vector3d sum_sq = Eigen::Vector3d::Zero();
  int count = 0;
  for (const GyroSample& sample : recording.gyro) {
    const double time = SecondsSince(origin, sample.stamp_ns);
    if (time < first || time > last) continue;
    const Eigen::Vector3d rate = calibration.q_gyro_cam.conjugate() *
                                 (sample.omega_gyro_rad_s - calibration.bias_gyro_rad_s);
    sum_sq += rate.cwiseAbs2();
    ++count;
  }
  return (sum_sq / std::max(1, count)).cwiseSqrt();
}

std::string TimesText(double ratio) {
  return ratio < 10.0 ? Format("%.1f", ratio) : Format("%.0f", ratio);
}

// Parameters of the effects in the model; empty without effects.
std::string EffectsTable(const Calibration& c) {
  if (!c.effects || c.effects->items().empty()) return "";
  ReportTable table;
  table.header = {"effect", "parameter", "value", "± sigma", "unit"};
  for (size_t i = 0; i < c.effects->items().size(); ++i) {
    const EffectSet::Item& item = c.effects->items()[i];
    if (item.effect->size() == 0) table.rows.push_back({{NameWithShape(item), "", 0.0}});
    for (int k = 0; k < item.effect->size(); ++k) {
      const EffectParameter& p = item.effect->parameters()[static_cast<size_t>(k)];
      const ReadableUnit unit = ReadableUnitOf(p.unit);
      const double value = c.effect_values[item.first + k];
      const double sigma = std::sqrt(c.effect_covariance(item.first + k, item.first + k));
      const std::string key = Format("effects.%zu.parameters.%d.", i, k);
      table.rows.push_back({{k == 0 ? NameWithShape(item) : "", "", 0.0},
                            {p.name, "", 0.0},
                            {Format("%.4g", unit.scale * value), key + "value", value},
                            {Format("%.2g", unit.scale * sigma), key + "sigma", sigma},
                            {unit.name, "", 0.0}});
    }
  }
  return "<h3>Effects in the model</h3>\n" + TableHtml(table);
}

}  // namespace

ReportSection SummarySection(const Recording& recording, const CalibrationReport& report,
                             bool attitudes) {
  const Calibration& c = report.calibration;
  const Eigen::Matrix3d permutation = MountingPermutation(c);
  const std::vector<ParameterRow> rows = ParameterRows(c, permutation, attitudes);
  const bool sound =
      report.doubts.empty() &&
      std::all_of(rows.begin(), rows.end(), [](const auto& r) { return r.determined; });
  ReportTable table;
  table.header = {"parameter", "value", "± noise", "± in all", "unit", ""};
  for (const ParameterRow& row : rows) {
    const int decimals = DecimalsFor(row.sigma);
    const YamlPlace& place = kYamlPlaces[static_cast<size_t>(row.index)];
    const bool mounting = row.index >= kStateRotation;  // its value in the file is a quaternion
    table.rows.push_back(
        {{row.name, "", 0.0},
         {Format("%.*f", decimals, row.value), mounting ? "" : YamlKey(place, "value"),
          row.value / row.unit_scale},
         {Format("%.*f", decimals, row.sigma), YamlKey(place, place.sigma),
          row.sigma / row.unit_scale},
         {row.sigma_total ? Format("%.*f", decimals, *row.sigma_total) : "", "", 0.0},
         {row.unit, "", 0.0},
         {row.determined ? "" : "not determined by this recording", "", 0.0}});
  }
  std::string html = Paragraph(Verdict(report, rows), sound ? "verdict" : "verdict warn");
  html += TableHtml(table);
  html += Paragraph(
      "t_gyro = t_camera + delay + readout · row / height. The mounting is what is left, about the "
      "camera's axes (x right, y down, z forward), after " +
          DescribePermutation(permutation) +
          ". Both are one standard deviation: of noise alone, and with what effects may add that "
          "nobody "
          "has declared, at the sizes that devices usually show.",
      "note");
  html += EffectsTable(c);
  if (!report.doubts.empty()) html += "<h3>Doubts</h3>\n" + BulletList(report.doubts);
  if (!report.notes.empty()) html += "<h3>Notes</h3>\n" + BulletList(report.notes);
  if (!recording.notes.empty()) {
    html += "<h3>Found in the data</h3>\n" + BulletList(recording.notes);
  }
  return {"summary", "Result", html};
}

ReportSection MotionSection(const Recording& recording, const CalibrationReport& report,
                            bool attitudes) {
  const Calibration& c = report.calibration;
  const std::vector<ParameterRow> rows = ParameterRows(c, MountingPermutation(c), attitudes);
  ReportTable table;
  table.header = {"parameter", "known before, ±", "now, ±", "unit", "times better", "determined"};
  std::vector<std::string> advice;
  for (const ParameterRow& row : rows) {
    const double before = row.unit_scale * report.prior.sigma[row.index];
    table.rows.push_back({{row.name, "", 0.0},
                          {Format("%.3g", before), "", 0.0},
                          {Format("%.2g", row.sigma), "", 0.0},
                          {row.unit, "", 0.0},
                          {TimesText(before / row.sigma), "", 0.0},
                          {row.determined ? "yes" : "no", "", 0.0}});
    const std::string text = Advice(row.index);
    if (!row.determined && (advice.empty() || advice.back() != text)) advice.push_back(text);
  }
  const Eigen::Vector3d rms = 57.29577951308232 * RateRms(recording, c);
  std::string html = Paragraph(Format(
      "The camera turned with %.0f deg/s about x (tilting up and down), %.0f about y (panning left "
      "and right), %.0f about z (rolling); root mean squares.",
      rms.x(), rms.y(), rms.z()));
  html += TableHtml(table);
  if (advice.empty()) {
    html += Paragraph("Every parameter was determined: no other motion is needed.");
  } else {
    html += "<h3>Motion to add</h3>\n" + BulletList(advice);
  }
  return {"motion", "What the motion determined", html};
}

ReportSection ConvergenceSection(const CalibrationReport& report) {
  ReportSection section{"convergence", "Convergence", ""};
  if (report.trace.size() < 2) {
    section.html = Paragraph("This run had no online pass whose estimates could be shown.");
    return section;
  }
  // One permutation for all, so that the mounting's angles are continuous.
  const Eigen::Matrix3d permutation = MountingPermutation(report.calibration);
  std::vector<double> times;
  std::vector<std::vector<ParameterRow>> rows;  // by update
  for (const WindowUpdate& update : report.trace) {
    times.push_back(SecondsSince(report.trace.front().frame_stamp_ns, update.frame_stamp_ns));
    rows.push_back(ParameterRows(update.estimate, permutation, /*attitudes=*/false));
  }
  const auto last = ParameterRows(report.calibration, permutation, /*attitudes=*/false);
  std::vector<std::string> charts;
  for (size_t p = 0; p < last.size(); ++p) {
    LineChart chart;
    chart.id = "convergence-" + StateNames()[p];
    chart.title = last[p].name;
    chart.x_label = "time [s]";
    chart.y_label = last[p].unit;
    chart.x = times;
    chart.group = "convergence";
    ChartSeries online{"online ± 3σ", {}, {}, false, false};
    double low = last[p].value - 3.0 * last[p].sigma, high = last[p].value + 3.0 * last[p].sigma;
    for (size_t i = 0; i < rows.size(); ++i) {
      const ParameterRow& row = rows[i][p];
      online.y.push_back(row.value);
      online.band.push_back(3.0 * row.sigma);
      // The first estimates know nothing; they may leave the chart.
      if (i >= rows.size() / 3) {
        low = std::min(low, row.value - 3.0 * row.sigma);
        high = std::max(high, row.value + 3.0 * row.sigma);
      }
    }
    chart.y_range = {{low - 0.4 * (high - low), high + 0.4 * (high - low)}};
    const ChartSeries result{
        "result", std::vector<double>(times.size(), last[p].value), {}, false, true};
    chart.series = {online, result};
    charts.push_back(LineChartHtml(chart));
  }
  section.html =
      Paragraph(
          "The online estimate after each frame with three standard deviations, and the "
          "result of the refinement over all frames. Drag to zoom, double click to see all.",
          "note") +
      ChartGrid(charts);
  return section;
}

ReportSection DelaySection(const StartResult& start) {
  LineChart chart;
  chart.id = "delay-curve";
  chart.title = "Gyro motion that the camera does not explain, by delay";
  chart.x_label = "delay of the middle row [s]";
  chart.y_label = "unexplained [%]";
  ChartSeries series{"unexplained", {}, {}, false, false};
  for (const DelayResidual& point : start.curve) {
    chart.x.push_back(point.delay_s);
    series.y.push_back(100.0 * point.residual);
  }
  chart.series = {series};
  chart.y_range = {{0.0, 130.0}};  // with room for the marks' names
  chart.marks = {
      {start.delay_middle_row_s, Format("minimum %.1f ms", 1e3 * start.delay_middle_row_s)}};
  const double factor = 1.0 / std::max(1e-3, start.runner_up_ratio);
  if (start.runner_up_ratio < 1.0) {
    chart.marks.push_back(
        {start.runner_up_delay_s, Format("runner-up %.0f ms", 1e3 * start.runner_up_delay_s)});
  }
  return {
      "delay", "Delay search",
      Paragraph(Format(
          "At the minimum, %.2f ± %.2f ms, the camera's rotations explain %.0f %% of the gyro's "
          "motion. The next best delay leaves %s times as much unexplained: near 1 the choice "
          "would be a guess.",
          1e3 * start.delay_middle_row_s, 1e3 * start.delay_sigma_s, 100.0 * start.explained,
          TimesText(factor).c_str())) +
          LineChartHtml(chart)};
}

ReportSection FitSection(const CalibrationReport& report, bool attitudes) {
  const FitQuality& q = report.quality;
  const double scale = attitudes ? 1e3 : 1.0;
  const char* unit = attitudes ? "mrad" : "px";
  const std::string noise_key = attitudes ? "quality.noise_rad" : "quality.noise_px";
  const std::string rms_key = attitudes ? "quality.rms_rad" : "quality.rms_px";
  const auto chi2 = [&](double rms) {
    const double ratio = rms / q.noise_px;
    return TableCell{q.noise_px > 0.0 ? Format("%.2f", ratio * ratio) : "", "", 0.0};
  };
  ReportTable table;
  table.header = {"", "pairs", "matches", Format("rms [%s]", unit), "chi2 per residual"};
  if (q.matches > 0 || q.rms_px > 0.0) {
    table.rows.push_back({{"frames of the fit", "", 0.0},
                          {Format("%d", q.pairs), "quality.pairs", double(q.pairs)},
                          {Format("%d", q.matches), "quality.matches", double(q.matches)},
                          {Format("%.4f", scale * q.rms_px), rms_key, q.rms_px},
                          chi2(q.rms_px)});
  }
  if (report.unseen) {
    table.rows.push_back(
        {{"frames not seen by the fit", "", 0.0},
         {Format("%d", report.unseen->pairs), "", 0.0},
         {Format("%d", report.unseen->matches), "", 0.0},
         {Format("%.4f", report.unseen->rms_px), "quality.unseen_rms_px", report.unseen->rms_px},
         chi2(report.unseen->rms_px)});
  }
  ReportTable noise;
  noise.header = {"", ""};
  noise.rows.push_back({{"noise of one coordinate", "", 0.0},
                        {Format("%.4f %s", scale * q.noise_px, unit), noise_key, q.noise_px}});
  if (q.inlier_ratio > 0.0) {
    noise.rows.push_back(
        {{"inliers", "", 0.0},
         {Format("%.1f %%", 100.0 * q.inlier_ratio), "quality.inlier_ratio", q.inlier_ratio}});
  }
  if (report.halves_chi2 > 0.0) {
    noise.rows.push_back(
        {{"disagreement of the two halves, chi2 per parameter (1 expected)", "", 0.0},
         {Format("%.2f", report.halves_chi2), "quality.halves_chi2", report.halves_chi2}});
  }
  if (report.noise_over_smooth > 0.0) {
    noise.rows.push_back(
        {{"what is left, over what is left without what is smooth over the picture (1 expected)",
          "", 0.0},
         {Format("%.2f", report.noise_over_smooth), "quality.noise_over_smooth",
          report.noise_over_smooth}});
  }
  std::string html = (table.rows.empty() ? "" : TableHtml(table)) + TableHtml(noise);
  html += Paragraph(
      report.unseen
          ? "Not seen: each half of the recording under the fit of the other half. A model that "
            "describes more than its own frames has nearly the same rms there. Chi2 counts squared "
            "residuals in units of the noise, each bounded by the robust loss; about 1 is right."
          : "The recording is too short, or has no pixels, to set frames aside for a test.",
      "note");
  return {"fit", "Fit, and frames it has not seen", html};
}

ReportSection ReproductionSection(const RunInfo& run) {
  std::string text =
      run.command_line + "\n\nrecording   " + run.recording + "\ncamgyro     " + kVersion +
      ", commit " + kGitCommit + "\nbuilt for   " + kPlatform + ", compiler " + __VERSION__ +
      "\nlibraries   Ceres " + CERES_VERSION_STRING + ", OpenCV " + CV_VERSION + ", FFmpeg " +
      av_version_info() + ", " +
      Format("Eigen %d.%d.%d", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION) +
      "\noptions    ";
  for (const auto& [name, value] : run.options) text += " --" + name + "=" + value;
  return {"reproduction", "To reproduce this",
          "<pre>" + EscapeHtml(text) + "</pre>\n" + "<details><summary>" +
              EscapeHtml(run.result_name) + "</summary><pre>" + EscapeHtml(run.result_yaml) +
              "</pre></details>\n"};
}

}  // namespace camgyro
