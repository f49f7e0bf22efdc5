#include "frontend/readers/sample_rows.h"

#include <cmath>
#include <utility>

#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

Eigen::Vector3d Vector(const std::array<size_t, 3>& columns, CsvReader* csv) {
  return {csv->Number(columns[0]), csv->Number(columns[1]), csv->Number(columns[2])};
}

int64_t ReadStamp(const SampleColumns& columns, CsvReader* csv) {
  return csv->Time(columns.time, columns.time_unit_s, columns.time_offset_ns);
}

}  // namespace

std::array<size_t, 3> VectorColumns(const std::array<const char*, 3>& names, CsvReader* csv) {
  return {csv->Column({names[0]}), csv->Column({names[1]}), csv->Column({names[2]})};
}

Eigen::Quaterniond ReadQuaternion(size_t w, const std::array<size_t, 3>& xyz, CsvReader* csv) {
  const Eigen::Quaterniond q(csv->Number(w), csv->Number(xyz[0]), csv->Number(xyz[1]),
                             csv->Number(xyz[2]));
  if (csv->status() && std::abs(q.norm() - 1.0) > 1e-3) {
    csv->Fail(Concat("the quaternion's norm is ", q.norm(), ", expected 1 within 0.001"));
  }
  return csv->status() ? q.normalized() : Eigen::Quaterniond::Identity();
}

void AddFrame(int64_t stamp_ns, const CsvReader& csv, FrameOrder* order, Recording* recording) {
  Frame frame;
  frame.stamp_ns = stamp_ns;
  order->Add(
      std::move(frame), [&csv] { return csv.Place(); }, &recording->frames);
}

Status ReadGyroRows(const std::string& file, const SampleColumns& columns, CsvReader* csv,
                    Recording* recording) {
  GyroCollector gyro(recording);
  while (csv->NextRow()) {
    const int64_t stamp_ns = ReadStamp(columns, csv);
    const Eigen::Vector3d rates = columns.gyro_map * Vector(columns.gyro, csv);
    std::optional<Eigen::Vector3d> accel;
    if (columns.accel) accel = columns.accel_map * Vector(*columns.accel, csv);
    if (!csv->status()) break;
    gyro.Add({stamp_ns, rates}, accel, [csv] { return csv->Place(); });
  }
  if (!csv->status()) return csv->status();
  return gyro.Finish(file);
}

Status ReadAccelRows(const std::string& file, const SampleColumns& columns, CsvReader* csv,
                     Recording* recording) {
  while (csv->NextRow()) {
    const int64_t stamp_ns = ReadStamp(columns, csv);
    const Eigen::Vector3d accel = columns.accel_map * Vector(*columns.accel, csv);
    if (!csv->status()) return csv->status();
    recording->accel.push_back({stamp_ns, accel});
  }
  if (csv->status()) MendAccel(file, recording);
  return csv->status();
}

}  // namespace camgyro
