// calibration.json: everything that calibration.yaml says of the parameters, in plain JSON.
#include <nlohmann/json.hpp>

#include "tools/export/export.h"

namespace camgyro {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

std::vector<ExportedFile> ExportJson(const ExportInput& input) {
  const Calibration& c = input.calibration;
  const LensParameters& lens = c.lens;
  const StateVector sigma = c.sigma();
  const auto list = [](const auto& vector) {
    return Json(std::vector<double>(vector.data(), vector.data() + vector.size()));
  };
  Json undetermined = Json::array(), covariance = Json::array();
  for (size_t i = 0; i < kStateSize; ++i) {
    if (!c.determined[i]) undetermined.push_back(StateNames()[i]);
    covariance.push_back(list(StateVector(c.covariance.col(static_cast<Eigen::Index>(i)))));
  }
  Json json;
  json["made_by"] = "camgyro export";
  json["source"] = input.source;
  json["conventions"] = {
      {"time", "t_gyro = t_camera + delay_s + readout_s * v / height for row v of the picture"},
      {"rotation", "w_gyro = R(q_gyro_cam) w_camera; camera frame x right, y down, z forward"},
      {"bias", "w_measured = w_true + bias_rad_s + noise"},
      {"focal", "focal_px = [fx, fy]; aspect ratio fx / fy; pixel (0, 0) is a centre"},
      {"sigma",
       "one standard deviation, of noise; sigma_total: with what effects that nobody has declared "
       "may "
       "add; of the rotation about the camera's axes [rad]"}};
  json["resolution"] = {c.width_px, c.height_px};
  json["focal_px"] = {lens[kFocal] * lens[kAspect], lens[kFocal]};
  json["principal_px"] = {lens[kCx], lens[kCy]};
  const bool wide = c.distortion_model == DistortionModel::kKannalaBrandt;
  json["distortion"] = {
      {"model", DistortionModelName(c.distortion_model)},
      {wide ? "k1_k2_k3_k4" : "k1_k2_p1_p2",
       list(Eigen::Vector4d(lens.segment<4>(FirstCoefficient(c.distortion_model))))}};
  json["readout_s"] = c.readout_s;
  json["delay_s"] = c.delay_s;
  json["delay_middle_row_s"] = MiddleRowDelayS(c);
  json["bias_rad_s"] = list(c.bias_gyro_rad_s);
  json["q_gyro_cam_wxyz"] = {c.q_gyro_cam.w(), c.q_gyro_cam.x(), c.q_gyro_cam.y(),
                             c.q_gyro_cam.z()};
  json["sigma"] = Json::object();
  for (size_t i = 0; i < kStateSize; ++i) {
    json["sigma"][StateNames()[i]] = sigma[static_cast<Eigen::Index>(i)];
  }
  if (const auto total = c.sigma_total()) {
    for (size_t i = 0; i < kStateSize; ++i) {
      json["sigma_total"][StateNames()[i]] = (*total)[static_cast<Eigen::Index>(i)];
    }
  }
  json["undetermined"] = undetermined;
  json["covariance"] = {{"order", StateNames()}, {"matrix", covariance}};
  return {{"calibration.json", json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"}};
}

}  // namespace camgyro
