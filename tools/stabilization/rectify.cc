#include "tools/stabilization/rectify.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/time.h"
#include "frontend/frame_source.h"
#include "tools/stabilization/camera_path.h"
#include "tools/stabilization/frame_warp.h"

namespace camgyro {
namespace {

double MiddleRow(const Calibration& calibration) { return 0.5 * calibration.height_px; }

// From a recorded frame to the picture that its middle row's orientation and time would have given.
FrameWarp WarpOf(const CameraPath& path, const Calibration& recorded, int frame,
                 const Calibration& rectified) {
  return FrameWarp(path, recorded, frame,
                   Eigen::Quaterniond(path.R_world_cam(frame, MiddleRow(recorded))),
                   VirtualCamera(rectified));
}

// What a calibration of the rectified recording would find.
Calibration RectifiedCalibration(Calibration c, const RectifyOptions& options) {
  c.delay_s = c.readout_s = 0.0;
  c.effects.reset();
  if (options.remove_bias) c.bias_gyro_rad_s.setZero();
  if (options.undistort) {
    c.distortion_model = DistortionModel::kNone;
    c.lens = MakePinhole(c.lens[kFocal], c.lens.segment<2>(kCx), c.lens[kAspect]);
  }
  return c;
}

CameraGuess GuessOf(const Calibration& c) {
  CameraGuess guess;
  guess.width_px = c.width_px;
  guess.height_px = c.height_px;
  guess.focal_px = c.lens[kFocal];
  guess.aspect_ratio = c.lens[kAspect];
  guess.principal_px = c.lens.segment<2>(kCx);
  if (c.distortion_model != DistortionModel::kNone) {
    guess.SetDistortion(c.distortion_model, c.lens);
  }
  guess.q_gyro_cam = c.q_gyro_cam;
  guess.readout_s = guess.delay_s = 0.0;
  return guess;
}

// The points of one frame; returns the sum of the squares of their shifts [px^2].
double RectifyPoints(const FrameWarp& warp, const Calibration& c,
                     std::vector<TrackedPoint>* points) {
  double squares = 0.0;
  size_t kept = 0;
  for (TrackedPoint point : *points) {
    const auto px = warp.ToVirtual(point.px);
    if (!px || px->x() < -0.5 || px->y() < -0.5 || px->x() > c.width_px - 0.5 ||
        px->y() > c.height_px - 0.5) {
      continue;
    }
    squares += (*px - point.px).squaredNorm();
    point.px = *px;
    (*points)[kept++] = point;
  }
  points->resize(kept);
  return squares;
}

}  // namespace

Result<Rectified> Rectify(const Calibration& calibration, const RectifyOptions& options,
                          Recording* to_empty) {
  const Recording& recording = *to_empty;
  if (!recording.HasImages() && recording.tracks.empty()) {
    return BadInput(recording.path + ": has neither pictures nor tracks to rectify");
  }
  const CameraPath path(recording, calibration);
  if (Status fits = CheckCalibrationFits(recording, calibration, path); !fits) {
    return tl::unexpected(fits.error());
  }
  const int first = path.first_frame(), last = path.last_frame();
  Rectified rectified;
  rectified.calibration = RectifiedCalibration(calibration, options);
  rectified.first_frame = first;
  rectified.frames_dropped = static_cast<int>(recording.frames.size()) - (last - first + 1);

  Recording& out = rectified.recording;
  out.path = recording.path;
  out.camera = GuessOf(rectified.calibration);
  out.gyro_info = recording.gyro_info;
  out.gyro = recording.gyro;
  if (options.remove_bias) {
    for (GyroSample& sample : out.gyro) sample.omega_gyro_rad_s -= calibration.bias_gyro_rad_s;
  }
  out.accel = recording.accel;
  out.match_noise = recording.match_noise;
  double squares = 0.0;
  size_t points = 0;
  for (int frame = first; frame <= last; ++frame) {
    Frame moved = recording.frames[static_cast<size_t>(frame)];
    moved.stamp_ns =
        StampAt(recording.gyro.front().stamp_ns, path.RowTime(frame, MiddleRow(calibration)));
    moved.image_file = recording.HasImages() ? std::to_string(moved.stamp_ns) + ".png" : "";
    out.frames.push_back(moved);
    if (recording.tracks.empty()) continue;
    const FrameWarp warp = WarpOf(path, calibration, frame, rectified.calibration);
    out.tracks.push_back(std::move(to_empty->tracks[static_cast<size_t>(frame)]));
    squares += RectifyPoints(warp, calibration, &out.tracks.back());
    points += out.tracks.back().size();
  }
  to_empty->tracks.clear();
  if (points > 0) rectified.shift_px = std::sqrt(squares / static_cast<double>(points));
  return rectified;
}

Status RectifyPictures(const Recording& recording, const Calibration& calibration,
                       const Rectified& rectified, const std::string& folder,
                       const std::function<void(double done)>& progress) {
  const CameraPath path(recording, calibration);
  Result<std::unique_ptr<FrameSource>> source = OpenFrames(recording);
  if (!source) return tl::unexpected(source.error());
  const int first = rectified.first_frame;
  const int count = static_cast<int>(rectified.recording.frames.size());
  cv::Mat picture, map_x, map_y, turned;
  for (int frame = 0; frame < first + count; ++frame) {
    const Result<bool> more = (*source)->Next(&picture);
    if (!more) return tl::unexpected(more.error());
    if (!*more) break;
    if (frame < first) continue;
    WarpOf(path, calibration, frame, rectified.calibration).Maps(&map_x, &map_y);
    cv::remap(picture, turned, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
    const std::string file =
        folder + "/" + rectified.recording.frames[static_cast<size_t>(frame - first)].image_file;
    bool written = false;
    try {
      written = cv::imwrite(file, turned);
    } catch (const cv::Exception&) {
    }
    if (!written) return BadInput(file + ": cannot be written");
    if (progress) progress(static_cast<double>(frame - first + 1) / count);
  }
  return {};
}

}  // namespace camgyro
