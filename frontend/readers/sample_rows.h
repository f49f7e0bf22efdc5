// Rows of a table as gyro and accelerometer samples.
#ifndef CAMGYRO_FRONTEND_READERS_SAMPLE_ROWS_H_
#define CAMGYRO_FRONTEND_READERS_SAMPLE_ROWS_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/readers/csv_reader.h"

namespace camgyro {

// Where a table keeps its samples, and what turns them into ns, rad/s and m/s^2.
struct SampleColumns {
  size_t time = 0;
  double time_unit_s = 1e-9;
  std::array<size_t, 3> gyro = {};
  Eigen::Matrix3d gyro_map = Eigen::Matrix3d::Identity();
  std::optional<std::array<size_t, 3>> accel;
  Eigen::Matrix3d accel_map = Eigen::Matrix3d::Identity();
};

// The columns of these names; errors as CsvReader::Column.
std::array<size_t, 3> VectorColumns(const std::array<const char*, 3>& names, CsvReader* csv);

// Reads all rows into gyro, and accel where the table has it, with the checks of GyroCollector.
Status ReadGyroRows(const std::string& file, const SampleColumns& columns, CsvReader* csv,
                    Recording* recording);

// Reads all rows of a table that has accelerations only, in columns.accel.
Status ReadAccelRows(const SampleColumns& columns, CsvReader* csv, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_SAMPLE_ROWS_H_
