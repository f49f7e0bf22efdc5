#include "feed.h"

#include <cstdint>
#include <iostream>
#include <limits>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "frontend/frame_source.h"

using camgyro::api::AddResult;

bool GuessFrom(const camgyro::Recording& recording, camgyro::api::CameraGuess* guess) {
  const camgyro::CameraGuess& camera = recording.camera;
  guess->width_px = camera.width_px;
  guess->height_px = camera.height_px;
  guess->focal_px = camera.focal_px;
  guess->aspect_ratio = camera.aspect_ratio;
  if (camera.principal_px)
    guess->principal_px = {camera.principal_px->x(), camera.principal_px->y()};
  for (std::size_t i = 0; i < camera.distortion.size() && i < 4; ++i) {
    guess->distortion[i] = camera.distortion[i];
  }
  guess->readout_s = camera.readout_s;
  guess->delay_s = camera.delay_s;
  if (camera.q_gyro_cam) {
    const Eigen::Quaterniond& q = *camera.q_gyro_cam;
    guess->q_gyro_cam_wxyz = {q.w(), q.x(), q.y(), q.z()};
  }
  return guess->width_px > 0;
}

bool Feed(const camgyro::Recording& recording, camgyro::api::Calibrator* calibrator,
          const std::function<bool(double time_s)>& before_frame) {
  std::unique_ptr<camgyro::FrameSource> pictures;
  if (recording.tracks.empty()) {
    auto opened = camgyro::OpenFrames(recording);
    if (!opened) {
      std::cerr << opened.error().message << "\n";
      return false;
    }
    pictures = std::move(*opened);
  }
  // A full queue is no fault of the data: Snapshot::frames_dropped counts.
  const auto tell = [](const char* what, std::int64_t stamp_ns, AddResult result) {
    if (result == AddResult::kAccepted || result == AddResult::kQueueFull) return;
    std::cerr << what << " " << stamp_ns << ": " << camgyro::api::ToString(result) << "\n";
  };
  std::size_t gyro = 0, accel = 0;
  const auto inertial_until = [&](std::int64_t stamp_ns) {
    for (; gyro < recording.gyro.size() && recording.gyro[gyro].stamp_ns <= stamp_ns; ++gyro) {
      const auto& [stamp, w] = recording.gyro[gyro];
      tell("gyro sample", stamp, calibrator->AddGyro(stamp, w.x(), w.y(), w.z()));
    }
    for (; accel < recording.accel.size() && recording.accel[accel].stamp_ns <= stamp_ns; ++accel) {
      const auto& [stamp, a] = recording.accel[accel];
      tell("accelerometer sample", stamp, calibrator->AddAccel(stamp, a.x(), a.y(), a.z()));
    }
  };
  cv::Mat gray;
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    const std::int64_t stamp_ns = recording.frames[i].stamp_ns;
    if (!before_frame(1e-9 * static_cast<double>(stamp_ns - recording.frames.front().stamp_ns))) {
      return true;
    }
    inertial_until(stamp_ns);
    if (pictures) {
      const auto more = pictures->Next(&gray);
      if (!more) {
        std::cerr << more.error().message << "\n";
        return false;
      }
      if (!*more) break;
      tell("frame", stamp_ns,
           calibrator->AddImage(stamp_ns, {gray.data, gray.cols, gray.rows, gray.step[0]}));
    } else {
      std::vector<camgyro::api::TrackPoint> points;
      for (const camgyro::TrackedPoint& p : recording.tracks[i]) {
        points.push_back({p.track_id, p.px.x(), p.px.y()});
      }
      tell("frame", stamp_ns, calibrator->AddTracks(stamp_ns, points.data(), points.size()));
    }
  }
  inertial_until(std::numeric_limits<std::int64_t>::max());
  return true;
}
