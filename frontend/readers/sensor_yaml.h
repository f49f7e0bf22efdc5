// EuRoC `sensor.yaml` of a camera and of an IMU: what the files declare, as an initial guess.
#ifndef CAMGYRO_FRONTEND_READERS_SENSOR_YAML_H_
#define CAMGYRO_FRONTEND_READERS_SENSOR_YAML_H_

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

struct SensorYaml {
  CameraGuess camera;  // of a camera; q_gyro_cam stays empty (see q_body_sensor)
  GyroInfo gyro;       // of an IMU
  std::optional<double> rate_hz;
  std::optional<Eigen::Quaterniond> q_body_sensor;  // rotation of T_BS: sensor -> body
};

// Reads the keys of docs/recording_format.md; unknown keys are ignored, and every key is optional.
// A missing file is an empty result. OpenCV's first line `%YAML:1.0` is accepted. A malformed
// value is a BadInput that names the file, the line and the key.
Result<SensorYaml> ReadSensorYaml(const std::string& file);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_SENSOR_YAML_H_
