// Rows of a table as gyro and accelerometer samples.
#ifndef CAMGYRO_FRONTEND_READERS_SAMPLE_ROWS_H_
#define CAMGYRO_FRONTEND_READERS_SAMPLE_ROWS_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/readers/csv_reader.h"
#include "frontend/readers/frame_order.h"

namespace camgyro {

// Where a table keeps its samples, and what turns them into ns, rad/s and m/s^2.
struct SampleColumns {
  size_t time = 0;
  double time_unit_s = 1e-9;
  int64_t time_offset_ns = 0;  // is added
  std::array<size_t, 3> gyro = {};
  Eigen::Matrix3d gyro_map = Eigen::Matrix3d::Identity();
  std::optional<std::array<size_t, 3>> accel;
  Eigen::Matrix3d accel_map = Eigen::Matrix3d::Identity();
};

constexpr double kStandardGravity = 9.80665;  // m/s^2, of accelerations in g

// The columns of these names; errors as CsvReader::Column.
std::array<size_t, 3> VectorColumns(const std::array<const char*, 3>& names, CsvReader* csv);

// Reads all rows into gyro, and accel where the table has it, with the checks of GyroCollector.
Status ReadGyroRows(const std::string& file, const SampleColumns& columns, CsvReader* csv,
                    Recording* recording);

// The unit quaternion of the current row; fails in `csv` if its norm is off 1 by more than 0.001.
Eigen::Quaterniond ReadQuaternion(size_t w, const std::array<size_t, 3>& xyz, CsvReader* csv);

// Appends a frame of the current row.
void AddFrame(int64_t stamp_ns, const CsvReader& csv, FrameOrder* order, Recording* recording);

// Reads all rows of a table that has accelerations only, in columns.accel; MendAccel on them.
Status ReadAccelRows(const std::string& file, const SampleColumns& columns, CsvReader* csv,
                     Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_SAMPLE_ROWS_H_
