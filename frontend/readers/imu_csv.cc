#include "frontend/readers/imu_csv.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "frontend/readers/csv_reader.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

constexpr double kRadPerDeg = M_PI / 180.0;
constexpr double kGyroFullScaleRadS = 2000.0 * kRadPerDeg;  // of most MEMS gyros, their maximum
constexpr double kFastestGyroHz = 100e3;

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

Status CheckRateUnit(const std::string& file, const std::vector<GyroSample>& gyro) {
  std::vector<double> rates;
  rates.reserve(gyro.size());
  for (const GyroSample& sample : gyro) rates.push_back(sample.omega_gyro_rad_s.norm());
  const auto high = rates.begin() + static_cast<std::ptrdiff_t>(0.99 * (rates.size() - 1));
  std::nth_element(rates.begin(), high, rates.end());
  if (*high <= kGyroFullScaleRadS) return {};
  return BadInput(Concat(file, ": angular rates reach ", *high,
                         ", and in rad/s most gyros end at 35: looks like deg/s; the columns must "
                         "be rad/s; put [deg s^-1] in the header to have them converted"));
}

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

  std::vector<GyroSample>& gyro = recording->gyro;
  int repeated_rows = 0;
  while (csv.NextRow()) {
    GyroSample sample;
    sample.stamp_ns = csv.Stamp(0);
    sample.omega_gyro_rad_s =
        unit_rad * Eigen::Vector3d(csv.Number(1), csv.Number(2), csv.Number(3));
    AccelSample accel;
    accel.stamp_ns = sample.stamp_ns;
    if (csv.width() == 7) {
      accel.accel_gyro_m_s2 = Eigen::Vector3d(csv.Number(4), csv.Number(5), csv.Number(6));
    }
    if (!csv.status()) break;

    if (!gyro.empty() && sample.stamp_ns <= gyro.back().stamp_ns) {
      const bool same = sample.stamp_ns == gyro.back().stamp_ns;
      if (same && sample.omega_gyro_rad_s == gyro.back().omega_gyro_rad_s &&
          (csv.width() < 7 || accel.accel_gyro_m_s2 == recording->accel.back().accel_gyro_m_s2)) {
        ++repeated_rows;
        continue;
      }
      csv.Fail(Concat("timestamp ", sample.stamp_ns,
                      same ? " repeats with other values, after " : " goes back, after ",
                      gyro.back().stamp_ns, "; expected strictly increasing stamps"));
      break;
    }
    gyro.push_back(sample);
    if (csv.width() == 7) recording->accel.push_back(accel);
  }
  if (!csv.status()) return csv.status();
  if (gyro.size() < 2) {
    return BadInput(Concat(file, ": has ", gyro.size(), " samples, expected at least two"));
  }
  if (MedianInterval(gyro) * kFastestGyroHz < 1.0) {
    return BadInput(Concat(file, ": the median interval of its stamps is ",
                           MedianInterval(gyro) * 1e9,
                           " ns, too short for any gyro; expected stamps in nanoseconds"));
  }
  if (Status unit = CheckRateUnit(file, gyro); !unit) return unit;

  if (degree_columns == 3) {
    recording->notes.push_back(Concat(file, ": rates converted from deg/s to rad/s"));
  }
  if (repeated_rows > 0) {
    recording->notes.push_back(
        Concat(file, ": ", repeated_rows, " rows that repeat the one before were dropped"));
  }
  return {};
}

}  // namespace camgyro
