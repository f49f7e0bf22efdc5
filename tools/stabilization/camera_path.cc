#include "tools/stabilization/camera_path.h"

#include <algorithm>
#include <cmath>

#include "core/pair_model.h"
#include "core/so3.h"
#include "core/time.h"

namespace camgyro {
namespace {

RotationChain MakeChain(const Recording& recording, const Calibration& calibration) {
  std::vector<double> times;
  Eigen::Matrix3Xd rates(3, static_cast<Eigen::Index>(recording.gyro.size()));
  for (const GyroSample& sample : recording.gyro) {
    rates.col(static_cast<Eigen::Index>(times.size())) =
        sample.omega_gyro_rad_s - calibration.bias_gyro_rad_s;
    times.push_back(SecondsSince(recording.gyro.front().stamp_ns, sample.stamp_ns));
  }
  return RotationChain(times, rates);
}

}  // namespace

CameraPath::CameraPath(const Recording& recording, const Calibration& calibration)
    : calibration_(calibration),
      R_gyro_cam_(calibration.q_gyro_cam.toRotationMatrix()),
      chain_(MakeChain(recording, calibration)) {
  for (const Frame& frame : recording.frames) {
    frame_times_s_.push_back(SecondsSince(recording.gyro.front().stamp_ns, frame.stamp_ns));
  }
  const int frames = static_cast<int>(frame_times_s_.size());
  while (first_frame_ < frames && !Covers(first_frame_)) ++first_frame_;
  last_frame_ = frames - 1;
  while (last_frame_ >= first_frame_ && !Covers(last_frame_)) --last_frame_;
}

double CameraPath::RowTime(int frame, double row_px) const {
  return RowTimeGyroS(frame_times_s_[static_cast<size_t>(frame)], ShutterOf(calibration_), row_px,
                      calibration_.height_px);
}

LensParameters CameraPath::LensChange(int frame, double row_px) const {
  LensParameters change = LensParameters::Zero();
  if (!calibration_.effects) return change;
  const Eigen::Vector2d size_px(calibration_.width_px, calibration_.height_px);
  const Observation seen = {
      {0.5 * size_px.x(), row_px}, size_px, FrameTime(frame_times_s_[static_cast<size_t>(frame)])};
  for (const EffectSet::Item& item : calibration_.effects->items()) {
    const int n = item.effect->size();
    if (item.effect->is_constant_lens()) continue;
    Eigen::Matrix<double, kLensSize, Eigen::Dynamic> columns =
        Eigen::Matrix<double, kLensSize, Eigen::Dynamic>::Zero(kLensSize, n);
    item.effect->ChangeLens(seen, columns);
    change += columns * calibration_.effect_values.segment(item.first, n);
  }
  return change;
}

Eigen::Matrix3d CameraPath::R_world_cam(double time_s) const {
  return chain_.At(time_s).R_ref_gyro * R_gyro_cam_;
}

bool CameraPath::Covers(int frame) const {
  const double a = RowTime(frame, 0.0), b = RowTime(frame, calibration_.height_px);
  return std::min(a, b) >= chain_.times_s().front() && std::max(a, b) <= chain_.times_s().back();
}

Status CheckCalibrationFits(const Recording& recording, const Calibration& calibration,
                            const CameraPath& path) {
  const auto size = [](int width, int height) {
    return std::to_string(width) + " x " + std::to_string(height);
  };
  if (recording.camera.width_px != calibration.width_px ||
      recording.camera.height_px != calibration.height_px) {
    return BadInput(recording.path + ": has pictures of " +
                    size(recording.camera.width_px, recording.camera.height_px) +
                    " pixels, expected " + size(calibration.width_px, calibration.height_px) +
                    " as the calibration was made for");
  }
  if (path.last_frame() <= path.first_frame()) {
    return BadInput(recording.path + ": with the calibration's delay of " +
                    std::to_string(calibration.delay_s) +
                    " s no two frames lie within the gyro's time: is it of another recording, "
                    "with other clocks?");
  }
  return {};
}

std::vector<Eigen::Quaterniond> SmoothOrientations(const CameraPath& path, double middle_row_px,
                                                   double smooth_s) {
  std::vector<double> times;
  std::vector<Eigen::Quaterniond> measured;
  for (int frame = path.first_frame(); frame <= path.last_frame(); ++frame) {
    times.push_back(path.RowTime(frame, middle_row_px));
    measured.emplace_back(path.R_world_cam(times.back()));
  }
  if (!(smooth_s > 0.0)) return measured;
  std::vector<Eigen::Quaterniond> smooth = measured;
  const size_t count = measured.size();
  // The mean is the orientation about which the weighted rotation vectors cancel; two steps towards
  // it leave less than 1 mrad of half a turn.
  for (int step = 0; step < 2; ++step) {
    for (size_t i = 0, first = 0; i < count; ++i) {
      while (times[i] - times[first] > 3.0 * smooth_s) ++first;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double weights = 0.0;
      for (size_t k = first; k < count && times[k] - times[i] <= 3.0 * smooth_s; ++k) {
        const double distance = (times[k] - times[i]) / smooth_s;
        const double weight = std::exp(-0.5 * distance * distance);
        sum += weight * Log<double>(smooth[i].conjugate() * measured[k]);
        weights += weight;
      }
      smooth[i] = smooth[i] * Exp<double>(sum / weights);
    }
  }
  return smooth;
}

}  // namespace camgyro
