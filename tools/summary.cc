#include "tools/summary.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "core/format.h"
#include "estimator/halves.h"
#include "estimator/start/axis_permutation.h"
#include "tools/report/parameter_rows.h"

namespace camgyro {
namespace {

constexpr size_t kWidth = 96;

std::string TableRow(const ParameterRow& row) {
  const int decimals = DecimalsFor(row.sigma);
  const std::string total =
      row.sigma_total ? Format("± %-9.*f ", decimals, *row.sigma_total) : std::string();
  return Format("  %-22s %12.*f ± %-9.*f ", row.name.c_str(), decimals, row.value, decimals,
                row.sigma) +
         total +
         (row.determined ? row.unit
                         : Format("%-6s not determined by this recording", row.unit.c_str())) +
         "\n";
}

// Each effect with its parameters, at most four of a kind.
std::string EffectRows(const Calibration& c) {
  std::string rows;
  if (!c.effects) return rows;
  for (const EffectSet::Item& item : c.effects->items()) {
    rows += "  " + NameWithShape(item) +
            (item.effect->size() == 0 ? " (no number of its own)" : "") + "\n";
    for (int k = 0; k < item.effect->size(); ++k) {
      if (k == 4 && item.effect->size() > 5) {
        rows += Format("    and %d more, in calibration.yaml\n", item.effect->size() - 4);
        break;
      }
      const EffectParameter& p = item.effect->parameters()[static_cast<size_t>(k)];
      const ReadableUnit unit = ReadableUnitOf(p.unit);
      const int column = item.first + k;
      const double sigma = unit.scale * std::sqrt(c.effect_covariance(column, column));
      rows += Format("    %-20s %12.*f ± %-9.*f %s\n", p.name.c_str(), DecimalsFor(sigma),
                     unit.scale * c.effect_values[column], DecimalsFor(sigma), sigma,
                     unit.name.c_str());
    }
  }
  return rows;
}

}  // namespace

std::string ParameterTable(const Calibration& c, bool attitudes) {
  const Eigen::Matrix3d permutation = MountingPermutation(c);
  std::string table;
  if (c.total_covariance) {
    table += Format("  %-22s %12s %-13s %s\n", "", "value", "  ± noise", "± in all");
  }
  for (const ParameterRow& row : ParameterRows(c, permutation, attitudes)) table += TableRow(row);
  return table + EffectRows(c) +
         "  (t_gyro = t_camera + delay; the mounting is what is left, about the camera's\n"
         "  axes, after " +
         DescribePermutation(permutation) + ")\n";
}

std::string DeviceTable(const DeviceReport& device) {
  const Calibration& c = device.report.calibration;
  const Eigen::Quaterniond permutation(MountingPermutation(c));
  std::string table = Format("one device, %zu recordings (delay and bias: of the next one)\n",
                             device.recordings.size());
  table += ParameterTable(c, device.attitudes);
  table += Format("\n  %-22s %16s %8s   %s\n", "between recordings", "spread", "chance", "values");
  for (const ParameterRow& row :
       ParameterRows(c, permutation.toRotationMatrix(), device.attitudes)) {
    const Repeatability& repeats = device.combined.repeatability[static_cast<size_t>(row.index)];
    if (repeats.recordings < 2) continue;
    const int decimals = DecimalsFor(device.each.front().sigma()[row.index] * row.unit_scale);
    table += Format("  %-22s %9.*f %-6s %8.1g  ", row.name.c_str(), decimals,
                    row.unit_scale * repeats.between, row.unit.c_str(), repeats.p_value);
    for (const Calibration& each : device.each) {
      table += Format(" %.*f", decimals, row.unit_scale * ValuesOf(each, permutation)[row.index]);
    }
    table += "\n";
  }
  table += "  (spread: beyond noise; chance: that noise alone makes such differences)\n\n";
  for (const OddRecording& odd : device.combined.odd) {
    const auto i = static_cast<size_t>(odd.parameter);
    table +=
        Notes("odd", {Format("%s: its %s is %.1f sigmas off that of the others",
                             device.recordings[odd.recording].c_str(),
                             i < kStateSize ? StateTable()[i].label : device.parameters[i].c_str(),
                             std::abs(odd.sigmas))});
  }
  return table;
}

std::string SystematicLine(const CalibrationReport& report) {
  const auto total = report.calibration.sigma_total();
  if (!total) return "";
  const StateVector noise = report.calibration.sigma();
  std::string line;
  for (const int i : {kStateFocal, kStateReadout, kStateDelay}) {
    const auto largest = std::max_element(
        report.systematic.begin(), report.systematic.end(),
        [i](const EffectShare& a, const EffectShare& b) { return a.sigma[i] < b.sigma[i]; });
    if (largest == report.systematic.end() || !(largest->sigma[i] > noise[i])) continue;
    const StateParameter& p = StateTable()[static_cast<size_t>(i)];
    const double sigma = p.unit_scale * largest->sigma[i];
    line += Format("%s%s %s %.*f of %.*f %s", line.empty() ? "" : "; ", p.label,
                   largest->effect.c_str(), DecimalsFor(sigma), sigma, DecimalsFor(sigma),
                   p.unit_scale * (*total)[i], p.unit);
  }
  const std::string device = "of a usual device (--device=" + report.device_class + ")";
  return Notes("in all", {device + (line.empty() ? ", mostly noise" : ", mostly: " + line)});
}

std::string MotionLine(const Recording& recording, const TrackingSummary& tracking) {
  const ImageMotion motion = MeasureImageMotion(recording);
  if (motion.pairs == 0) return "";
  std::string line = Format("matches    %.0f per pair of frames, moving by %.1f px (medians)",
                            motion.matches, motion.motion_px);
  if (tracking.seconds > 0.0 || tracking.outlier_ratio > 0.0) {
    line += Format(", %.1f %% outliers", 100.0 * tracking.outlier_ratio);
  }
  return line + "\n";
}

std::string StartLine(const StartResult& start) {
  return Format(
      "start      delay %.1f ms in the middle row explains %.0f %% of the gyro's motion; "
      "next best: %.0f x as bad\n",
      1e3 * start.delay_middle_row_s, 100.0 * start.explained,
      1.0 / std::max(1e-3, start.runner_up_ratio));
}

// Below, a reader need not know: in docs/lab/measured.md it is 0.07 at most where pairs are equally
// noisy and the lens is in the model.
constexpr double kScatterWorthSaying = 0.1;
// Of the design effect: below, sigmas are wider by less than 5 %.
constexpr double kEffectWorthSaying = 1.1;

std::string QualityLine(const CalibrationReport& report, bool attitudes) {
  const FitQuality& quality = report.quality;
  if (attitudes) {
    return Format("fit        %d rotations, noise %.2f mrad, %.0f %% inliers\n", quality.pairs,
                  1e3 * quality.noise_px, 100.0 * quality.inlier_ratio);
  }
  std::string line = Format("fit        %d pairs", quality.pairs);
  // The online pass counts no matches.
  if (quality.matches > 0) line += Format(", %d matches", quality.matches);
  if (quality.design_effect > kEffectWorthSaying) {
    line += Format(" (worth %.0f independent ones)", quality.matches / quality.design_effect);
  }
  line += Format(", noise %.3f px", quality.noise_px);
  if (quality.noise_scatter > kScatterWorthSaying) {
    line += Format(" (%.0f %% more or less from pair to pair)", 100.0 * quality.noise_scatter);
  }
  if (quality.inlier_ratio > 0.0) line += Format(", %.0f %% inliers", 100.0 * quality.inlier_ratio);
  if (quality.rms_px > 0.0) line += Format(", rms %.3f px", quality.rms_px);
  if (report.unseen) line += Format(", on unseen frames %.3f px", report.unseen->rms_px);
  return line + "\n";
}

std::string HalvesLine(double chi2) {
  if (!(chi2 > 0.0) || chi2 > kHalvesLimit) return "";
  return Format("halves     of the recording agree: chi2 per parameter %.2f, 1 expected\n", chi2);
}

std::string TimeLine(const std::vector<StageTime>& times, double tracking_s, size_t frames) {
  std::string line = "time      ";
  if (tracking_s > 0.0) {
    line += Format(" tracking %.1f s (%.0f frames/s),", tracking_s,
                   static_cast<double>(frames) / tracking_s);
  }
  for (const StageTime& time : times) {
    line += Format(" %s %.1f s", time.stage.c_str(), time.seconds);
    if (time.stage == "window" && time.seconds > 0.0) {
      line += Format(" (%.0f frames/s)", static_cast<double>(frames) / time.seconds);
    }
    line += &time == &times.back() ? "" : ",";
  }
  return line + "\n";
}

std::string Notes(const char* label, const std::vector<std::string>& notes) {
  std::string text;
  for (const std::string& note : notes) {
    text += Format("%-11s", label);
    std::istringstream words(note);
    std::string word;
    size_t column = 11;
    while (words >> word) {
      if (column > 11 && column + 1 + word.size() > kWidth) {
        text += "\n" + std::string(11, ' ');
        column = 11;
      } else if (column > 11) {
        text += " ";
        ++column;
      }
      text += word;
      column += word.size();
    }
    text += "\n";
  }
  return text;
}

}  // namespace camgyro
