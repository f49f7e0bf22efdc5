#include "pipeline/device.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "core/format.h"
#include "pipeline/result_files.h"

namespace camgyro {
namespace {

constexpr std::array<const char*, 10> kOfDevice = {"radial_distortion", "tangential_distortion",
                                                   "aspect_ratio",      "readout_direction",
                                                   "readout_nonlinear", "gyro_scale",
                                                   "gyro_misalignment", "gyro_lowpass",
                                                   "gyro_axis_delay",   "gyro_g_sensitivity"};

const EffectSet::Item* FindItem(const Calibration& c, const EffectSet::Item& like) {
  if (!c.effects) return nullptr;
  for (const EffectSet::Item& item : c.effects->items()) {
    const bool alike = item.entry == like.entry && item.shape == like.shape;
    if (alike && item.effect->size() == like.effect->size()) return &item;
  }
  return nullptr;
}

// Effects of the device that all recordings have in their models.
std::vector<EffectSet::Item> CommonEffects(const std::vector<const CalibrationReport*>& reports) {
  std::vector<EffectSet::Item> common;
  const Calibration& first = reports.front()->calibration;
  if (!first.effects) return common;
  for (const EffectSet::Item& item : first.effects->items()) {
    const bool of_device = IsEffectOfDevice(item.entry->name);
    const bool everywhere =
        std::all_of(reports.begin(), reports.end(), [&](const CalibrationReport* report) {
          return FindItem(report->calibration, item) != nullptr;
        });
    if (of_device && everywhere && item.effect->size() > 0) common.push_back(item);
  }
  return common;
}

Status CheckOneCamera(const std::vector<std::string>& names,
                      const std::vector<const CalibrationReport*>& reports) {
  const Calibration& first = reports.front()->calibration;
  for (size_t i = 1; i < reports.size(); ++i) {
    const Calibration& c = reports[i]->calibration;
    if (c.width_px != first.width_px || c.height_px != first.height_px) {
      return BadInput(Format("%s: expected the camera of %s, %d x %d, got %d x %d",
                             names[i].c_str(), names[0].c_str(), first.width_px, first.height_px,
                             c.width_px, c.height_px));
    }
    LensParameters difference = c.lens - first.lens;
    difference[kFocal] = difference[kCx] = difference[kCy] = 0.0;
    if (c.distortion_model != first.distortion_model || difference.cwiseAbs().maxCoeff() > 1e-9) {
      return BadInput(names[i] + ": expected the camera of " + names[0] +
                      ": its sensor.yaml declares another distortion or aspect ratio");
    }
  }
  return {};
}

// As a difference from `reference`, with the effects' parameters behind the state's.
RecordingEstimate EstimateOf(const CalibrationReport& report, const Calibration& reference,
                             const std::vector<EffectSet::Item>& effects, Eigen::Index size) {
  const Calibration& c = report.calibration;
  RecordingEstimate e;
  e.value = e.prior_value = Eigen::VectorXd::Zero(size);
  e.covariance = e.systematic = Eigen::MatrixXd::Zero(size, size);
  e.prior_sigma = Eigen::VectorXd::Ones(size);
  e.value.head<kStateSize>() = Difference(c, reference);
  e.covariance.topLeftCorner<kStateSize, kStateSize>() = c.covariance;
  if (c.total_covariance) {
    e.systematic.topLeftCorner<kStateSize, kStateSize>() = *c.total_covariance - c.covariance;
  }
  e.prior_value.head<kStateSize>() = Difference(report.prior.mean, reference);
  e.prior_sigma.head<kStateSize>() = report.prior.sigma;
  e.determined.assign(c.determined.begin(), c.determined.end());
  Eigen::Index at = kStateSize;
  for (const EffectSet::Item& item : effects) {
    const EffectSet::Item& own = *FindItem(c, item);
    const Eigen::Index n = own.effect->size();
    e.value.segment(at, n) = c.effect_values.segment(own.first, n);
    e.covariance.block(at, at, n, n) = c.effect_covariance.block(own.first, own.first, n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      e.prior_sigma[at + k] = c.effects->parameter(own.first + static_cast<int>(k)).spread;
      // Half of what was believed before, or less.
      e.determined.push_back(std::sqrt(e.covariance(at + k, at + k)) < 0.5 * e.prior_sigma[at + k]);
    }
    at += n;
  }
  return e;
}

// Of what was counted in the recordings.
FitQuality QualityOf(const std::vector<const CalibrationReport*>& reports) {
  FitQuality quality;
  double noise_sq = 0.0, rms_sq = 0.0, inliers = 0.0;
  for (const CalibrationReport* report : reports) {
    quality.pairs += report->quality.pairs;
    quality.matches += report->quality.matches;
    noise_sq += report->quality.noise_px * report->quality.noise_px;
    rms_sq += report->quality.rms_px * report->quality.rms_px;
    inliers += report->quality.inlier_ratio;
  }
  const auto n = static_cast<double>(reports.size());
  quality.noise_px = std::sqrt(noise_sq / n);
  quality.rms_px = std::sqrt(rms_sq / n);
  quality.inlier_ratio = inliers / n;
  return quality;
}

void FillShares(const std::vector<const CalibrationReport*>& reports, DeviceReport* device) {
  const CombinedEstimate& combined = device->combined;
  std::vector<EffectShare>& shares = device->report.systematic;
  for (size_t r = 0; r < reports.size(); ++r) {
    for (const EffectShare& own : reports[r]->systematic) {
      auto share = std::find_if(shares.begin(), shares.end(),
                                [&](const EffectShare& s) { return s.effect == own.effect; });
      if (share == shares.end()) share = shares.insert(share, {own.effect, StateVector::Zero()});
      share->sigma += combined.weights[r] * own.sigma;
    }
  }
  const StateVector between =
      combined.between.diagonal().head<kStateSize>().cwiseMax(0.0).cwiseSqrt();
  shares.push_back({"between_recordings", between});
}

// The device's calibration from the combined numbers, which are counted from `reference`.
Calibration CalibrationOf(const CombinedEstimate& combined, const Calibration& reference,
                          const std::vector<EffectSet::Item>& effects, bool has_total) {
  Calibration c = Moved(reference, combined.value.head<kStateSize>());
  c.covariance = combined.covariance.topLeftCorner<kStateSize, kStateSize>();
  c.total_covariance.reset();
  if (has_total) {
    c.total_covariance = StateCovariance(combined.total().topLeftCorner<kStateSize, kStateSize>());
  }
  for (size_t i = 0; i < kStateSize; ++i)
    c.determined[i] = combined.repeatability[i].recordings > 0;
  const Eigen::Index n = combined.value.size() - kStateSize;
  auto set = std::make_shared<EffectSet>();
  for (const EffectSet::Item& item : effects) set->Add(item);
  c.effects = effects.empty() ? nullptr : set;
  c.effect_values = combined.value.tail(n);
  // With the recordings' spread: a fitted effect has no second sigma of its own.
  c.effect_covariance = combined.total().bottomRightCorner(n, n);
  return c;
}

void EmitRepeatability(YAML::Emitter& out, const DeviceReport& device, size_t i) {
  const Repeatability& repeats = device.combined.repeatability[i];
  out << YAML::Flow << YAML::BeginMap << YAML::Key << "name" << YAML::Value << device.parameters[i]
      << YAML::Key << "shared" << YAML::Value << static_cast<bool>(device.shared[i]) << YAML::Key
      << "recordings" << YAML::Value << repeats.recordings << YAML::Key << "between" << YAML::Value
      << repeats.between << YAML::Key << "chi2" << YAML::Value << repeats.chi2 << YAML::Key
      << "p_value" << YAML::Value << repeats.p_value;
  if (i < kStateSize) {
    std::vector<double> values, sigmas;
    for (const Calibration& c : device.each) {
      const auto k = static_cast<Eigen::Index>(i);
      values.push_back(ValuesOf(c, device.report.calibration.q_gyro_cam)[k]);
      sigmas.push_back(c.sigma()[k]);
    }
    out << YAML::Key << "values" << YAML::Value << values << YAML::Key << "sigmas" << YAML::Value
        << sigmas;
  }
  out << YAML::EndMap;
}

}  // namespace

bool IsEffectOfDevice(const std::string& name) {
  return std::any_of(kOfDevice.begin(), kOfDevice.end(),
                     [&](const char* known) { return name == known; });
}

Result<DeviceReport> CombineToDevice(const std::vector<std::string>& names,
                                     const std::vector<const CalibrationReport*>& reports,
                                     bool attitudes) {
  if (Status one = CheckOneCamera(names, reports); !one) return tl::unexpected(one.error());
  DeviceReport device;
  device.attitudes = attitudes;
  device.recordings = names;
  device.parameters.assign(StateNames().begin(), StateNames().end());
  device.shared.assign(kStateSize, true);
  for (int i = kStateDelay; i < kStateRotation; ++i) device.shared[static_cast<size_t>(i)] = false;
  const std::vector<EffectSet::Item> effects = CommonEffects(reports);
  for (const EffectSet::Item& item : effects) {
    for (const EffectParameter& p : item.effect->parameters()) {
      device.parameters.push_back(item.entry->name + " " + p.name);
      device.shared.push_back(true);
    }
  }
  const Calibration& reference = reports.front()->calibration;
  const auto size = static_cast<Eigen::Index>(device.shared.size());
  std::vector<RecordingEstimate> estimates;
  bool has_total = true;
  for (const CalibrationReport* report : reports) {
    device.each.push_back(report->calibration);
    estimates.push_back(EstimateOf(*report, reference, effects, size));
    has_total = has_total && report->calibration.total_covariance;
  }
  device.combined = Combine(estimates, device.shared);
  device.report.calibration = CalibrationOf(device.combined, reference, effects, has_total);
  device.report.prior = reports.front()->prior;
  device.report.quality = QualityOf(reports);
  device.report.converged = true;
  device.report.device_class = reports.front()->device_class;
  if (has_total) FillShares(reports, &device);
  return device;
}

std::string DeviceYaml(const DeviceReport& device) {
  YAML::Emitter out;
  out.SetDoublePrecision(10);
  const CombinedEstimate& combined = device.combined;
  out << YAML::BeginMap << YAML::Key << "recordings" << YAML::Value << YAML::BeginMap << YAML::Key
      << "names" << YAML::Value << YAML::Flow << device.recordings << YAML::Key << "agreement"
      << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "chi2" << YAML::Value
      << combined.agreement.chi2 << YAML::Key << "dof" << YAML::Value << combined.agreement.dof
      << YAML::Key << "p_value" << YAML::Value << combined.agreement.p_value << YAML::EndMap
      << YAML::Key << "parameters" << YAML::Value << YAML::BeginSeq;
  for (size_t i = 0; i < device.parameters.size(); ++i) EmitRepeatability(out, device, i);
  out << YAML::EndSeq << YAML::Key << "odd" << YAML::Value << YAML::BeginSeq;
  for (const OddRecording& odd : combined.odd) {
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "recording" << YAML::Value
        << device.recordings[odd.recording] << YAML::Key << "parameter" << YAML::Value
        << device.parameters[static_cast<size_t>(odd.parameter)] << YAML::Key << "sigmas"
        << YAML::Value << odd.sigmas << YAML::Key << "p_value" << YAML::Value << odd.p_value
        << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap << YAML::EndMap;
  return CalibrationYaml(device.report, device.attitudes) + out.c_str() + "\n";
}

}  // namespace camgyro
