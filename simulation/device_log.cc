#include "simulation/device_log.h"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "frontend/readers/csv_reader.h"

namespace camgyro::simulation {
namespace {

constexpr size_t kLeastRows = 20;

// visit(row's time [ns], reader) of each row; times are after `origin_ns` where they are stamps.
Status ReadRows(const std::string& file, int64_t origin_ns, bool in_order,
                const std::function<void(int64_t, CsvReader*)>& visit, CsvReader* csv) {
  const bool seconds = csv->HasColumn("timestamp_s");
  const size_t time = csv->Column({"timestamp_ns", "timestamp_s"});
  size_t rows = 0;
  int64_t last_ns = 0;
  while (csv->NextRow()) {
    const int64_t time_ns = seconds ? csv->Time(time, 1.0) : csv->Stamp(time) - origin_ns;
    if (in_order && rows > 0 && time_ns <= last_ns) csv->Fail("the time does not increase");
    last_ns = time_ns;
    visit(time_ns, csv);
    ++rows;
  }
  if (!csv->status()) return csv->status();
  if (rows < kLeastRows) {
    return BadInput(file + ": has " + std::to_string(rows) + " rows, expected at least " +
                    std::to_string(kLeastRows));
  }
  return {};
}

Status ReadGyro(const std::string& file, DeviceLog* log, int64_t* origin_ns) {
  CsvReader csv = CsvReader::ByName(file);
  const size_t x = csv.Column({"wx"}), y = csv.Column({"wy"}), z = csv.Column({"wz"});
  std::vector<Eigen::Vector3d> rates;
  const Status read = ReadRows(
      file, 0, /*in_order=*/true,
      [&](int64_t time_ns, CsvReader* row) {
        log->gyro_ns.push_back(time_ns);
        rates.emplace_back(row->Number(x), row->Number(y), row->Number(z));
      },
      &csv);
  if (!read) return read;
  *origin_ns = log->gyro_ns.front();
  for (int64_t& time_ns : log->gyro_ns) time_ns -= *origin_ns;
  log->rate_gyro_rad_s.resize(3, static_cast<Eigen::Index>(rates.size()));
  for (size_t i = 0; i < rates.size(); ++i) {
    log->rate_gyro_rad_s.col(static_cast<Eigen::Index>(i)) = rates[i];
  }
  return {};
}

Status ReadFrames(const std::string& file, int64_t origin_ns, DeviceLog* log) {
  CsvReader csv = CsvReader::ByName(file);
  const bool exposed = csv.HasColumn("exposure_s");
  const size_t exposure = exposed ? csv.Column({"exposure_s"}) : 0;
  return ReadRows(
      file, origin_ns, /*in_order=*/true,
      [&](int64_t time_ns, CsvReader* row) {
        log->frame_ns.push_back(time_ns);
        if (exposed) log->exposure_s.push_back(row->Number(exposure));
      },
      &csv);
}

Status ReadLensShift(const std::string& file, int64_t origin_ns, DeviceLog* log) {
  CsvReader csv = CsvReader::ByName(file);
  const size_t x = csv.Column({"ois_x"}), y = csv.Column({"ois_y"});
  std::map<int64_t, Eigen::Vector2d> shifts;
  const Status read = ReadRows(
      file, origin_ns, /*in_order=*/false,
      [&](int64_t time_ns, CsvReader* row) {
        shifts[time_ns] = {row->Number(x), row->Number(y)};
      },
      &csv);
  if (!read) return read;
  log->lens_shift.resize(2, static_cast<Eigen::Index>(shifts.size()));
  for (const auto& [time_ns, shift] : shifts) {
    log->lens_shift.col(static_cast<Eigen::Index>(log->lens_ns.size())) = shift;
    log->lens_ns.push_back(time_ns);
  }
  return {};
}

}  // namespace

Eigen::Vector2d DeviceLog::LensShiftAt(double time_s) const {
  const double time_ns = 1e9 * time_s;
  const auto next = std::upper_bound(lens_ns.begin(), lens_ns.end(), time_ns,
                                     [](double t, int64_t stamp) { return t < double(stamp); });
  if (next == lens_ns.begin()) return lens_shift.leftCols<1>();
  if (next == lens_ns.end()) return lens_shift.rightCols<1>();
  const Eigen::Index i = next - lens_ns.begin();
  const auto before = static_cast<double>(*(next - 1)), after = static_cast<double>(*next);
  const double weight = (time_ns - before) / (after - before);
  return (1.0 - weight) * lens_shift.col(i - 1) + weight * lens_shift.col(i);
}

Result<DeviceLog> ReadDeviceLog(const DeviceLogFiles& files) {
  if (files.gyro.empty()) return BadInput("log.gyro: is missing, the times are after its first");
  DeviceLog log;
  int64_t origin_ns = 0;
  if (Status read = ReadGyro(files.gyro, &log, &origin_ns); !read) {
    return tl::unexpected(read.error());
  }
  if (!files.frames.empty()) {
    if (Status read = ReadFrames(files.frames, origin_ns, &log); !read) {
      return tl::unexpected(read.error());
    }
  }
  if (!files.lens_shift.empty()) {
    if (Status read = ReadLensShift(files.lens_shift, origin_ns, &log); !read) {
      return tl::unexpected(read.error());
    }
  }
  return log;
}

}  // namespace camgyro::simulation
