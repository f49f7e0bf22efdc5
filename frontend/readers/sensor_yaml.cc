#include "frontend/readers/sensor_yaml.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <vector>

#include "frontend/readers/text.h"
#include "frontend/readers/whole_file.h"
#include "frontend/readers/yaml_keys.h"

namespace camgyro {
namespace {

void ReadResolution(YamlKeys* keys, CameraGuess* camera) {
  const char* expected = "[width, height], two whole numbers of pixels above zero";
  const auto size = keys->Numbers("resolution", expected);
  if (!size) return;
  const auto whole = [](double v) { return v >= 1.0 && v <= 65536.0 && v == std::floor(v); };
  if (size->size() != 2 || !whole((*size)[0]) || !whole((*size)[1])) {
    keys->Fail("resolution", Concat("expected ", expected));
    return;
  }
  camera->width_px = static_cast<int>((*size)[0]);
  camera->height_px = static_cast<int>((*size)[1]);
}

void ReadIntrinsics(YamlKeys* keys, CameraGuess* camera) {
  const auto model = keys->Text("camera_model");
  if (model && *model != "pinhole") {
    keys->Fail("camera_model", Concat("'", *model, "' is not supported, expected pinhole"));
  }
  const char* expected = "[fu, fv, cu, cv], four numbers [px] with fu and fv above zero";
  const auto values = keys->Numbers("intrinsics", expected);
  if (!values) return;
  if (values->size() != 4 || (*values)[0] <= 0.0 || (*values)[1] <= 0.0) {
    keys->Fail("intrinsics", Concat("expected ", expected));
    return;
  }
  camera->focal_px = (*values)[1];
  camera->aspect_ratio = (*values)[0] / (*values)[1];
  camera->principal_px = Eigen::Vector2d((*values)[2], (*values)[3]);
}

void ReadDistortion(YamlKeys* keys, CameraGuess* camera) {
  const std::string model = keys->Text("distortion_model").value_or("");
  const auto values = keys->Numbers("distortion_coefficients", "a list of numbers");
  if (model.empty() || model == "none") {
    if (values && !values->empty()) {
      keys->Fail("distortion_coefficients",
                 "are given, but distortion_model is missing or none; expected it to be "
                 "radial-tangential (k1, k2, p1, p2) or equidistant (k1, k2, k3, k4)");
    }
    return;
  }
  if (model == "equidistant" || model == "kannala_brandt" || model == "kb4" || model == "fisheye") {
    if (!values || values->size() != 4) {
      keys->Fail(values ? "distortion_coefficients" : "distortion_model",
                 "expected distortion_coefficients: [k1, k2, k3, k4] of Kannala & Brandt");
      return;
    }
    camera->distortion_model = DistortionModel::kKannalaBrandt;
    camera->distortion = *values;
    return;
  }
  if (model != "radial-tangential" && model != "radtan" && model != "plumb_bob") {
    keys->Fail("distortion_model", Concat("'", model,
                                          "' is not supported, expected none, radial-tangential "
                                          "(= radtan = plumb_bob: k1, k2, p1, p2), or equidistant "
                                          "(= kannala_brandt = kb4 = fisheye: k1, k2, k3, k4)"));
    return;
  }
  // plumb_bob has k3 behind the four; ours has not.
  if (!values || values->size() < 4 || values->size() > 5 ||
      (values->size() == 5 && values->back() != 0.0)) {
    keys->Fail(values ? "distortion_coefficients" : "distortion_model",
               "expected distortion_coefficients: [k1, k2, p1, p2] (a fifth, k3, must be zero)");
    return;
  }
  camera->distortion_model = DistortionModel::kRadTan;
  camera->distortion.assign(values->begin(), values->begin() + 4);
}

std::optional<Eigen::Quaterniond> ReadRotation(YamlKeys* keys) {
  const char* expected = "a map with `data`, the 16 numbers of a 4x4 matrix, row by row";
  const auto values = keys->Numbers("T_BS", expected);
  if (!values) return std::nullopt;
  if (values->size() != 16) {
    keys->Fail("T_BS", Concat(values->size(), " numbers were found, expected ", expected));
    return std::nullopt;
  }
  const Eigen::Matrix3d R =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values->data())
          .topLeftCorner<3, 3>();
  // Files print six digits or more; an entry that is off by 1e-3 was mistyped.
  if (!(R.transpose() * R).isIdentity(1e-3) || R.determinant() < 0.0) {
    keys->Fail("T_BS",
               "its upper left 3x3 block is not a rotation, expected an orthonormal, right-handed "
               "one (sensor -> body)");
    return std::nullopt;
  }
  return Eigen::Quaterniond(R).normalized();
}

}  // namespace

Result<SensorYaml> ReadSensorYaml(const std::string& file) {
  SensorYaml result;
  if (!std::filesystem::exists(file)) return result;
  Result<std::string> content = ReadWholeFile(file);
  if (!content) return tl::unexpected(content.error());
  std::string& text = *content;
  // OpenCV writes "%YAML:1.0", which is not YAML; a comment in its place keeps the line numbers.
  if (text.compare(0, 6, "%YAML:") == 0) text[0] = '#';

  try {
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull()) return result;
    if (!root.IsMap()) return BadInput(Concat(file, ":1: expected lines of `key: value`"));
    YamlKeys keys(file, root);
    ReadResolution(&keys, &result.camera);
    ReadIntrinsics(&keys, &result.camera);
    ReadDistortion(&keys, &result.camera);
    result.q_body_sensor = ReadRotation(&keys);
    result.camera.readout_s = keys.Number("readout_time");
    result.camera.delay_s = keys.Number("timeshift_cam_imu");
    if (result.camera.readout_s && std::abs(*result.camera.readout_s) > 1.0) {
      keys.Fail("readout_time", Concat(*result.camera.readout_s,
                                       " s was found, expected seconds per picture, e.g. 0.025"));
    }
    result.rate_hz = keys.PositiveNumber("rate_hz");
    result.gyro.noise_density_rad_s_rtHz = keys.PositiveNumber("gyroscope_noise_density");
    result.gyro.random_walk_rad_s2_rtHz = keys.PositiveNumber("gyroscope_random_walk");
    if (!keys.status()) return tl::unexpected(keys.status().error());
  } catch (const YAML::Exception& error) {
    return BadInput(Concat(file, ":", error.mark.line + 1, ": not valid YAML: ", error.msg));
  }
  return result;
}

}  // namespace camgyro
