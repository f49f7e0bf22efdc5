#include "pipeline/input_yaml.h"

#include <yaml-cpp/yaml.h>

#include <optional>

#include "estimator/diagnosis/data_faults.h"

namespace camgyro {
namespace {

const char* KindName(StampKind kind) {
  switch (kind) {
    case StampKind::kMeasured:
      return "measured";
    case StampKind::kArrival:
      return "arrival";
    case StampKind::kIrregular:
      return "irregular";
  }
  return "";
}

void EmitStamps(const char* key, const std::optional<StampReport>& report, YAML::Emitter* out) {
  if (!report) return;
  *out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginMap;
  *out << YAML::Key << "kind" << YAML::Value << KindName(report->kind);
  *out << YAML::Key << "period_s" << YAML::Value << report->period_s;
  *out << YAML::Key << "jitter_s" << YAML::Value << report->jitter_s;
  *out << YAML::Key << "latest_s" << YAML::Value << report->latest_s;
  *out << YAML::Key << "residual_s" << YAML::Value << report->residual_s;
  *out << YAML::Key << "level_sigma_s" << YAML::Value << report->level_sigma_s;
  *out << YAML::Key << "missing" << YAML::Value << report->missing;
  *out << YAML::Key << "repaired" << YAML::Value << report->repaired << YAML::EndMap;
}

void EmitFault(const std::string& name, int count, const std::string& finding, bool mended,
               YAML::Emitter* out) {
  *out << YAML::BeginMap << YAML::Key << "name" << YAML::Value << name;
  *out << YAML::Key << "count" << YAML::Value << count;
  *out << YAML::Key << "finding" << YAML::Value << finding;
  *out << YAML::Key << "mended" << YAML::Value << mended << YAML::EndMap;
}

}  // namespace

std::string InputYaml(const Recording& recording) {
  YAML::Emitter out;
  out.SetDoublePrecision(10);
  out << YAML::BeginMap << YAML::Key << "stamps" << YAML::Value << YAML::BeginMap;
  EmitStamps("gyro", recording.gyro_stamps, &out);
  EmitStamps("camera", recording.camera_stamps, &out);
  out << YAML::EndMap << YAML::Key << "faults" << YAML::Value << YAML::BeginSeq;
  for (const RecordedFault& fault : recording.faults) {
    EmitFault(fault.name, fault.count, fault.finding, /*mended=*/true, &out);
  }
  for (const DataFault& fault : FindDataFaults(recording)) {
    EmitFault(fault.name, fault.count, fault.finding, /*mended=*/false, &out);
  }
  out << YAML::EndSeq << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace camgyro
