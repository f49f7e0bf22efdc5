#include "frontend/gyro_rotation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/gyro_gap.h"
#include "core/lens.h"
#include "core/pair_model.h"
#include "core/robust_statistics.h"
#include "core/time.h"

namespace camgyro {
namespace {

constexpr int kRowIterations = 3;  // the row of arrival decides over its own time

// The median interval of the samples around a pair; the others cost time and say the same.
double IntervalAround(const std::vector<GyroSample>& gyro, size_t first, size_t last) {
  constexpr size_t kAround = 25;
  std::vector<double> intervals;
  const size_t end = std::min(gyro.size(), last + kAround);
  for (size_t i = std::max(first, kAround) - kAround; i + 1 < end; ++i) {
    intervals.push_back(SecondsSince(gyro[i].stamp_ns, gyro[i + 1].stamp_ns));
  }
  return MedianOr(std::move(intervals), 0.0);
}

}  // namespace

GyroRotation::GyroRotation(const Calibration& calibration, RotationChain chain, double interval_s)
    : calibration_(calibration),
      chain_(std::move(chain)),
      R_gyro_cam_(calibration.q_gyro_cam.toRotationMatrix()),
      interval_s_(interval_s) {}

std::optional<GyroRotation> GyroRotation::Between(const std::vector<GyroSample>& gyro,
                                                  const Calibration& calibration,
                                                  int64_t stamp_a_ns, int64_t stamp_b_ns) {
  const double first_s = calibration.delay_s + std::min(0.0, calibration.readout_s);
  const double last_s = calibration.delay_s + std::max(0.0, calibration.readout_s);
  const auto after = [](int64_t stamp_ns, const GyroSample& sample) {
    return stamp_ns < sample.stamp_ns;
  };
  auto begin = std::upper_bound(gyro.begin(), gyro.end(), StampAt(stamp_a_ns, first_s), after);
  const auto end = std::upper_bound(begin, gyro.end(), StampAt(stamp_b_ns, last_s), after);
  if (begin == gyro.begin() || end == gyro.end()) return std::nullopt;
  --begin;
  const double longest_step_s = LongestGyroStep(IntervalAround(
      gyro, static_cast<size_t>(begin - gyro.begin()), static_cast<size_t>(end - gyro.begin())));

  std::vector<double> times_s;
  Eigen::Matrix3Xd omega(3, end - begin + 1);
  for (auto it = begin; it <= end; ++it) {
    omega.col(it - begin) = it->omega_gyro_rad_s - calibration.bias_gyro_rad_s;
    times_s.push_back(SecondsSince(stamp_a_ns, it->stamp_ns));
    if (times_s.size() > 1 && times_s.back() - times_s[times_s.size() - 2] > longest_step_s) {
      return std::nullopt;
    }
  }
  return GyroRotation(calibration, RotationChain(times_s, omega),
                      SecondsSince(stamp_a_ns, stamp_b_ns));
}

Eigen::Vector2d GyroRotation::Predict(const Eigen::Vector2d& px_a) const {
  const Eigen::Vector2d no_idea =
      Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Lens& lens = GetLens(calibration_.distortion_model);
  const ShutterParameters shutter = ShutterOf(calibration_);
  Bearing bearing;
  if (!EvaluateBearing(lens, calibration_.lens, shutter, R_gyro_cam_, chain_, 0.0,
                       calibration_.height_px, px_a, &bearing, LensDerivatives::kNone)) {
    return no_idea;
  }
  Eigen::Vector2d px_b = px_a;
  for (int i = 0; i < kRowIterations; ++i) {
    const double row = std::clamp(px_b.y(), 0.0, static_cast<double>(calibration_.height_px));
    const RotationChain::State state =
        chain_.At(RowTimeGyroS(interval_s_, shutter, row, calibration_.height_px));
    const std::optional<Eigen::Vector2d> projected = lens.Project(
        (state.R_ref_gyro * R_gyro_cam_).transpose() * bearing.ray_ref, calibration_.lens);
    if (!projected) return no_idea;
    px_b = *projected;
  }
  return px_b;
}

std::optional<RotatedMatch> GyroRotation::Rotate(const Match& match) const {
  const Lens& lens = GetLens(calibration_.distortion_model);
  const ShutterParameters shutter = ShutterOf(calibration_);
  Bearing a, b;
  const auto evaluate = [&](double frame_time_s, const Eigen::Vector2d& px, Bearing* bearing) {
    return EvaluateBearing(lens, calibration_.lens, shutter, R_gyro_cam_, chain_, frame_time_s,
                           calibration_.height_px, px, bearing, LensDerivatives::kNone);
  };
  if (!evaluate(0.0, match.px_a, &a) || !evaluate(interval_s_, match.px_b, &b)) return std::nullopt;
  return RotatedMatch{a.ray_ref, b.ray_ref, a.J_ray_px, b.J_ray_px};
}

Eigen::Matrix3d GyroRotation::MiddleRow(double frame_time_s) const {
  const double height_px = calibration_.height_px;
  const double time_s =
      RowTimeGyroS(frame_time_s, ShutterOf(calibration_), 0.5 * height_px, height_px);
  return chain_.At(time_s).R_ref_gyro * R_gyro_cam_;
}

Eigen::Matrix3d GyroRotation::BetweenMiddleRows() const {
  return MiddleRow(0.0).transpose() * MiddleRow(interval_s_);
}

std::optional<RotatedMatch> GyroRotation::Unroll(const Match& match) const {
  std::optional<RotatedMatch> seen = Rotate(match);
  if (!seen) return std::nullopt;
  const auto turn = [this](double frame_time_s, Eigen::Vector3d* ray,
                           Eigen::Matrix<double, 3, 2>* J_ray_px) {
    const Eigen::Matrix3d R_cam_ref = MiddleRow(frame_time_s).transpose();
    const Eigen::Vector3d turned = R_cam_ref * *ray;
    const Eigen::Matrix<double, 3, 2> J_turned_px = R_cam_ref * *J_ray_px;
    *ray = turned / turned.z();
    *J_ray_px = (J_turned_px - *ray * J_turned_px.row(2)) / turned.z();
    return turned.z() > 0.0;
  };
  if (!turn(0.0, &seen->a, &seen->J_a_px) || !turn(interval_s_, &seen->b, &seen->J_b_px)) {
    return std::nullopt;
  }
  return seen;
}

}  // namespace camgyro
