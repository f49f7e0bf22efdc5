#include "tools/export/config_text.h"

#include <glog/logging.h>

#include "core/format.h"

namespace camgyro {

std::string FillIn(const std::string& text, const std::map<std::string, std::string>& values) {
  std::string filled;
  size_t begin = 0;
  for (size_t at; (at = text.find('@', begin)) != std::string::npos;) {
    const size_t end = text.find('@', at + 1);
    CHECK_NE(end, std::string::npos) << "a lone @";
    const auto value = values.find(text.substr(at + 1, end - at - 1));
    CHECK(value != values.end()) << text.substr(at, end + 1 - at) << " is unknown";
    filled += text.substr(begin, at - begin) + value->second;
    begin = end + 1;
  }
  return filled + text.substr(begin);
}

std::map<std::string, std::string> CommonValues(const ExportInput& input) {
  const Calibration& c = input.calibration;
  const LensParameters& lens = c.lens;
  const double fx = lens[kFocal] * lens[kAspect], fy = lens[kFocal];
  const bool wide = c.distortion_model == DistortionModel::kKannalaBrandt;
  const Eigen::Vector4d k = lens.segment<4>(FirstCoefficient(c.distortion_model));
  std::map<std::string, std::string> values = {
      {"source", input.source},
      {"width", std::to_string(c.width_px)},
      {"height", std::to_string(c.height_px)},
      {"fx", Number(fx)},
      {"fy", Number(fy)},
      {"cx", Number(lens[kCx])},
      {"cy", Number(lens[kCy])},
      {"intrinsics", List({fx, fy, lens[kCx], lens[kCy]})},
      {"distortion", List({k[0], k[1], k[2], k[3]})},
      {"k1", Number(k[0])},
      {"k2", Number(k[1])},
      {"k3", Number(k[2])},
      {"k4", Number(k[3])},
      {"distortion_model", wide ? "equidistant" : "radtan"},
      {"distortion_names", wide ? "k1, k2, k3, k4" : "k1, k2, p1, p2"},
      {"line_delay", Number(c.readout_s / c.height_px)},
      {"readout", Number(c.readout_s)},
      {"delay", Number(c.delay_s)},
      {"middle_delay", Number(MiddleRowDelayS(c))},
  };
  const auto add = [&](const std::string& name, std::optional<double> recorded, double typical) {
    values[name] = Number(recorded.value_or(typical));
    values[name + "_origin"] = recorded ? "from the recording" : "TYPICAL VALUE, not measured";
  };
  GyroInfo gyro;
  std::optional<double> rate_hz;
  if (input.recording) {
    gyro = input.recording->gyro_info;
    rate_hz = 1.0 / MedianInterval(input.recording->gyro);
  }
  add("gyro_noise", gyro.noise_density_rad_s_rtHz, 2e-4);
  add("gyro_walk", gyro.random_walk_rad_s2_rtHz, 2e-5);
  add("accel_noise", std::nullopt, 2e-3);
  add("accel_walk", std::nullopt, 3e-3);
  add("imu_rate", rate_hz, 200.0);
  return values;
}

std::string Number(double value) { return Format("%.10g", value == 0.0 ? 0.0 : value); }

std::string List(const std::vector<double>& values) {
  std::string text = "[";
  for (const double value : values) text += (text.size() > 1 ? ", " : "") + Number(value);
  return text + "]";
}

std::string Rows(const Eigen::MatrixXd& matrix, const std::string& before) {
  std::string text;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const Eigen::VectorXd row = matrix.row(i);
    text += before + List({row.data(), row.data() + row.size()}) + "\n";
  }
  return text;
}

std::string RowMajor(const Eigen::MatrixXd& matrix) {
  const Eigen::MatrixXd transposed = matrix.transpose();  // Eigen stores columns
  return List({transposed.data(), transposed.data() + transposed.size()});
}

Eigen::Matrix4d Pose(const Eigen::Quaterniond& q) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = q.toRotationMatrix();
  return T;
}

}  // namespace camgyro
