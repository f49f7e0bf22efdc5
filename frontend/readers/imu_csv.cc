#include "frontend/readers/imu_csv.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "frontend/readers/csv_reader.h"
#include "frontend/readers/sample_rows.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr double kRadPerDeg = M_PI / 180.0;

// How many of the three rate columns have a unit of degrees in the header.
int CountDegreeColumns(const std::vector<std::string>& header) {
  int count = 0;
  for (size_t i = 1; i < std::min<size_t>(header.size(), 4); ++i) {
    if (header[i].find("deg") != std::string::npos || header[i].find("dps") != std::string::npos) {
      ++count;
    }
  }
  return count;
}

}  // namespace

Status ReadImuCsv(const std::string& file, Recording* recording) {
  CsvReader csv(file,
                {"timestamp [ns]", "w_x [rad s^-1]", "w_y [rad s^-1]", "w_z [rad s^-1]",
                 "a_x [m s^-2]", "a_y [m s^-2]", "a_z [m s^-2]"},
                {4, 7});
  const int degree_columns = CountDegreeColumns(csv.header());
  if (degree_columns != 0 && degree_columns != 3) {
    return BadInput(Concat(file, ":1: the header gives degrees for ", degree_columns,
                           " of the three rates, expected one unit for all"));
  }
  const double unit_rad = degree_columns == 3 ? kRadPerDeg : 1.0;

  SampleColumns columns;
  columns.gyro = {1, 2, 3};
  columns.gyro_map *= unit_rad;
  if (csv.NextWidth() == 7) columns.accel = {4, 5, 6};
  if (Status rows = ReadGyroRows(file, columns, &csv, recording); !rows) return rows;
  if (degree_columns == 3) {
    recording->notes.push_back(Concat(file, ": rates converted from deg/s to rad/s"));
  }
  return {};
}

}  // namespace camgyro
