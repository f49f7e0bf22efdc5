#include "camgyro/stream_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace camgyro::api {
namespace {

constexpr std::int64_t kLargestStamp = 4'000'000'000'000'000'000;  // differences fit in int64
constexpr double kMaxRate = 200.0, kMaxForce = 2000.0;
constexpr std::size_t kMaxPoints = 5000;

std::optional<AddResult> CheckVector(std::int64_t stamp_ns, const Eigen::Vector3d& value,
                                     double limit) {
  if (!value.allFinite()) return AddResult::kNotFinite;
  if (std::abs(stamp_ns) >= kLargestStamp || value.cwiseAbs().maxCoeff() > limit) {
    return AddResult::kOutOfRange;
  }
  return std::nullopt;
}

}  // namespace

std::optional<AddResult> CheckSample(const GyroSample& sample) {
  return CheckVector(sample.stamp_ns, sample.omega_gyro_rad_s, kMaxRate);
}

std::optional<AddResult> CheckSample(const AccelSample& sample) {
  return CheckVector(sample.stamp_ns, sample.accel_gyro_m_s2, kMaxForce);
}

std::optional<AddResult> CheckOrder(std::int64_t stamp_ns,
                                    const std::optional<std::int64_t>& last_ns) {
  if (!last_ns || stamp_ns > *last_ns) return std::nullopt;
  return stamp_ns == *last_ns ? AddResult::kDuplicate : AddResult::kOutOfOrder;
}

std::optional<AddResult> CheckImage(std::int64_t stamp_ns, const ImageView& view,
                                    const camgyro::CameraGuess& camera) {
  if (std::abs(stamp_ns) >= kLargestStamp) return AddResult::kOutOfRange;
  if (view.pixels == nullptr || view.width_px != camera.width_px ||
      view.height_px != camera.height_px ||
      view.stride_bytes < static_cast<std::size_t>(view.width_px)) {
    return AddResult::kWrongSize;
  }
  return std::nullopt;
}

std::optional<AddResult> TakePoints(std::int64_t stamp_ns, const TrackPoint* points,
                                    std::size_t count, const camgyro::CameraGuess& camera,
                                    std::vector<TrackedPoint>* taken) {
  if (std::abs(stamp_ns) >= kLargestStamp || count > kMaxPoints ||
      (points == nullptr && count > 0)) {
    return AddResult::kOutOfRange;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const TrackPoint& p = points[i];
    if (!std::isfinite(p.u_px) || !std::isfinite(p.v_px)) return AddResult::kNotFinite;
    if (std::abs(p.u_px - 0.5 * camera.width_px) > 1.5 * camera.width_px ||
        std::abs(p.v_px - 0.5 * camera.height_px) > 1.5 * camera.height_px) {
      return AddResult::kOutOfRange;
    }
    taken->push_back({p.id, {p.u_px, p.v_px}});
  }
  const auto by_id = [](const TrackedPoint& a, const TrackedPoint& b) {
    return a.track_id < b.track_id;
  };
  std::sort(taken->begin(), taken->end(), by_id);
  for (std::size_t i = 0; i + 1 < taken->size(); ++i) {
    if ((*taken)[i].track_id == (*taken)[i + 1].track_id) return AddResult::kOutOfRange;
  }
  return std::nullopt;
}

}  // namespace camgyro::api
