#include "tools/diagnosis_file.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/format.h"
#include "estimator/diagnosis/gain_rule.h"
#include "tools/report/parameter_rows.h"

namespace camgyro {
namespace {

template <typename T>
void Emit(YAML::Emitter& out, const char* key, const T& value) {
  out << YAML::Key << key << YAML::Value << value;
}

void EmitBeforeAfter(YAML::Emitter& out, const char* key, double before, double after) {
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginMap;
  Emit(out, "before", before);
  Emit(out, "after", after);
  out << YAML::EndMap;
}

void EmitParameters(YAML::Emitter& out, const CandidateResult& c) {
  out << YAML::Key << "parameters" << YAML::Value << YAML::BeginSeq;
  for (Eigen::Index k = 0; k < c.estimate.size() && k < c.sigma.size(); ++k) {
    const EffectParameter& p = c.parameter_info[static_cast<size_t>(k)];
    out << YAML::Flow << YAML::BeginMap;
    Emit(out, "name", p.name);
    Emit(out, "unit", p.unit);
    Emit(out, "value", c.estimate[k]);
    Emit(out, "sigma", c.sigma[k]);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

void EmitRound(YAML::Emitter& out, const DiagnosisRound& round) {
  out << YAML::BeginMap << YAML::Key << "candidates" << YAML::Value << YAML::BeginSeq;
  for (const CandidateResult& c : round.candidates) {
    out << YAML::BeginMap;
    Emit(out, "name", c.name);
    Emit(out, "shape", c.shape);
    Emit(out, "statistic", c.statistic);
    Emit(out, "dof", c.parameters);
    Emit(out, "p_value", c.p_value);
    Emit(out, "inflation", c.inflation);
    Emit(out, "unseen_gain", c.gain.sum);
    Emit(out, "unseen_gain_sigma", c.gain.sigma);
    Emit(out, "refitted", c.refitted);
    Emit(out, "rejected", c.rejected);
    if (c.refitted) EmitParameters(out, c);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
  Emit(out, "added", round.added.empty() ? "none" : round.added);
  if (!round.added.empty()) Emit(out, "shape", round.shape);
  if (!round.withdrawn.empty()) Emit(out, "withdrawn", round.withdrawn);
  EmitBeforeAfter(out, "unseen_rms_px", round.before.rms_px, round.after.rms_px);
  EmitBeforeAfter(out, "unseen_chi2", round.before.chi2, round.after.chi2);
  out << YAML::Key << "unseen_gain" << YAML::Value << YAML::Flow << YAML::BeginMap;
  Emit(out, "value", round.report_gain.sum);
  Emit(out, "sigma", round.report_gain.sigma);
  if (!round.added.empty()) Emit(out, "expected", round.expected_gain);
  Emit(out, "residuals", round.before.residuals);
  out << YAML::EndMap;
  if (!round.added.empty()) {
    out << YAML::Key << "shift_sigmas" << YAML::Value << YAML::Flow << YAML::BeginMap;
    for (int i = 0; i < kStateSize; ++i) {
      Emit(out, StateNames()[static_cast<size_t>(i)].c_str(), round.shift_sigmas[i]);
    }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
}

// By how much chi2 of unseen frames falls, and what that says of the effect.
std::string UnseenGainText(const DiagnosisRound& round) {
  std::string text = Format("%.0f ± %.0f", round.report_gain.sum, round.report_gain.sigma);
  if (IsUnconfirmed(round)) {
    text += Format(", %.0f expected: they do not confirm it", round.expected_gain);
  } else if (!ShowsGain(round)) {
    text += " (too little to tell)";
  }
  return text;
}

std::string RoundText(size_t number, const DiagnosisRound& round, const char* unit, double scale) {
  std::string text;
  if (round.added.empty()) return Format("%zu. ", number) + NothingAddedText(round) + "\n";
  const CandidateResult& c = round.candidates.front();
  text = Format("%zu. %s%s: %s\n", number, c.name.c_str(),
                c.shape == "constant" ? "" : (" (" + c.shape + ")").c_str(),
                FindEffect(c.name)->explanation.c_str());
  if (c.estimate.size() > 0) text += "     " + ValuesText(c) + "\n";
  text += c.tried_anyway
              ? "     how sure: without it the model is so far off that its score says nothing"
              : Format("     how sure: p = %.2g", c.p_value);
  text +=
      Format("; in the frames that chose it, chi2 falls by %.0f ± %.0f", c.gain.sum, c.gain.sigma);
  if (c.gain.sum < 2.0 * c.gain.sigma && !c.tried_anyway) {
    const Gain expected = c.ExpectedGain();
    text += Format(" (they are half of the evidence; %.0f ± %.0f expected)", expected.sum,
                   expected.sigma);
  }
  text += "\n";
  text += Format(
      "     unseen frames: rms %.*f -> %.*f %s, chi2/dof %.3f -> %.3f, chi2 falls by "
      "%s\n",
      3, scale * round.before.rms_px, 3, scale * round.after.rms_px, unit, round.before.chi2,
      round.after.chi2, UnseenGainText(round).c_str());
  std::string shifts;
  for (int i = 0; i < kStateSize; ++i) {
    if (std::abs(round.shift_sigmas[i]) >= 2.0) {
      shifts += Format("%s%s %+.1f", shifts.empty() ? "" : ", ",
                       StateNames()[static_cast<size_t>(i)].c_str(), round.shift_sigmas[i]);
    }
  }
  if (!shifts.empty()) text += "     moved, in their sigmas: " + shifts + "\n";
  std::string rivals;
  for (size_t i = 1; i < round.candidates.size(); ++i) {
    const CandidateResult& rival = round.candidates[i];
    if (rival.refitted) {
      const bool same = rival.name == c.name;
      rivals += Format("%s%s (%schi2 %.0f ± %.0f)", rivals.empty() ? "" : ", ", rival.name.c_str(),
                       same ? (rival.shape + ", ").c_str() : "", rival.gain.sum, rival.gain.sigma);
    }
  }
  if (!rivals.empty()) text += "     rivals, refitted: " + rivals + "\n";
  if (!round.withdrawn.empty()) return text + "     withdrawn: " + round.withdrawn + "\n";
  return text + "     what to do: " + FindEffect(c.name)->advice + "\n";
}

}  // namespace

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string ValuesText(const CandidateResult& c) {
  std::string text;
  for (Eigen::Index k = 0; k < c.estimate.size() && k < 4; ++k) {
    if (k >= c.sigma.size()) break;
    const EffectParameter& p = c.parameter_info[static_cast<size_t>(k)];
    const ReadableUnit unit = ReadableUnitOf(p.unit);
    text +=
        Format("%s%s %.4g ± %.2g%s", k > 0 ? ", " : "", p.name.c_str(), unit.scale * c.estimate[k],
               unit.scale * c.sigma[k], unit.name.empty() ? "" : (" " + unit.name).c_str());
  }
  if (c.estimate.size() > 4)
    text += Format(", and %d more", static_cast<int>(c.estimate.size()) - 4);
  return text;
}

std::string DiagnosisYaml(const Diagnosis& d) {
  YAML::Emitter out;
  out.SetDoublePrecision(6);
  out << YAML::BeginMap << YAML::Key << "rounds" << YAML::Value << YAML::BeginSeq;
  for (const DiagnosisRound& round : d.rounds) EmitRound(out, round);
  out << YAML::EndSeq << YAML::Key << "shares" << YAML::Value << YAML::Flow << YAML::BeginMap;
  Emit(out, "block_s", d.block_s);
  Emit(out, "fit_pairs", d.fit_pairs);
  Emit(out, "choice_pairs", d.choice_pairs);
  Emit(out, "report_pairs", d.report_pairs);
  Emit(out, "report_shares_tracks", d.report_shares_tracks);
  out << YAML::EndMap << YAML::Key << "faults" << YAML::Value << YAML::BeginSeq;
  for (const DataFault& fault : d.faults) {
    out << YAML::BeginMap;
    Emit(out, "name", fault.name);
    Emit(out, "finding", fault.finding);
    Emit(out, "advice", fault.advice);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::Key << "structure" << YAML::Value << YAML::BeginSeq;
  for (const StructureMap& map : d.maps_after) {
    out << YAML::Flow << YAML::BeginMap;
    Emit(out, "map", map.name);
    Emit(out, "statistic", map.statistic);
    Emit(out, "dof", map.dof);
    Emit(out, "p_value", map.p_value);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::Key << "verdict" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "effects" << YAML::Value << YAML::Flow << d.effects;
  out << YAML::Key << "unconfirmed" << YAML::Value << YAML::Flow << Unconfirmed(d.rounds);
  Emit(out, "unexplained_structure", d.unexplained_structure);
  out << YAML::Key << "where" << YAML::Value << YAML::Flow << d.where;
  out << YAML::Key << "indistinguishable" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const auto& names : d.indistinguishable) out << YAML::Flow << names;
  out << YAML::EndSeq;
  if (!d.not_tested.empty()) Emit(out, "not_tested", d.not_tested);
  if (d.refusal) Emit(out, "refusal", d.refusal->message);
  out << YAML::EndMap << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string ResidualMapsCsv(const Diagnosis& d) {
  std::ostringstream out;
  out.precision(6);
  out << "#when,map,unit,cell,row,column,axis,value,sigma\n";
  for (const auto& [when, maps] : {std::pair("before", &d.maps_before), {"after", &d.maps_after}}) {
    for (const StructureMap& map : *maps) {
      const bool image = map.shape.size() == 2 && map.axis.empty();
      const int inner = image ? 2 : map.shape.size() == 2 ? map.shape[1] : 1;
      for (Eigen::Index i = 0; i < map.value.size() && i < map.sigma.size(); ++i) {
        const int cell = static_cast<int>(i) / inner, part = static_cast<int>(i) % inner;
        out << when << "," << map.name << "," << map.unit << "," << cell << ",";
        if (image) {
          out << cell / map.shape[1] << "," << cell % map.shape[1] << ","
              << "xy"[part];
        } else {
          out << ",," << map.axis[static_cast<size_t>(cell)];
          if (inner == 3)
            out << "/"
                << "xyz"[part];
        }
        out << "," << map.value[i] << "," << map.sigma[i] << "\n";
      }
    }
  }
  return out.str();
}

std::string NothingAddedText(const DiagnosisRound& round) {
  if (round.candidates.empty()) return "nothing more is significant";
  const auto best =
      std::min_element(round.candidates.begin(), round.candidates.end(),
                       [](const auto& a, const auto& b) { return a.p_value < b.p_value; });
  if (best->significant && !best->rejected.empty()) {
    return Format("nothing more is added (%s is significant, p = %.2g, but: %s)",
                  best->name.c_str(), best->p_value, best->rejected.c_str());
  }
  return Format("nothing more is significant (of %zu candidates the nearest is %s, p = %.2g each)",
                round.candidates.size(), best->name.c_str(), best->p_value);
}

std::string NameOfModel(const Diagnosis& diagnosis) {
  const bool plain = !diagnosis.before || diagnosis.before->calibration.effects == nullptr;
  return plain ? "the plain model" : "those of the model";
}

std::string DiagnosisText(const Diagnosis& d, bool attitudes) {
  std::string text = "diagnosis\n";
  for (const DataFault& fault : d.faults) {
    text += "  " + fault.name + ": " + fault.finding + "\n     what to do: " + fault.advice + "\n";
  }
  if (!d.not_tested.empty()) return text + "  " + d.not_tested + "\n";
  if (d.refusal) return text;
  text += Format(
      "  fitted on %d pairs of frames, chosen by %d others, reported on %d others "
      "(stretches of %.1f s%s)\n",
      d.fit_pairs, d.choice_pairs, d.report_pairs, d.block_s,
      d.report_shares_tracks ? "; tracks go on from one to the other" : "");
  for (size_t i = 0; i < d.rounds.size(); ++i) {
    text += "  " + RoundText(i + 1, d.rounds[i], attitudes ? "mrad" : "px", attitudes ? 1e3 : 1.0);
  }
  for (const auto& names : d.indistinguishable) {
    text += "  this motion cannot tell apart: " + Joined(names) +
            "; turn about all axes, fast and slow, near and far from the scene\n";
  }
  text += "verdict    ";
  text += d.effects.empty() ? "no effect beyond " + NameOfModel(d) : Joined(d.effects);
  const std::vector<std::string> unconfirmed = Unconfirmed(d.rounds);
  if (!unconfirmed.empty()) text += "; not confirmed by unseen frames: " + Joined(unconfirmed);
  if (d.unexplained_structure) {
    text += "; structure is left that nothing in the catalogue explains: " + Joined(d.where);
  }
  return text + "\n";
}

}  // namespace camgyro
