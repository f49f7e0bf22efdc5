#include "tools/read_calibration.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <optional>
#include <vector>

namespace camgyro {
namespace {

// Numbers of `section: key: value:`, which must be `count` of them.
std::vector<double> Values(const YAML::Node& root, const char* section, const char* key,
                           size_t count) {
  const YAML::Node node = root[section][key]["value"];
  const auto values =
      count == 1 ? std::vector<double>{node.as<double>()} : node.as<std::vector<double>>();
  for (const double value : values) {
    if (!std::isfinite(value)) throw YAML::Exception(node.Mark(), "not a number");
  }
  if (values.size() != count) throw YAML::Exception(node.Mark(), "wrong number of values");
  return values;
}

Calibration Parse(const YAML::Node& root) {
  Calibration c;
  const auto resolution = root["camera"]["resolution"].as<std::vector<int>>();
  c.width_px = resolution.at(0);
  c.height_px = resolution.at(1);
  const auto principal = Values(root, "camera", "principal_px", 2);
  c.lens = MakePinhole(Values(root, "camera", "focal_px", 1)[0], {principal[0], principal[1]},
                       Values(root, "camera", "aspect_ratio", 1)[0]);
  const YAML::Node distortion = root["camera"]["distortion"];
  if (distortion["model"].as<std::string>() == DistortionModelName(DistortionModel::kRadTan)) {
    c.distortion_model = DistortionModel::kRadTan;
    const auto k = Values(root, "camera", "distortion", 4);
    for (int i = 0; i < 4; ++i) c.lens[kK1 + i] = k[static_cast<size_t>(i)];
  } else if (distortion["model"].as<std::string>() != DistortionModelName(DistortionModel::kNone)) {
    throw YAML::Exception(distortion.Mark(), "unknown distortion model");
  }
  c.readout_s = Values(root, "shutter", "readout_s", 1)[0];
  c.delay_s = Values(root, "clock", "delay_s", 1)[0];
  const auto bias = Values(root, "gyro", "bias_rad_s", 3);
  c.bias_gyro_rad_s = {bias[0], bias[1], bias[2]};
  const auto q = Values(root, "extrinsics", "q_gyro_cam_wxyz", 4);
  c.q_gyro_cam = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  return c;
}

}  // namespace

Result<Calibration> ReadCalibration(const std::string& file) {
  try {
    return Parse(YAML::LoadFile(file));
  } catch (const std::exception& error) {  // yaml-cpp's, and a resolution that is too short
    return BadInput(file + ": expected a calibration.yaml of camgyro with a lens: " + error.what());
  }
}

}  // namespace camgyro
