#include "tools/batch/tables.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "core/format.h"
#include "tools/report/charts.h"
#include "tools/report/page.h"
#include "tools/report/parameter_rows.h"

namespace camgyro::batch {
namespace {

constexpr int kDigits = 10;  // as in calibration.yaml

// A cell of a csv file (RFC 4180).
std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string Number(double value) { return Format("%.*g", kDigits, value); }

// The recordings of a device that are part of it, in the order of DeviceReport::each.
std::vector<const BatchResult*> Members(const BatchDevice& device) {
  std::vector<const BatchResult*> members;
  for (const BatchResult& result : device.results) {
    if (result.left_out.empty()) members.push_back(&result);
  }
  return members;
}

// What is odd about a member, by its number among them; null: nothing.
const OddRecording* FindOdd(const BatchDevice& device, size_t member) {
  if (!device.combined) return nullptr;
  const std::vector<OddRecording>& odd = device.combined->combined.odd;
  const auto found = std::find_if(odd.begin(), odd.end(),
                                  [&](const OddRecording& o) { return o.recording == member; });
  return found == odd.end() ? nullptr : &*found;
}

std::string ParameterOf(const BatchDevice& device, const OddRecording& odd) {
  return device.combined->parameters[static_cast<size_t>(odd.parameter)];
}

ReportSection RecordingsSection(const BatchDevice& device) {
  ReportTable table;
  table.header = {"Recording", "Exit code", "Time [s]", "Part of the device", "Message"};
  size_t member = 0;
  for (const BatchResult& result : device.results) {
    std::string part = result.left_out.empty() ? "yes" : "no: " + result.left_out;
    if (result.left_out.empty()) {
      const OddRecording* odd = FindOdd(device, member++);
      if (odd != nullptr) {
        part = Format("yes, but the others contradict it: %s is %.1f sigmas off",
                      ParameterOf(device, *odd).c_str(), std::abs(odd->sigmas));
      }
    }
    table.rows.push_back({{result.recording.folder, "", 0.0},
                          {std::to_string(result.outcome.exit_code), "", 0.0},
                          {Format("%.1f", result.outcome.seconds), "", 0.0},
                          {part, "", 0.0},
                          {result.outcome.message, "", 0.0}});
  }
  return {"recordings", "Recordings", TableHtml(table)};
}

ReportSection ParametersSection(const BatchDevice& device) {
  const Calibration& c = device.combined->report.calibration;
  ReportTable table;
  table.header = {"Parameter", "Value",   "± noise",    "± in all",
                  "Unit",      "Between", "Recordings", "Chance"};
  for (const ParameterRow& row :
       ParameterRows(c, MountingPermutation(c), device.combined->attitudes)) {
    const Repeatability& repeats =
        device.combined->combined.repeatability[static_cast<size_t>(row.index)];
    const int decimals = DecimalsFor(row.sigma);
    const auto shown = [&](double value) { return Format("%.*f", decimals, value); };
    const bool several = repeats.recordings > 1;
    table.rows.push_back(
        {{row.name, "", 0.0},
         {row.determined ? shown(row.value) : "not determined", "", 0.0},
         {row.determined ? shown(row.sigma) : "", "", 0.0},
         {row.determined && row.sigma_total ? shown(*row.sigma_total) : "", "", 0.0},
         {row.unit, "", 0.0},
         {several ? shown(row.unit_scale * repeats.between) : "", "", 0.0},
         {std::to_string(repeats.recordings), "", 0.0},
         {several ? Format("%.1g", repeats.p_value) : "", "", 0.0}});
  }
  return {"parameters", "The device",
          Paragraph("Between: standard deviation between recordings beyond their noise. Chance: "
                    "that noise alone makes such differences. Delay and bias are those of the "
                    "next recording.") +
              TableHtml(table)};
}

// Each parameter in every recording, with its sigma of noise.
ReportSection ChartsSection(const BatchDevice& device) {
  const DeviceReport& combined = *device.combined;
  const Calibration& c = combined.report.calibration;
  const Eigen::Matrix3d permutation = MountingPermutation(c);
  const Eigen::Quaterniond q_permutation(permutation);
  std::vector<std::string> charts;
  for (const ParameterRow& row : ParameterRows(c, permutation, combined.attitudes)) {
    LineChart chart;
    chart.id = "chart-" + std::to_string(row.index);
    chart.title = row.name;
    chart.x_label = "recording";
    chart.y_label = row.unit;
    ChartSeries values;
    values.name = row.name;
    values.points = true;
    for (size_t i = 0; i < combined.each.size(); ++i) {
      const Calibration& each = combined.each[i];
      const auto index = static_cast<size_t>(row.index);
      const double value = row.unit_scale * ValuesOf(each, q_permutation)[row.index];
      chart.x.push_back(static_cast<double>(i + 1));
      values.y.push_back(each.determined[index] ? value : std::nan(""));
      values.band.push_back(row.unit_scale * each.sigma()[row.index]);
    }
    chart.series = {values};
    charts.push_back(LineChartHtml(chart));
  }
  std::string names;
  for (size_t i = 0; i < combined.recordings.size(); ++i) {
    names += (i > 0 ? ", " : "") + std::to_string(i + 1) + " " + combined.recordings[i];
  }
  return {"repeatability", "Every parameter in every recording",
          Paragraph("With its sigma of noise. Recordings: " + names + ".") + ChartGrid(charts)};
}

}  // namespace

std::string RecordingsCsv(const std::vector<BatchDevice>& devices) {
  std::ostringstream out;
  out << "device,recording,folder,exit_code,combined,odd";
  for (const std::string& name : StateNames()) {
    out << "," << name << ",sigma_" << name << ",sigma_total_" << name;
  }
  out << ",message\n";
  for (const BatchDevice& device : devices) {
    size_t member = 0;
    for (const BatchResult& result : device.results) {
      const bool is_member = result.left_out.empty();
      const OddRecording* odd = is_member ? FindOdd(device, member++) : nullptr;
      out << Quoted(device.name) << "," << Quoted(result.recording.path) << ","
          << Quoted(result.recording.folder) << "," << result.outcome.exit_code << ","
          << (is_member ? "true" : "false") << ","
          << (odd != nullptr ? ParameterOf(device, *odd) : "");
      for (int i = 0; i < kStateSize; ++i) {
        if (!is_member || !result.report->calibration.determined[static_cast<size_t>(i)]) {
          out << ",,,";
          continue;
        }
        const Calibration& c = result.report->calibration;
        const auto total = c.sigma_total();
        out << "," << Number(ValuesOf(c, device.combined->report.calibration.q_gyro_cam)[i]) << ","
            << Number(c.sigma()[i]) << "," << (total ? Number((*total)[i]) : "");
      }
      out << ","
          << Quoted(result.outcome.message.empty() ? result.left_out : result.outcome.message)
          << "\n";
    }
  }
  return out.str();
}

std::string DeviceCsv(const BatchDevice& device) {
  std::ostringstream out;
  out << "parameter,value,sigma,sigma_total,shared,recordings,between,chi2,p_value,odd\n";
  if (!device.combined) return out.str();
  const DeviceReport& report = *device.combined;
  const Calibration& c = report.report.calibration;
  const auto total = c.sigma_total();
  for (int i = 0; i < kStateSize; ++i) {
    const auto index = static_cast<size_t>(i);
    const Repeatability& repeats = report.combined.repeatability[index];
    out << report.parameters[index] << ",";
    if (c.determined[index]) {
      out << Number(ValuesOf(c, c.q_gyro_cam)[i]) << "," << Number(c.sigma()[i]) << ","
          << (total ? Number((*total)[i]) : "");
    } else {
      out << ",,";
    }
    out << "," << (report.shared[index] ? "true" : "false") << "," << repeats.recordings << ","
        << Number(repeats.between) << "," << Number(repeats.chi2) << "," << Number(repeats.p_value)
        << ",";
    std::string odd_ones;
    for (const OddRecording& odd : report.combined.odd) {
      if (odd.parameter != i) continue;
      odd_ones += (odd_ones.empty() ? "" : ";") + report.recordings[odd.recording];
    }
    out << Quoted(odd_ones) << "\n";
  }
  return out.str();
}

std::string DevicePage(const BatchDevice& device) {
  std::vector<ReportSection> sections;
  if (device.combined) {
    sections.push_back(ParametersSection(device));
    sections.push_back(ChartsSection(device));
  }
  sections.push_back(RecordingsSection(device));
  const size_t members = Members(device).size();
  return ReportPage(
      device.name,
      Format("%zu of %zu recordings are part of this device", members, device.results.size()),
      sections);
}

}  // namespace camgyro::batch
