#include "estimator/vins/vins_window.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/gyro_gap.h"
#include "core/pair_model.h"
#include "core/time.h"

namespace camgyro {
namespace {

constexpr int kMinKeyframes = 4;
constexpr size_t kMinTracks = 15;
constexpr size_t kMinSightings = 3;  // two fix a point, the third tells whether it is right
constexpr double kMarginS = 0.05;    // of inertial samples around the frames

template <typename Sample>
bool StampsIncrease(const std::vector<Sample>& samples) {
  return std::adjacent_find(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) {
           return a.stamp_ns >= b.stamp_ns;
         }) == samples.end();
}

Status CheckInput(const VinsInput& input) {
  if (input.tracks.size() != input.frame_stamps_ns.size()) {
    return BadInput("expected one list of tracks for each frame");
  }
  for (size_t i = 0; i + 1 < input.frame_stamps_ns.size(); ++i) {
    if (input.frame_stamps_ns[i] >= input.frame_stamps_ns[i + 1]) {
      return BadInput("frame " + std::to_string(i + 1) + ": the stamp does not increase");
    }
  }
  if (!StampsIncrease(input.gyro)) return BadInput("a gyro stamp does not increase");
  if (!StampsIncrease(input.accel)) return BadInput("an accelerometer stamp does not increase");
  for (const GyroSample& sample : input.gyro) {
    if (!sample.omega_gyro_rad_s.allFinite()) return BadInput("a gyro rate is not finite");
  }
  for (const AccelSample& sample : input.accel) {
    if (!sample.accel_gyro_m_s2.allFinite()) return BadInput("an acceleration is not finite");
  }
  for (const auto& points : input.tracks) {
    for (const TrackedPoint& point : points) {
      if (!point.px.allFinite()) return BadInput("a tracked pixel is not finite");
    }
  }
  const Calibration& c = input.calibration;
  if (!c.lens.allFinite() || !(c.lens[kFocal] > 0.0) || c.height_px <= 0 ||
      !std::isfinite(c.delay_s) || !std::isfinite(c.readout_s) || !c.bias_gyro_rad_s.allFinite() ||
      !c.q_gyro_cam.coeffs().allFinite() || !c.covariance.allFinite() ||
      (c.total_covariance && !c.total_covariance->allFinite())) {
    return BadInput("the calibration is not finite or has no lens");
  }
  return {};
}

std::vector<int> ChooseKeyframes(const std::vector<int64_t>& stamps_ns, double interval_s) {
  std::vector<int> chosen;
  const double span_s = SecondsSince(stamps_ns.front(), stamps_ns.back());
  const int steps = std::max(1, static_cast<int>(std::lround(span_s / interval_s)));
  for (int i = 0; i <= steps; ++i) {
    const int64_t wanted = StampAt(stamps_ns.front(), span_s * i / steps);
    auto nearest = std::lower_bound(stamps_ns.begin(), stamps_ns.end(), wanted);
    if (nearest == stamps_ns.end() ||
        (nearest != stamps_ns.begin() && wanted - *(nearest - 1) < *nearest - wanted)) {
      --nearest;
    }
    const int frame = static_cast<int>(nearest - stamps_ns.begin());
    if (chosen.empty() || frame > chosen.back()) chosen.push_back(frame);
  }
  return chosen;
}

}  // namespace

VinsInput CutVinsInput(const Recording& recording, const Calibration& calibration, double first_s,
                       double last_s) {
  VinsInput input;
  input.calibration = calibration;
  if (recording.frames.empty()) return input;
  const int64_t begin_ns = recording.frames.front().stamp_ns;
  for (size_t i = 0; i < recording.frames.size() && i < recording.tracks.size(); ++i) {
    const double time_s = SecondsSince(begin_ns, recording.frames[i].stamp_ns);
    if (time_s < first_s || time_s > last_s) continue;
    input.frame_stamps_ns.push_back(recording.frames[i].stamp_ns);
    input.tracks.push_back(recording.tracks[i]);
  }
  if (input.frame_stamps_ns.empty()) return input;
  const double before_s = std::min(0.0, calibration.readout_s) + calibration.delay_s - kMarginS;
  const double after_s = std::max(0.0, calibration.readout_s) + calibration.delay_s + kMarginS;
  const int64_t from_ns = StampAt(input.frame_stamps_ns.front(), before_s);
  const int64_t to_ns = StampAt(input.frame_stamps_ns.back(), after_s);
  const auto inside = [&](const auto& sample) {
    return sample.stamp_ns >= from_ns && sample.stamp_ns <= to_ns;
  };
  std::copy_if(recording.gyro.begin(), recording.gyro.end(), std::back_inserter(input.gyro),
               inside);
  std::copy_if(recording.accel.begin(), recording.accel.end(), std::back_inserter(input.accel),
               inside);
  return input;
}

Result<VinsWindow> MakeVinsWindow(const VinsInput& input, double interval_s) {
  if (Status sound = CheckInput(input); !sound) return tl::unexpected(sound.error());
  if (input.frame_stamps_ns.size() < kMinKeyframes || input.gyro.size() < 2) {
    return CannotEstimate("too few frames or gyro samples for a window");
  }
  const Calibration& calibration = input.calibration;
  const int64_t origin_ns = input.gyro.front().stamp_ns;
  VinsWindow window{origin_ns,
                    calibration,
                    ImuIntegral(input.gyro, input.accel, origin_ns, calibration.bias_gyro_rad_s),
                    {},
                    {},
                    {}};
  const ShutterParameters shutter = ShutterOf(calibration);
  const double height = calibration.height_px;
  for (const int frame : ChooseKeyframes(input.frame_stamps_ns, interval_s)) {
    const double stamp_s = SecondsSince(origin_ns, input.frame_stamps_ns[frame]);
    window.keyframes.push_back({frame, RowTimeGyroS(stamp_s, shutter, 0.5 * height, height),
                                Eigen::Quaterniond::Identity()});
  }
  if (window.keyframes.size() < kMinKeyframes) {
    return CannotEstimate("the window is too short: fewer than 4 keyframes");
  }
  const double half_readout_s = 0.5 * std::abs(calibration.readout_s);
  if (window.keyframes.front().time_s - half_readout_s < window.imu.begin_s() ||
      window.keyframes.back().time_s + half_readout_s > window.imu.end_s()) {
    return CannotEstimate("the gyro samples do not cover the window's frames");
  }
  const double longest_step_s = LongestGyroStep(MedianInterval(input.gyro));
  for (size_t i = 0; i + 1 < input.gyro.size(); ++i) {
    if (SecondsSince(input.gyro[i].stamp_ns, input.gyro[i + 1].stamp_ns) > longest_step_s) {
      return CannotEstimate("the gyro samples have a hole within the window");
    }
  }
  const Eigen::Quaterniond q_world_ref =
      window.imu.RotationAt(window.keyframes.front().time_s).conjugate();
  for (VinsKeyframe& keyframe : window.keyframes) {
    keyframe.q_world_gyro = (q_world_ref * window.imu.RotationAt(keyframe.time_s)).normalized();
  }

  const Lens& lens = GetLens(calibration.distortion_model);
  const LensParameters full_lens = calibration.FullLens();
  std::map<int64_t, std::vector<VinsObservation>> by_track;
  for (size_t k = 0; k < window.keyframes.size(); ++k) {
    const auto frame = static_cast<size_t>(window.keyframes[k].frame);
    const double stamp_s = SecondsSince(origin_ns, input.frame_stamps_ns[frame]);
    for (const TrackedPoint& point : input.tracks[frame]) {
      VinsObservation seen;
      seen.keyframe = static_cast<int>(k);
      seen.px = point.px;
      seen.time_s = RowTimeGyroS(stamp_s, shutter, point.px.y(), height);
      if (!lens.Unproject(point.px, full_lens, &seen.ray)) continue;
      seen.direction_world = (q_world_ref * (window.imu.RotationAt(seen.time_s) *
                                             (calibration.q_gyro_cam * seen.ray.ray)))
                                 .normalized();
      by_track[point.track_id].push_back(seen);
    }
  }
  for (auto& [id, sightings] : by_track) {
    if (sightings.size() < kMinSightings) continue;
    for (VinsObservation& seen : sightings) {
      seen.landmark = static_cast<int>(window.track_ids.size());
      window.observations.push_back(std::move(seen));
    }
    window.track_ids.push_back(id);
  }
  if (window.track_ids.size() < kMinTracks) {
    return CannotEstimate("too few tracks: " + std::to_string(window.track_ids.size()) +
                          " are seen in three keyframes, at least " + std::to_string(kMinTracks) +
                          " are needed");
  }
  return window;
}

}  // namespace camgyro
