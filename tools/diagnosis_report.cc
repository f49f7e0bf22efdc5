#include "tools/diagnosis_report.h"

#include <cmath>
#include <limits>

#include "core/format.h"
#include "estimator/diagnosis/gain_rule.h"
#include "tools/diagnosis_file.h"
#include "tools/report/calibrate_report.h"
#include "tools/report/charts.h"
#include "tools/report/page.h"
#include "tools/report/parameter_rows.h"

namespace camgyro {
namespace {

std::vector<TableCell> Row(const std::vector<std::string>& texts) {
  std::vector<TableCell> row;
  for (const std::string& text : texts) row.push_back({text, "", 0.0});
  return row;
}

std::string StructureText(const Diagnosis& d) {
  return "Structure is left that nothing in the catalogue explains: " + Joined(d.where);
}

ReportSection VerdictSection(const Diagnosis& d, bool attitudes) {
  std::string html =
      Paragraph(d.effects.empty() ? "No effect beyond " + NameOfModel(d) + " was found."
                                  : "Found: " + Joined(d.effects) + ".");
  if (!d.not_tested.empty()) html += Paragraph("Nothing was tested: " + d.not_tested + ".");
  const std::vector<std::string> unconfirmed = Unconfirmed(d.rounds);
  if (!unconfirmed.empty()) {
    html += Paragraph("Not confirmed by frames that neither fit nor choice has seen: " +
                      Joined(unconfirmed) + ".");
  }
  if (d.unexplained_structure) html += Paragraph(StructureText(d) + ".");
  std::vector<std::string> faults;
  for (const DataFault& fault : d.faults) {
    faults.push_back(fault.name + ": " + fault.finding + ". What to do: " + fault.advice + ".");
  }
  html += BulletList(faults);
  const double scale = attitudes ? 1e3 : 1.0;
  ReportTable rounds;
  rounds.header = {"Round",
                   "Added",
                   "Parameters",
                   "p",
                   attitudes ? "unseen rms [mrad]" : "unseen rms [px]",
                   "unseen chi2/dof",
                   "fall of chi2",
                   "What to do"};
  for (size_t i = 0; i < d.rounds.size(); ++i) {
    const DiagnosisRound& round = d.rounds[i];
    if (round.added.empty()) {
      rounds.rows.push_back(Row({Format("%zu", i + 1), NothingAddedText(round), "", "",
                                 Format("%.3f", scale * round.before.rms_px),
                                 Format("%.3f", round.before.chi2), "", ""}));
      continue;
    }
    const CandidateResult& c = round.candidates.front();
    rounds.rows.push_back(
        Row({Format("%zu", i + 1),
             c.name + " (" + c.shape + "): " + FindEffect(c.name)->explanation +
                 (round.withdrawn.empty() ? "" : "; withdrawn: " + round.withdrawn),
             ValuesText(c),
             c.tried_anyway ? "without it, the model is far off" : Format("%.2g", c.p_value),
             Format("%.3f → %.3f", scale * round.before.rms_px, scale * round.after.rms_px),
             Format("%.3f → %.3f", round.before.chi2, round.after.chi2),
             Format("%.0f ± %.0f", round.report_gain.sum, round.report_gain.sigma),
             round.withdrawn.empty() ? FindEffect(c.name)->advice : ""}));
  }
  if (!d.rounds.empty()) {
    html +=
        Paragraph(Format("Fitted on %d pairs of frames, chosen by %d others, reported on "
                         "%d others, which neither the fit nor the choice has seen%s.",
                         d.fit_pairs, d.choice_pairs, d.report_pairs,
                         d.report_shares_tracks ? " (tracks go on from one to the other)" : "")) +
        TableHtml(rounds);
  }
  for (const auto& names : d.indistinguishable) {
    html += Paragraph("This motion cannot tell apart: " + Joined(names) + ".");
  }
  return {"diagnosis", "Diagnosis", html};
}

// Each map before the effects and after them, on one scale.
ReportSection MapsSection(const Diagnosis& d) {
  std::string html = Paragraph(
      "What a change along each axis would be, if the model allowed it. Without structure it "
      "scatters about zero, the misfit about one; p is that of the structure after the last "
      "effect.");
  std::vector<std::string> charts;
  for (size_t m = 0; m < d.maps_after.size(); ++m) {
    const StructureMap& after = d.maps_after[m];
    const StructureMap* before = m < d.maps_before.size() ? &d.maps_before[m] : nullptr;
    const bool image = after.shape.size() == 2 && after.axis.empty();
    if (image) {
      std::vector<ImageMap> maps;
      for (const auto& [title, map] : {std::pair("before", before), {"after", &after}}) {
        if (map == nullptr || map->value.size() != 2 * map->shape[0] * map->shape[1]) continue;
        ImageMap drawn;
        drawn.title = title;
        drawn.arrow_x.resize(map->shape[0], map->shape[1]);
        drawn.arrow_y = drawn.arrow_x;
        for (int r = 0; r < map->shape[0]; ++r) {
          for (int c = 0; c < map->shape[1]; ++c) {
            const Eigen::Index at = 2 * (r * map->shape[1] + c);
            drawn.arrow_x(r, c) = map->value[at];
            drawn.arrow_y(r, c) = map->value[at + 1];
          }
        }
        drawn.value = (drawn.arrow_x.cwiseAbs2() + drawn.arrow_y.cwiseAbs2()).cwiseSqrt();
        maps.push_back(std::move(drawn));
      }
      const Calibration& c = d.result().calibration;
      html += ImageMapsHtml("map-image", Format("shift over the image, p = %.2g", after.p_value),
                            maps, c.width_px, c.height_px, after.unit);
      continue;
    }
    const size_t inner = after.shape.size() == 2 ? 3 : 1;
    for (size_t part = 0; part < inner; ++part) {
      LineChart chart;
      chart.id = Format("map-%zu-%zu", m, part);
      chart.title = after.name + (inner == 3 ? std::string(", about gyro ") + "xyz"[part] : "") +
                    Format(" (p = %.2g)", after.p_value);
      chart.x_label = after.axis_unit;
      const ReadableUnit unit = ReadableUnitOf(after.unit);
      chart.y_label = unit.name;
      chart.x = after.axis;
      for (const auto& [name, map] : {std::pair("before", before), {"after", &after}}) {
        if (map == nullptr || map->axis.size() != after.axis.size() ||
            (map == before && d.rounds.size() < 2)) {
          continue;
        }
        ChartSeries series;
        series.name = name;
        series.dashed = map == before;
        for (size_t i = 0; i < after.axis.size(); ++i) {
          const auto at = static_cast<Eigen::Index>(inner * i + part);
          const bool known = at < map->value.size();
          series.y.push_back(known ? unit.scale * map->value[at]
                                   : std::numeric_limits<double>::quiet_NaN());
        }
        chart.series.push_back(std::move(series));
      }
      charts.push_back(LineChartHtml(chart));
    }
  }
  return {"structure", "What is left, along every axis", html + ChartGrid(charts)};
}

}  // namespace

Result<std::string> DiagnosisReportHtml(const Recording& recording, const SmallPictures& pictures,
                                        const Diagnosis& diagnosis, const RunInfo& run) {
  CalibrationReport result = diagnosis.result();
  if (diagnosis.unexplained_structure) result.doubts.push_back(StructureText(diagnosis));
  Result<std::vector<ReportSection>> sections =
      CalibrationSections(recording, pictures, result, run);
  if (!sections) return tl::unexpected(sections.error());
  sections->insert(sections->begin(), VerdictSection(diagnosis, recording.HasOnlyAttitudes()));
  if (!diagnosis.maps_after.empty()) {
    sections->insert(sections->begin() + 1, MapsSection(diagnosis));
  }
  return ReportPage("Diagnosis of " + recording.path, run.recording, *sections);
}

}  // namespace camgyro
