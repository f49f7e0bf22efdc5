#include "tools/comparison/comparison_report.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/format.h"

namespace camgyro::comparison {
namespace {

constexpr int kDigits = 10;

// Right-aligned with three digits; a dash for what is not known.
std::string Cell(double value, int width) {
  if (!std::isfinite(value)) return Format("%*s", width, "-");
  const double magnitude = std::abs(value);
  const int decimals = magnitude >= 100.0 ? 0 : magnitude >= 10.0 ? 1 : magnitude >= 1.0 ? 2 : 3;
  return Format("%*.*f", width, decimals, value);
}

// "walking: 8 runs, 301 frames, noise 0.5 px".
std::string Headline(const CaseResult& result) {
  const auto count = static_cast<int>(result.runs.size());
  int frames = 0;
  for (const SeedRun& run : result.runs) {
    for (const EstimatorRun& e : run.estimators) frames = std::max(frames, e.frames);
  }
  std::string text =
      Format("%s: %d run%s, %d frames", result.name.c_str(), count, count == 1 ? "" : "s", frames);
  if (result.noise_px > 0.0) text += Format(", noise %g px", result.noise_px);
  return text;
}

// "1.05 [0.81, 1.32]".
std::string NeesText(const EstimatorStatistics& s) {
  std::string text = Cell(s.nees, 0);
  if (std::isfinite(s.nees_low)) {
    text += " [" + Cell(s.nees_low, 0) + ", " + Cell(s.nees_high, 0) + "]";
  }
  return text;
}

std::string EstimatorLine(const EstimatorStatistics& s) {
  std::string line = Format("  %-11s", s.estimator.c_str());
  if (s.runs > 0) {
    line += "NEES/dof " + NeesText(s) +
            Format(", %.0f %% within 3 sigma, ", 100.0 * s.within_3_sigma) +
            Cell(s.ms_per_frame, 0) + " ms per frame, " + Cell(s.memory_mb, 0) + " MB";
  }
  if (s.failed > 0) line += Format("%s%d failed", s.runs > 0 ? ", " : "", s.failed);
  for (const std::string& failure : s.failures) line += "\n             (" + failure + ")";
  return line + "\n";
}

void Emit(YAML::Emitter& out, const char* key, double value) {
  out << YAML::Key << key << YAML::Value << value;
}

void EmitEstimator(YAML::Emitter& out, const EstimatorStatistics& s) {
  out << YAML::BeginMap << YAML::Key << "estimator" << YAML::Value << s.estimator;
  out << YAML::Key << "runs" << YAML::Value << s.runs << YAML::Key << "failed" << YAML::Value
      << s.failed;
  if (s.runs == 0) {
    out << YAML::EndMap;
    return;
  }
  out << YAML::Key << "nees_per_dof" << YAML::Value << YAML::Flow << YAML::BeginMap;
  Emit(out, "mean", s.nees);
  Emit(out, "low", s.nees_low);
  Emit(out, "high", s.nees_high);
  out << YAML::EndMap;
  Emit(out, "within_3_sigma", s.within_3_sigma);
  Emit(out, "ms_per_frame", s.ms_per_frame);
  Emit(out, "memory_mb", s.memory_mb);
  out << YAML::Key << "parameters" << YAML::Value << YAML::BeginMap;
  for (size_t i = 0; i < kStateSize; ++i) {
    const ParameterStatistics& p = s.parameters[i];
    out << YAML::Key << StateNames()[i] << YAML::Value << YAML::Flow << YAML::BeginMap;
    Emit(out, "rmse", p.rmse);
    Emit(out, "bound", p.bound);
    Emit(out, "sigma", p.sigma);
    Emit(out, "bias_sigmas", p.bias_sigmas);
    Emit(out, "within_3_sigma", p.within_3_sigma);
    Emit(out, "frames_to_converge", p.frames_to_converge);
    out << YAML::EndMap;
  }
  out << YAML::EndMap << YAML::EndMap;
}

std::string Header(const char* prefix) {
  std::string header;
  for (const std::string& name : StateNames()) header += "," + (prefix + name);
  return header;
}

}  // namespace

std::string CaseTable(const CaseResult& result) {
  std::string text = Headline(result) + "\n";
  for (const EstimatorStatistics& s : result.statistics) {
    text += EstimatorLine(s);
    if (s.runs == 0) continue;
    text += Format("    %-12s%9s%9s%9s%9s%9s%9s%9s\n", "", "RMSE", "bound", "/ bound", "sigma",
                   "bias", "in 3 s", "frames");
    for (size_t i = 0; i < kStateSize; ++i) {
      const ParameterStatistics& p = s.parameters[i];
      const StateParameter& unit = StateTable()[i];
      text += Format("    %-4s%-8s", unit.symbol, unit.error_unit) +
              Cell(unit.error_scale * p.rmse, 9) + Cell(unit.error_scale * p.bound, 9) +
              Cell(p.rmse / p.bound, 9) + Cell(unit.error_scale * p.sigma, 9) +
              Cell(p.bias_sigmas, 9) + Format("%7.0f %%", 100.0 * p.within_3_sigma) +
              (std::isfinite(p.frames_to_converge) ? Format("%9.0f\n", p.frames_to_converge)
                                                   : Format("%9s\n", "-"));
    }
  }
  return text;
}

std::string ComparisonMarkdown(const std::vector<CaseResult>& results) {
  std::string text;
  for (const CaseResult& result : results) {
    text += "### " + Headline(result) + "\n\n";
    text +=
        "| | NEES/dof | Within 3 sigma | CPU per frame [ms] | Memory [MB] | Failed |\n"
        "| --- | --- | --- | --- | --- | --- |\n";
    std::string heads = "| RMSE (/ bound; bias / sigma; frames) | bound |";
    std::string rules = "| --- | --- |";
    for (const EstimatorStatistics& s : result.statistics) {
      heads += " " + s.estimator + " |";
      rules += " --- |";
      text += "| " + s.estimator + " |";
      if (s.runs > 0) {
        text += " " + NeesText(s) + Format(" | %.0f %% | ", 100.0 * s.within_3_sigma) +
                Cell(s.ms_per_frame, 0) + " | " + Cell(s.memory_mb, 0) + " |";
      } else {
        text += " - | - | - | - |";
      }
      text += Format(" %d |\n", s.failed);
    }
    text += "\n" + heads + "\n" + rules + "\n";
    for (size_t i = 0; i < kStateSize; ++i) {
      const StateParameter& unit = StateTable()[i];
      const double bound = unit.error_scale * result.statistics.front().parameters[i].bound;
      text += Format("| %s [%s] | ", unit.symbol, unit.error_unit) + Cell(bound, 0) + " |";
      for (const EstimatorStatistics& s : result.statistics) {
        const ParameterStatistics& p = s.parameters[i];
        text += s.runs == 0 ? std::string(" - |")
                            : " " + Cell(unit.error_scale * p.rmse, 0) + " (" +
                                  Cell(p.rmse / p.bound, 0) + "; " + Cell(p.bias_sigmas, 0) + "; " +
                                  (std::isfinite(p.frames_to_converge)
                                       ? Format("%.0f", p.frames_to_converge)
                                       : std::string("-")) +
                                  ") |";
      }
      text += "\n";
    }
    text += "\n";
  }
  return text;
}

std::string ComparisonYaml(const std::vector<CaseResult>& results) {
  YAML::Emitter out;
  out.SetDoublePrecision(kDigits);
  out << YAML::BeginMap << YAML::Key << "cases" << YAML::Value << YAML::BeginSeq;
  for (const CaseResult& result : results) {
    out << YAML::BeginMap << YAML::Key << "name" << YAML::Value << result.name;
    if (result.noise_px > 0.0) Emit(out, "noise_px", result.noise_px);
    out << YAML::Key << "estimators" << YAML::Value << YAML::BeginSeq;
    for (const EstimatorStatistics& s : result.statistics) EmitEstimator(out, s);
    out << YAML::EndSeq << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string RunsCsv(const std::vector<CaseResult>& results) {
  std::ostringstream out;
  out.precision(kDigits);
  out << "#case,run,estimator,failed,cpu_s,memory_mb" << Header("error_") << Header("sigma_")
      << Header("bound_") << "\n";
  for (const CaseResult& result : results) {
    for (size_t r = 0; r < result.runs.size(); ++r) {
      for (const EstimatorRun& e : result.runs[r].estimators) {
        out << result.name << "," << r << "," << e.estimator << "," << !e.failure.empty() << ","
            << e.cpu_s << "," << e.memory_mb;
        for (int i = 0; i < kStateSize; ++i) out << "," << e.error[i];
        for (int i = 0; i < kStateSize; ++i) out << "," << std::sqrt(e.covariance(i, i));
        for (int i = 0; i < kStateSize; ++i) {
          out << ",";
          const auto& bound = result.runs[r].bound;
          if (!bound.empty()) out << std::sqrt(bound.back()(i, i));
        }
        out << "\n";
      }
    }
  }
  return out.str();
}

std::string TracesCsv(const std::vector<CaseResult>& results) {
  std::ostringstream out;
  out.precision(kDigits);
  out << "#case,estimator,frame" << Header("error_") << Header("sigma_") << "\n";
  for (const CaseResult& result : results) {
    for (const EstimatorRun& e : result.runs.front().estimators) {
      for (const TracePoint& point : e.trace) {
        out << result.name << "," << e.estimator << "," << point.frame;
        for (int i = 0; i < kStateSize; ++i) out << "," << point.error[i];
        for (int i = 0; i < kStateSize; ++i) out << "," << point.sigma[i];
        out << "\n";
      }
    }
  }
  return out.str();
}

}  // namespace camgyro::comparison
