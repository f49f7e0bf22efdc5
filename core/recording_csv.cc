#include "core/recording_csv.h"

#include <algorithm>
#include <cmath>

#include "core/format.h"
#include "core/time.h"

namespace camgyro {
namespace {

long long Stamp(int64_t stamp_ns) { return static_cast<long long>(stamp_ns); }

std::string FileName(const std::string& path) {
  const size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

// Specific force at a stamp between the first and the last of the samples.
Eigen::Vector3d AccelAt(const std::vector<AccelSample>& accel, int64_t stamp_ns) {
  const auto after = std::lower_bound(
      accel.begin(), accel.end(), stamp_ns,
      [](const AccelSample& sample, int64_t stamp) { return sample.stamp_ns < stamp; });
  if (after->stamp_ns == stamp_ns) return after->accel_gyro_m_s2;
  const AccelSample& before = *std::prev(after);
  const double weight =
      SecondsSince(before.stamp_ns, stamp_ns) / SecondsSince(before.stamp_ns, after->stamp_ns);
  return (1.0 - weight) * before.accel_gyro_m_s2 + weight * after->accel_gyro_m_s2;
}

}  // namespace

std::string FramesCsv(const std::vector<Frame>& frames) {
  std::string csv = "#timestamp [ns],filename,exposure [s]\n";
  for (const Frame& frame : frames) {
    csv += Format("%lld,", Stamp(frame.stamp_ns)) + FileName(frame.image_file) + ",";
    if (std::isfinite(frame.exposure_s)) csv += Format("%.9f", frame.exposure_s);
    csv += "\n";
  }
  return csv;
}

std::string TracksCsvHeader() { return "#timestamp [ns],track_id,u [px],v [px]\n"; }

std::string TracksCsvRows(int64_t stamp_ns, const std::vector<TrackedPoint>& tracks, int decimals) {
  std::string csv;
  for (const TrackedPoint& point : tracks) {
    csv += Format("%lld,%lld,%.*f,%.*f\n", Stamp(stamp_ns), static_cast<long long>(point.track_id),
                  decimals, point.px.x(), decimals, point.px.y());
  }
  return csv;
}

std::string LensShiftCsv(const std::vector<LensSample>& samples) {
  std::string csv = "#timestamp [ns],shift_x [px],shift_y [px]\n";
  for (const LensSample& sample : samples) {
    csv += Format("%lld,%.6f,%.6f\n", Stamp(sample.stamp_ns), sample.shift_px.x(),
                  sample.shift_px.y());
  }
  return csv;
}

void WriteTracksCsv(const Recording& recording, int decimals, std::ostream* out) {
  *out << TracksCsvHeader();
  for (size_t i = 0; i < recording.tracks.size(); ++i) {
    *out << TracksCsvRows(recording.frames[i].stamp_ns, recording.tracks[i], decimals);
  }
}

std::string ImuCsv(const Recording& recording) {
  const std::vector<AccelSample>& accel = recording.accel;
  std::string csv = "#timestamp [ns],w_x [rad s^-1],w_y [rad s^-1],w_z [rad s^-1]";
  csv += accel.empty() ? "\n" : ",a_x [m s^-2],a_y [m s^-2],a_z [m s^-2]\n";
  for (const GyroSample& sample : recording.gyro) {
    const int64_t stamp_ns = sample.stamp_ns;
    if (!accel.empty() && (stamp_ns < accel.front().stamp_ns || stamp_ns > accel.back().stamp_ns)) {
      continue;
    }
    const Eigen::Vector3d& w = sample.omega_gyro_rad_s;
    csv += Format("%lld,%.9g,%.9g,%.9g", Stamp(stamp_ns), w.x(), w.y(), w.z());
    if (!accel.empty()) {
      const Eigen::Vector3d a = AccelAt(accel, stamp_ns);
      csv += Format(",%.7g,%.7g,%.7g", a.x(), a.y(), a.z());
    }
    csv += "\n";
  }
  return csv;
}

}  // namespace camgyro
