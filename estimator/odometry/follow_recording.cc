#include "estimator/odometry/follow_recording.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "core/format.h"
#include "core/time.h"

namespace camgyro {
namespace {

template <typename T>
void Append(std::vector<T> from, std::vector<T>* to) {
  to->insert(to->end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

double PathLengthM(const std::vector<OdometryPose>& poses) {
  double length_m = 0.0;
  for (size_t i = 0; i + 1 < poses.size(); ++i) {
    if (poses[i].segment != poses[i + 1].segment) continue;
    length_m += (poses[i + 1].state.p_world_m - poses[i].state.p_world_m).norm();
  }
  return length_m;
}

// What Odometry has to tell, gathered.
class Gathering {
 public:
  void Take(Odometry* odometry) {
    Append(odometry->TakePoses(), &run_.poses);
    std::vector<OdometryPose> keyframes = odometry->TakeKeyframes();
    if (!keyframes.empty()) {
      for (const MappedPoint& point : odometry->Points()) points_[point.track_id] = point;
    }
    Append(std::move(keyframes), &run_.keyframes);
    Append(odometry->TakeEvents(), &run_.events);
  }

  OdometryRun Finish(Odometry* odometry) {
    for (const MappedPoint& point : odometry->Points()) points_[point.track_id] = point;
    odometry->Finish();
    Take(odometry);
    for (const OdometryEvent& event : run_.events) {
      run_.segments += event.kind == OdometryEvent::Kind::kStarted;
    }
    for (const auto& [id, point] : points_) run_.points.push_back(point);
    run_.start_verdict = odometry->start_verdict();
    run_.start_explanation = odometry->start_explanation();
    run_.calibration = odometry->calibration();
    run_.p_gyro_cam_m = odometry->p_gyro_cam_m();
    run_.p_gyro_cam_sigma_m = odometry->p_gyro_cam_sigma_m();
    run_.noise_px = odometry->noise_px();
    run_.tracks_drift = odometry->tracks_drift();
    run_.path_m = PathLengthM(run_.keyframes);
    return std::move(run_);
  }

 private:
  OdometryRun run_;
  std::map<int64_t, MappedPoint> points_;
};

}  // namespace

std::string VerdictOf(const OdometryRun& run) {
  if (run.segments == 0) {
    return "not started (" + VinsVerdictName(run.start_verdict) + "): " + run.start_explanation;
  }
  const bool ended_lost = run.events.back().kind == OdometryEvent::Kind::kLost;
  if (run.segments == 1 && !ended_lost) return "tracked";
  std::string text = Format("lost %d time%s", run.segments - !ended_lost,
                            run.segments - !ended_lost == 1 ? "" : "s");
  return ended_lost ? text + ", and not found again" : text + ", and found again";
}

OdometryOptions WithDeclaredNoise(OdometryOptions options, const GyroInfo& gyro) {
  if (gyro.noise_density_rad_s_rtHz) options.noise.gyro_rad_s_rtHz = *gyro.noise_density_rad_s_rtHz;
  if (gyro.random_walk_rad_s2_rtHz) options.walk.gyro_rad_s2_rtHz = *gyro.random_walk_rad_s2_rtHz;
  return options;
}

Status CheckCanBeFollowed(const Recording& recording) {
  if (recording.tracks.empty() && !recording.HasImages()) {
    return BadInput(recording.path +
                    ": odometry needs pictures, or tracks of points with an identity");
  }
  if (recording.accel.empty()) {
    return BadInput(recording.path +
                    ": has no accelerometer; odometry needs one to know the scale and which way "
                    "is down");
  }
  return {};
}

Result<OdometryRun> FollowRecording(const Recording& recording, const Calibration& calibration,
                                    const OdometryOptions& options,
                                    const std::function<void(double)>& progress) {
  if (Status sound = CheckCanBeFollowed(recording); !sound) return tl::unexpected(sound.error());
  if (recording.tracks.empty()) return BadInput(recording.path + ": its pictures are not tracked");
  Odometry odometry(calibration, options);
  Gathering gathering;
  size_t gyro = 0, accel = 0;
  const double after_s = calibration.delay_s + std::max(0.0, calibration.readout_s) +
                         2.0 * MedianInterval(recording.gyro);
  for (size_t i = 0; i < recording.frames.size() && i < recording.tracks.size(); ++i) {
    const int64_t until_ns = StampAt(recording.frames[i].stamp_ns, after_s);
    for (; gyro < recording.gyro.size() && recording.gyro[gyro].stamp_ns <= until_ns; ++gyro) {
      if (Status fed = odometry.AddGyro(recording.gyro[gyro]); !fed) {
        return tl::unexpected(fed.error());
      }
    }
    for (; accel < recording.accel.size() && recording.accel[accel].stamp_ns <= until_ns; ++accel) {
      if (Status fed = odometry.AddAccel(recording.accel[accel]); !fed) {
        return tl::unexpected(fed.error());
      }
    }
    if (Status fed = odometry.AddFrame(recording.frames[i].stamp_ns, recording.tracks[i]); !fed) {
      return tl::unexpected(fed.error());
    }
    gathering.Take(&odometry);
    if (progress) {
      progress(static_cast<double>(i + 1) / static_cast<double>(recording.frames.size()));
    }
  }
  return gathering.Finish(&odometry);
}

}  // namespace camgyro
