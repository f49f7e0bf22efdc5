#include "pipeline/result_files.h"

#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <system_error>

#include "core/standard_distortion.h"
#include "core/time.h"
#include "estimator/doubts.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

constexpr int kDigits = 10;

using Values = std::vector<double>;

Values Segment(const StateVector& state, int first, int size) {
  return {state.data() + first, state.data() + first + size};
}

void EmitValue(YAML::Emitter& out, double value, double sigma) {
  out << YAML::Flow << YAML::BeginMap << YAML::Key << "value" << YAML::Value << value << YAML::Key
      << "sigma" << YAML::Value << sigma << YAML::EndMap;
}

// `size` parameters of the state from `first` on: their values with the sigma of noise and, where
// it is known, that of everything. unit: after "sigma" in the keys.
void EmitState(YAML::Emitter& out, const char* key, const Values& value, const Calibration& c,
               int first, int size, const std::string& unit = "") {
  const auto emit = [&](const std::string& name, const Values& values) {
    out << YAML::Key << name << YAML::Value;
    if (values.size() == 1) {
      out << values[0];
    } else {
      out << values;
    }
  };
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginMap;
  emit("value", value);
  emit("sigma" + unit, Segment(c.sigma(), first, size));
  if (const auto total = c.sigma_total()) {
    emit("sigma_total" + unit, Segment(*total, first, size));
  }
  out << YAML::EndMap;
}

// Standard deviations of the coordinates of the lens block that effects have changed; else zero.
using LensCovariance = Eigen::Matrix<double, kLensSize, kLensSize>;

LensCovariance FittedLensCovariance(const Calibration& c) {
  if (c.pair_effects().set == nullptr) return LensCovariance::Zero();
  Eigen::Matrix<double, kLensSize, Eigen::Dynamic> by_effects(kLensSize, c.effects->size());
  for (int i = 0; i < c.effects->size(); ++i) {
    by_effects.col(i) = c.effects->ConstantLens(LensParameters::Zero(),
                                                Eigen::VectorXd::Unit(c.effects->size(), i));
  }
  return by_effects * c.effect_covariance * by_effects.transpose();
}

void BeginSection(YAML::Emitter& out, const char* key) {
  out << YAML::Key << key << YAML::Value << YAML::BeginMap;
}

void EmitCamera(YAML::Emitter& out, const Calibration& c) {
  BeginSection(out, "camera");
  out << YAML::Key << "resolution" << YAML::Value << YAML::Flow
      << std::vector<int>{c.width_px, c.height_px};
  EmitState(out, "focal_px", {c.lens[kFocal]}, c, kStateFocal, 1);
  EmitState(out, "principal_px", {c.lens[kCx], c.lens[kCy]}, c, kStateCx, 2);
  // Distortion and aspect ratio with what effects have added to them.
  const LensParameters lens = c.FullLens();
  const LensCovariance covariance = FittedLensCovariance(c);
  out << YAML::Key << "aspect_ratio" << YAML::Value;
  EmitValue(out, lens[kAspect], std::sqrt(covariance(kAspect, kAspect)));
  const DistortionCoefficients distortion =
      StandardDistortion(c.distortion_model, lens, Eigen::Vector2d(c.width_px, c.height_px));
  Values coefficients, coefficients_sigma;
  if (distortion.model != DistortionModel::kNone) {
    const Eigen::Vector4d sigma_k =
        (distortion.by_lens * covariance * distortion.by_lens.transpose()).diagonal().cwiseSqrt();
    coefficients.assign(distortion.k.data(), distortion.k.data() + 4);
    coefficients_sigma.assign(sigma_k.data(), sigma_k.data() + 4);
  }
  out << YAML::Key << "distortion" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
      << "model" << YAML::Value << DistortionModelName(distortion.model) << YAML::Key << "value"
      << YAML::Value << coefficients << YAML::Key << "sigma" << YAML::Value << coefficients_sigma
      << YAML::EndMap << YAML::EndMap;
}

void EmitEffects(YAML::Emitter& out, const Calibration& c) {
  out << YAML::Key << "effects" << YAML::Value << YAML::BeginSeq;
  const size_t count = c.effects ? c.effects->items().size() : 0;
  for (size_t i = 0; i < count; ++i) {
    const EffectSet::Item& item = c.effects->items()[i];
    out << YAML::BeginMap << YAML::Key << "name" << YAML::Value << item.entry->name << YAML::Key
        << "shape" << YAML::Value << item.shape << YAML::Key << "parameters" << YAML::Value
        << YAML::BeginSeq;
    for (int k = 0; k < item.effect->size(); ++k) {
      const EffectParameter& p = item.effect->parameters()[static_cast<size_t>(k)];
      const int column = item.first + k;
      out << YAML::Flow << YAML::BeginMap << YAML::Key << "name" << YAML::Value << p.name
          << YAML::Key << "unit" << YAML::Value << p.unit << YAML::Key << "value" << YAML::Value
          << c.effect_values[column] << YAML::Key << "sigma" << YAML::Value
          << std::sqrt(c.effect_covariance(column, column)) << YAML::EndMap;
    }
    out << YAML::EndSeq << YAML::EndMap;
  }
  out << YAML::EndSeq;
}

void EmitMatrix(YAML::Emitter& out, const char* key, const StateCovariance& matrix) {
  out << YAML::Key << key << YAML::Value << YAML::BeginSeq;
  for (int i = 0; i < kStateSize; ++i) out << YAML::Flow << Segment(matrix.col(i), 0, kStateSize);
  out << YAML::EndSeq;
}

void EmitCovariance(YAML::Emitter& out, const Calibration& c) {
  BeginSection(out, "covariance");
  out << YAML::Key << "order" << YAML::Value << YAML::Flow
      << std::vector<std::string>(StateNames().begin(), StateNames().end());
  EmitMatrix(out, "matrix", c.covariance);
  if (c.total_covariance) EmitMatrix(out, "total", *c.total_covariance);
  out << YAML::EndMap;
}

void EmitSystematic(YAML::Emitter& out, const CalibrationReport& report) {
  if (!report.calibration.total_covariance) return;
  BeginSection(out, "systematic");
  out << YAML::Key << "device" << YAML::Value << report.device_class;
  out << YAML::Key << "effects" << YAML::Value << YAML::BeginSeq;
  for (const EffectShare& share : report.systematic) {
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "name" << YAML::Value << share.effect
        << YAML::Key << "sigma" << YAML::Value << Segment(share.sigma, 0, kStateSize)
        << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
}

// In the order of the covariance. The mean as its difference from the result, since the rotation's
// is a small angle then.
void EmitPrior(YAML::Emitter& out, const Prior& prior, const Calibration& c) {
  BeginSection(out, "prior");
  out << YAML::Key << "offset" << YAML::Value << YAML::Flow
      << Segment(Difference(prior.mean, c), 0, kStateSize) << YAML::Key << "sigma" << YAML::Value
      << YAML::Flow << Segment(prior.sigma, 0, kStateSize) << YAML::EndMap;
}

void EmitQuality(YAML::Emitter& out, const CalibrationReport& report, bool attitudes) {
  const FitQuality& quality = report.quality;
  BeginSection(out, "quality");
  out << YAML::Key << "pairs" << YAML::Value << quality.pairs;
  out << YAML::Key << "matches" << YAML::Value << quality.matches;
  out << YAML::Key << "inlier_ratio" << YAML::Value << quality.inlier_ratio;
  out << YAML::Key << (attitudes ? "noise_rad" : "noise_px") << YAML::Value << quality.noise_px;
  if (!attitudes) {
    out << YAML::Key << "noise_scatter" << YAML::Value << quality.noise_scatter;
    out << YAML::Key << "design_effect" << YAML::Value << quality.design_effect;
  }
  out << YAML::Key << (attitudes ? "rms_rad" : "rms_px") << YAML::Value << quality.rms_px;
  if (report.unseen) {
    out << YAML::Key << "unseen_rms_px" << YAML::Value << report.unseen->rms_px;
    out << YAML::Key << "unseen_ratio" << YAML::Value << UnseenRatio(report);
  }
  if (report.halves_chi2 > 0.0) {
    out << YAML::Key << "halves_chi2" << YAML::Value << report.halves_chi2;
  }
  if (report.noise_over_smooth > 0.0) {
    out << YAML::Key << "noise_over_smooth" << YAML::Value << report.noise_over_smooth;
  }
  std::vector<std::string> unobservable;
  for (size_t i = 0; i < kStateSize; ++i) {
    if (!report.calibration.determined[i]) unobservable.push_back(StateNames()[i]);
  }
  out << YAML::Key << "unobservable" << YAML::Value << YAML::Flow << unobservable << YAML::EndMap;
}

std::string TemporaryName(const fs::path& file) {
  return (file.parent_path() / ("." + file.filename().string() + ".tmp" + std::to_string(getpid())))
      .string();
}

// Columns of a trace row: the state's, with the quaternion in the place of the rotation.
Values TraceValues(const Calibration& c) {
  const Eigen::Quaterniond& q = c.q_gyro_cam;
  Values values = Segment(ValuesOf(c, q), 0, kStateRotation);
  values.insert(values.end(), {q.w(), q.x(), q.y(), q.z()});
  return values;
}

}  // namespace

Status FileSet::CheckWritable() const {
  std::error_code error;
  fs::path there = fs::absolute(folder_, error);
  while (!fs::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  if (!fs::is_directory(there, error) || access(there.c_str(), W_OK | X_OK) != 0) {
    return BadUsage("--out=" + folder_ + ": cannot write into " + there.string());
  }
  return {};
}

Status FileSet::Write() const {
  std::error_code error;
  std::vector<std::pair<std::string, fs::path>> written;
  const auto give_up = [&](const std::string& file, const std::string& why) -> Status {
    for (const auto& [temporary, name] : written) fs::remove(temporary, error);
    return BadUsage("--out: cannot write " + file + ": " + why);
  };
  for (const auto& [name, write] : files_) {
    const fs::path file = fs::path(folder_) / name;
    fs::create_directories(file.parent_path(), error);
    if (error) return give_up(file.string(), error.message());
    written.emplace_back(TemporaryName(file), file);
    std::ofstream stream(written.back().first, std::ios::binary);
    write(&stream);
    stream.close();
    if (!stream) return give_up(file.string(), "the disk is full, or not writable");
  }
  for (const auto& [temporary, file] : written) {
    fs::rename(temporary, file, error);
    if (error) return give_up(file.string(), error.message());
  }
  return {};
}

std::string CalibrationYaml(const CalibrationReport& report, bool attitudes) {
  Calibration c = report.calibration;
  if (attitudes) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    c.lens.setConstant(nan);
    c.readout_s = nan;
    c.covariance.topRows<kStateDelay>().setConstant(nan);
    c.covariance.leftCols<kStateDelay>().setConstant(nan);
    if (c.total_covariance) {
      c.total_covariance->topRows<kStateDelay>().setConstant(nan);
      c.total_covariance->leftCols<kStateDelay>().setConstant(nan);
    }
  }
  YAML::Emitter out;
  out.SetDoublePrecision(kDigits);
  out << YAML::BeginMap;
  EmitCamera(out, c);
  BeginSection(out, "shutter");
  EmitState(out, "readout_s", {c.readout_s}, c, kStateReadout, 1);
  out << YAML::EndMap;
  BeginSection(out, "clock");
  EmitState(out, "delay_s", {c.delay_s}, c, kStateDelay, 1);
  out << YAML::EndMap;
  BeginSection(out, "gyro");
  const Eigen::Vector3d& b = c.bias_gyro_rad_s;
  EmitState(out, "bias_rad_s", {b.x(), b.y(), b.z()}, c, kStateBias, 3);
  out << YAML::EndMap;
  BeginSection(out, "extrinsics");
  const Eigen::Quaterniond& q = c.q_gyro_cam;
  EmitState(out, "q_gyro_cam_wxyz", {q.w(), q.x(), q.y(), q.z()}, c, kStateRotation, 3, "_rad");
  out << YAML::EndMap;
  EmitEffects(out, c);
  EmitCovariance(out, c);
  EmitPrior(out, report.prior, c);
  EmitSystematic(out, report);
  EmitQuality(out, report, attitudes);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string TraceCsv(const std::vector<WindowUpdate>& trace) {
  std::ostringstream out;
  out.precision(kDigits);
  out << "#timestamp_ns";
  for (size_t i = 0; i < kStateRotation; ++i) out << "," << StateNames()[i];
  out << ",q_w,q_x,q_y,q_z";
  for (const std::string& name : StateNames()) out << ",sigma_" << name;
  out << "\n";
  for (const WindowUpdate& update : trace) {
    out << update.frame_stamp_ns;
    for (const double value : TraceValues(update.estimate)) out << "," << value;
    for (const double value : Segment(update.estimate.sigma(), 0, kStateSize)) out << "," << value;
    out << "\n";
  }
  return out.str();
}

std::string FrameTimesCsv(const Recording& recording, const std::vector<FrameOffset>& frame_times) {
  std::ostringstream out;
  out << "#stamp_ns,repaired_stamp_ns,sigma_ns\n";
  for (const FrameOffset& frame : frame_times) {
    const int64_t stamp_ns = recording.gyro.front().stamp_ns + frame.frame;
    out << stamp_ns << "," << StampAt(stamp_ns, frame.offset_s) << ","
        << std::llround(1e9 * frame.sigma_s) << "\n";
  }
  return out.str();
}

std::string DelayCsv(const std::vector<DelayResidual>& curve) {
  std::ostringstream out;
  out.precision(kDigits);
  out << "#delay_s,unexplained\n";
  for (const DelayResidual& point : curve) out << point.delay_s << "," << point.residual << "\n";
  return out.str();
}

}  // namespace camgyro
