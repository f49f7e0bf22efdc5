#include "frontend/readers/sample_rows.h"

#include "frontend/readers/recording_checks.h"

namespace camgyro {
namespace {

Eigen::Vector3d Vector(const std::array<size_t, 3>& columns, CsvReader* csv) {
  return {csv->Number(columns[0]), csv->Number(columns[1]), csv->Number(columns[2])};
}

}  // namespace

std::array<size_t, 3> VectorColumns(const std::array<const char*, 3>& names, CsvReader* csv) {
  return {csv->Column({names[0]}), csv->Column({names[1]}), csv->Column({names[2]})};
}

Status ReadGyroRows(const std::string& file, const SampleColumns& columns, CsvReader* csv,
                    Recording* recording) {
  GyroCollector gyro(recording);
  while (csv->NextRow()) {
    const int64_t stamp_ns = csv->Time(columns.time, columns.time_unit_s);
    const Eigen::Vector3d rates = columns.gyro_map * Vector(columns.gyro, csv);
    std::optional<Eigen::Vector3d> accel;
    if (columns.accel) accel = columns.accel_map * Vector(*columns.accel, csv);
    if (!csv->status()) break;
    gyro.Add({stamp_ns, rates}, accel, [csv] { return csv->Place(); });
  }
  if (!csv->status()) return csv->status();
  return gyro.Finish(file);
}

Status ReadAccelRows(const SampleColumns& columns, CsvReader* csv, Recording* recording) {
  while (csv->NextRow()) {
    const int64_t stamp_ns = csv->Time(columns.time, columns.time_unit_s);
    const Eigen::Vector3d accel = columns.accel_map * Vector(*columns.accel, csv);
    if (csv->status() && !recording->accel.empty()) {
      const auto wrong = NotIncreasing(recording->accel.back().stamp_ns, stamp_ns);
      if (wrong) csv->Fail(*wrong);
    }
    if (!csv->status()) break;
    recording->accel.push_back({stamp_ns, accel});
  }
  return csv->status();
}

}  // namespace camgyro
