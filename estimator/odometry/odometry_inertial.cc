// What Odometry does with inertial samples, and the sightings that need them.
#include <algorithm>
#include <cmath>

#include "core/gyro_gap.h"
#include "core/time.h"
#include "estimator/odometry/odometry.h"

namespace camgyro {
namespace {

// Beyond this the accelerometer has a hole: what the hand does in between is not known.
constexpr double kLongestAccelStepS = 0.05;
// Dead reckoning across a loss is worth nothing after this long.
constexpr double kLongestDeadReckoningS = 20.0;
// Samples are let go in lumps, so that what remains is not moved for each.
constexpr size_t kLump = 1000;

// The samples from the last one at or before from_ns to the first one at or after to_ns; empty if
// they do not reach.
template <typename Sample>
std::vector<Sample> Covering(const std::vector<Sample>& samples, int64_t from_ns, int64_t to_ns) {
  const auto by_stamp = [](const Sample& sample, int64_t stamp) { return sample.stamp_ns < stamp; };
  auto first = std::lower_bound(samples.begin(), samples.end(), from_ns, by_stamp);
  auto last = std::lower_bound(first, samples.end(), to_ns, by_stamp);
  if (last == samples.end() || first == samples.end()) return {};
  if (first->stamp_ns > from_ns) {
    if (first == samples.begin()) return {};
    --first;
  }
  return {first, last + 1};
}

template <typename Sample>
bool HasStep(const std::vector<Sample>& samples, double longest_s) {
  return std::adjacent_find(samples.begin(), samples.end(), [&](const Sample& a, const Sample& b) {
           return SecondsSince(a.stamp_ns, b.stamp_ns) > longest_s;
         }) != samples.end();
}

template <typename Sample>
void ForgetBefore(int64_t stamp_ns, std::vector<Sample>* samples) {
  const auto keep =
      std::lower_bound(samples->begin(), samples->end(), stamp_ns,
                       [](const Sample& sample, int64_t stamp) { return sample.stamp_ns < stamp; });
  if (static_cast<size_t>(keep - samples->begin()) > kLump) samples->erase(samples->begin(), keep);
}

}  // namespace

// Origin of its times: from_ns. Reaches over the rows of frames at both ends.
std::optional<ImuIntegral> Odometry::IntegralOver(int64_t from_ns, int64_t to_ns,
                                                  const NavigationState& biases) const {
  const int64_t begin_ns = StampAt(from_ns, -reach_s_);
  const int64_t end_ns = StampAt(to_ns, reach_s_);
  const std::vector<GyroSample> gyro = Covering(gyro_, begin_ns, end_ns);
  const std::vector<AccelSample> accel = Covering(accel_, begin_ns, end_ns);
  if (gyro.size() < 2 || accel.empty()) return std::nullopt;
  if (HasStep(gyro, LongestGyroStep(MedianInterval(gyro))) || HasStep(accel, kLongestAccelStepS)) {
    return std::nullopt;
  }
  return ImuIntegral(gyro, accel, from_ns, biases.bias_gyro_rad_s, biases.bias_accel_m_s2);
}

void Odometry::ForgetInertial() {
  int64_t keep_ns =
      pending_.empty() ? std::min(last_gyro_ns_, last_accel_ns_) : pending_.front().time_ns;
  if (!starting_.empty()) keep_ns = std::min(keep_ns, starting_.front().time_ns);
  if (window_) {
    keep_ns = std::min(keep_ns, window_->keyframe(window_->size() - 2).time_ns);
  } else if (anchor_ && SecondsSince(anchor_->time_ns, last_gyro_ns_) < kLongestDeadReckoningS) {
    keep_ns = std::min(keep_ns, anchor_->time_ns);
  }
  // A little more than the rows of the frame there.
  keep_ns = StampAt(keep_ns, -0.1 - std::abs(calibration_.readout_s));
  ForgetBefore(keep_ns, &gyro_);
  ForgetBefore(keep_ns, &accel_);
}

// Each observation with the inertial way from the frame's middle row to its own; imu has its
// origin at origin_ns.
std::vector<LandmarkSighting> Odometry::SightingsOf(const QueuedFrame& frame,
                                                    const ImuIntegral& imu,
                                                    int64_t origin_ns) const {
  std::vector<LandmarkSighting> sightings;
  const Lens& lens = GetLens(calibration_.distortion_model);
  const LensParameters full_lens = calibration_.FullLens();
  const double node_s = SecondsSince(origin_ns, frame.time_ns);
  for (const TrackedPoint& point : frame.tracks) {
    LandmarkSighting seen;
    seen.track_id = point.track_id;
    RowProjectionMeasurement& m = seen.projection;
    if (!lens.Unproject(point.px, full_lens, &m.ray, LensDerivatives::kPinhole)) continue;
    m.row_fraction = point.px.y() / calibration_.height_px;
    const double row_s = node_s + calibration_.readout_s * (m.row_fraction - 0.5);
    m.node_to_row = imu.Between(node_s, row_s);
    m.omega_gyro_rad_s = imu.RateAt(row_s);
    m.q_gyro_cam = calibration_.q_gyro_cam;
    m.sigma_px = noise_px_;
    m.gravity_m_s2 = options_.gravity_m_s2;
    sightings.push_back(seen);
  }
  return sightings;
}

// Frames of the last span_s seconds with the inertial samples that they need, and no others:
// whatever came in before, the start is the same.
VinsInput Odometry::StartInput(double span_s) const {
  VinsInput input;
  input.calibration = calibration_;
  const int64_t first_ns = StampAt(starting_.back().stamp_ns, -span_s - 1e-3);
  const auto first =
      std::find_if(starting_.begin(), starting_.end(),
                   [&](const QueuedFrame& frame) { return frame.stamp_ns >= first_ns; });
  for (auto frame = first; frame != starting_.end(); ++frame) {
    input.frame_stamps_ns.push_back(frame->stamp_ns);
    input.tracks.push_back(frame->tracks);
  }
  const int64_t from_ns = StampAt(first->time_ns, -reach_s_);
  const int64_t to_ns = StampAt(starting_.back().time_ns, reach_s_);
  input.gyro = Covering(gyro_, from_ns, to_ns);
  input.accel = Covering(accel_, from_ns, to_ns);
  return input;
}

BiasedPreintegrationMeasurement Odometry::Link(const ImuIntegral& imu, int64_t origin_ns,
                                               int64_t from_ns, int64_t to_ns,
                                               const NavigationState& biases) const {
  const double from_s = SecondsSince(origin_ns, from_ns), to_s = SecondsSince(origin_ns, to_ns);
  BiasedPreintegrationMeasurement link;
  link.preintegration.delta = imu.Between(from_s, to_s);
  link.preintegration.covariance = imu.Covariance(from_s, to_s, options_.noise);
  link.preintegration.gravity_m_s2 = options_.gravity_m_s2;
  link.bias_gyro_rad_s = biases.bias_gyro_rad_s;
  link.bias_accel_m_s2 = biases.bias_accel_m_s2;
  return link;
}

}  // namespace camgyro
