// What the exported configuration files share. They are text with places to fill in, because the
// conventions belong into comments.
#ifndef CAMGYRO_TOOLS_EXPORT_CONFIG_TEXT_H_
#define CAMGYRO_TOOLS_EXPORT_CONFIG_TEXT_H_

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "tools/export/export.h"

namespace camgyro {

// Replaces every `@name@` by its value. CHECKs that every name is known: templates are ours.
std::string FillIn(const std::string& text, const std::map<std::string, std::string>& values);

// The values that most files need:
//   source, width, height, fx, fy, cx, cy, k1, k2, p1, p2, line_delay, readout, delay,
//   middle_delay, intrinsics [fx, fy, cx, cy], distortion [k1, k2, p1, p2] (zeros without
//   distortion), gyro_noise, gyro_walk, accel_noise, accel_walk, imu_rate: numbers, and each with
//   `_origin` behind its name: whether the recording declares it or it is typical of a phone's MEMS
//   sensor.
// Units are SI and pixels; pixel (0, 0) is the centre of the top-left pixel.
std::map<std::string, std::string> CommonValues(const ExportInput& input);

// Ten significant digits; never "-0".
std::string Number(double value);
// "[1, 2, 3]".
std::string List(const std::vector<double>& values);
// One list per row, each behind `before` and followed by a new line.
std::string Rows(const Eigen::MatrixXd& matrix, const std::string& before);
// All elements row by row.
std::string RowMajor(const Eigen::MatrixXd& matrix);

// Rotation from q beside a zero translation, which camgyro does not estimate.
Eigen::Matrix4d Pose(const Eigen::Quaterniond& q);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_EXPORT_CONFIG_TEXT_H_
