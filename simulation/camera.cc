#include "simulation/camera.h"

#include <algorithm>
#include <cmath>

#include "core/so3.h"

namespace camgyro::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kHighPassStep = 1e-3;   // [s]; the Hermite interpolant errs by < 1e-11 rad
constexpr double kHighPassStart = -1.0;  // [s]

// Kannala & Brandt 2006, odd polynomial of the angle from the axis, as OpenCV's fisheye.
double KannalaBrandt(double angle, const RadialDistortion& k, double* slope) {
  const double a2 = angle * angle;
  *slope = 1.0 + a2 * (3.0 * k.k1 + a2 * (5.0 * k.k2 + a2 * (7.0 * k.k3 + a2 * 9.0 * k.k4)));
  return angle * (1.0 + a2 * (k.k1 + a2 * (k.k2 + a2 * (k.k3 + a2 * k.k4))));
}

}  // namespace

SimulatedCamera::SimulatedCamera(const Scenario& scenario,
                                 std::shared_ptr<const Trajectory> trajectory)
    : scenario_(scenario), trajectory_(std::move(trajectory)) {
  const CameraOptions& camera = scenario_.camera;
  const Effects& effects = scenario_.effects;
  const Vector2d centre(0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1));
  lens_ = MakePinhole(camera.focal_px, camera.principal_px.value_or(centre),
                      effects.aspect_ratio.ratio);
  if (!effects.radial_distortion.kannala_brandt) {
    lens_[kK1] = effects.radial_distortion.k1;
    lens_[kK2] = effects.radial_distortion.k2;
    lens_[kP1] = effects.tangential_distortion.p1;
    lens_[kP2] = effects.tangential_distortion.p2;
  }

  if (effects.optical_stabilisation.gain != 0.0) {
    // angle' = omega - a angle: exact decay, Simpson's rule for the input.
    const double a = 2.0 * M_PI * effects.optical_stabilisation.corner_hz, h = kHighPassStep;
    const double whole = std::exp(-a * h), half = std::exp(-0.5 * a * h);
    const double end_s = scenario_.duration_s + 2.0 * scenario_.margin_s + 1.0;
    Vector2d angle = Vector2d::Zero();
    Vector2d omega = trajectory_->At(kHighPassStart).omega_cam_rad_s.head<2>();
    for (double t = kHighPassStart; t < end_s; t += h) {
      high_passed_.push_back({angle, omega - a * angle});
      const Vector2d middle = trajectory_->At(t + 0.5 * h).omega_cam_rad_s.head<2>();
      const Vector2d next = trajectory_->At(t + h).omega_cam_rad_s.head<2>();
      angle = whole * angle + h / 6.0 * (whole * omega + 4.0 * half * middle + next);
      // At its stop the lens waits for the camera to turn back.
      const double travel_rad = effects.optical_stabilisation.travel_rad;
      if (travel_rad > 0.0 && angle.norm() > travel_rad) angle *= travel_rad / angle.norm();
      omega = next;
    }
  }
}

double SimulatedCamera::Focal(double time_s) const {
  double focal_px = lens_[kFocal];
  scenario_.effects.ForEach(
      [&](const auto& effect) { CallAddFocal(effect, time_s, &focal_px, 0); });
  return focal_px;
}

// The lens group moves against the rotation: a turn by +theta_y moves the picture by -f theta_y in
// u, a turn by +theta_x by +f theta_x in v.
Vector2d SimulatedCamera::StabiliserShift(double time_s) const {
  Vector2d logged_px = Vector2d::Zero();
  if (const double scale = scenario_.effects.optical_stabilisation.logged_px; scale != 0.0) {
    logged_px = scale * scenario_.log->LensShiftAt(time_s);
  }
  if (high_passed_.empty()) return logged_px;
  const double position = std::clamp((time_s - kHighPassStart) / kHighPassStep, 0.0,
                                     static_cast<double>(high_passed_.size()) - 2.0);
  const auto index = static_cast<size_t>(position);
  const double u = position - static_cast<double>(index);
  const HighPassed &a = high_passed_[index], &b = high_passed_[index + 1];
  const Vector2d angle =
      (1.0 - u) * (1.0 - u) * ((1.0 + 2.0 * u) * a.angle_rad + u * kHighPassStep * a.rate_rad_s) +
      u * u * ((3.0 - 2.0 * u) * b.angle_rad - (1.0 - u) * kHighPassStep * b.rate_rad_s);
  const double shift_px = scenario_.effects.optical_stabilisation.gain * lens_[kFocal];
  return logged_px + Vector2d(shift_px * lens_[kAspect] * angle.y(), -shift_px * angle.x());
}

LensParameters SimulatedCamera::LensAt(double time_s) const {
  LensParameters lens = lens_;
  lens[kFocal] = Focal(time_s);
  lens.segment<2>(kCx) += StabiliserShift(time_s);
  return lens;
}

// Mean orientation over a Gaussian window, in the tangent at its centre.
Matrix3d SimulatedCamera::SmoothedOrientation(double time_s) const {
  const double sigma_s = scenario_.effects.electronic_stabilisation.smoothing_s;
  const Matrix3d centre = trajectory_->At(time_s).R_world_cam;
  Vector3d sum = Vector3d::Zero();
  double total = 0.0;
  for (int i = -15; i <= 15; ++i) {
    const double x = 0.2 * i;  // in sigmas
    const double weight = std::exp(-0.5 * x * x);
    const Matrix3d R = trajectory_->At(time_s + x * sigma_s).R_world_cam;
    sum += weight * Log(Eigen::Quaterniond(centre.transpose() * R));
    total += weight;
  }
  return centre * Exp(Vector3d(sum / total)).toRotationMatrix();
}

FrameTiming SimulatedCamera::MakeFrame(double stamp_s, double exposure_s) const {
  FrameTiming frame;
  frame.stamp_s = stamp_s;
  frame.exposure_s = exposure_s;
  frame.R_world_virtual = Matrix3d::Identity();
  if (stabilises()) {
    const CameraOptions& camera = scenario_.camera;
    const Vector2d centre(0.5 * camera.width_px, 0.5 * camera.height_px);
    frame.R_world_virtual = SmoothedOrientation(ExposureTime(frame, centre));
  }
  return frame;
}

double SimulatedCamera::Delay(const FrameTiming& frame) const {
  double delay_s = scenario_.camera.delay_s;
  const FrameClock clock = {frame.stamp_s + delay_s, frame.exposure_s};
  scenario_.effects.ForEach([&](const auto& effect) { CallAddDelay(effect, clock, &delay_s, 0); });
  return delay_s;
}

double SimulatedCamera::ExposureTime(const FrameTiming& frame, const Vector2d& px) const {
  const CameraOptions& camera = scenario_.camera;
  const ReadoutDirection& direction = scenario_.effects.readout_direction;
  const double s = direction.columns ? px.x() / camera.width_px : px.y() / camera.height_px;
  const double curved = s + 4.0 * scenario_.effects.readout_nonlinear.curve * s * (1.0 - s);
  const double readout_s = direction.reversed ? -camera.readout_s : camera.readout_s;
  return frame.stamp_s + Delay(frame) + readout_s * curved;
}

Eigen::RowVector2d SimulatedCamera::ExposureSlope(const Vector2d& px) const {
  const CameraOptions& camera = scenario_.camera;
  const ReadoutDirection& direction = scenario_.effects.readout_direction;
  const double s = direction.columns ? px.x() / camera.width_px : px.y() / camera.height_px;
  const double readout_s = direction.reversed ? -camera.readout_s : camera.readout_s;
  const double slope =
      readout_s * (1.0 + 4.0 * scenario_.effects.readout_nonlinear.curve * (1.0 - 2.0 * s));
  return direction.columns ? Eigen::RowVector2d(slope / camera.width_px, 0.0)
                           : Eigen::RowVector2d(0.0, slope / camera.height_px);
}

std::optional<Vector2d> SimulatedCamera::Project(const Vector3d& point_cam, double time_s) const {
  const LensParameters lens = LensAt(time_s);
  const RadialDistortion& distortion = scenario_.effects.radial_distortion;
  if (!distortion.kannala_brandt) {
    return GetLens(DistortionModel::kRadTan).Project(point_cam, lens);
  }
  if (!(point_cam.z() > 0.0)) return std::nullopt;
  const double radius = point_cam.head<2>().norm();
  double slope;
  const double angle = KannalaBrandt(std::atan2(radius, point_cam.z()), distortion, &slope);
  if (!(slope > 0.0)) return std::nullopt;
  const double scale = radius > 1e-12 ? angle / radius : 1.0 / point_cam.z();
  return Vector2d(lens[kFocal] * lens[kAspect] * scale * point_cam.x() + lens[kCx],
                  lens[kFocal] * scale * point_cam.y() + lens[kCy]);
}

std::optional<Vector3d> SimulatedCamera::Unproject(const Vector2d& px, double time_s) const {
  const LensParameters lens = LensAt(time_s);
  const RadialDistortion& distortion = scenario_.effects.radial_distortion;
  if (!distortion.kannala_brandt) {
    RayJet jet;
    if (!GetLens(DistortionModel::kRadTan).Unproject(px, lens, &jet)) return std::nullopt;
    return jet.ray;
  }
  const Vector2d m((px.x() - lens[kCx]) / (lens[kFocal] * lens[kAspect]),
                   (px.y() - lens[kCy]) / lens[kFocal]);
  const double target = m.norm();
  double angle = target, slope = 1.0;
  for (int i = 0; i < 30; ++i) {
    const double error = target - KannalaBrandt(angle, distortion, &slope);
    if (std::abs(error) < 1e-14) break;
    if (!(slope > 0.0)) return std::nullopt;
    angle += error / slope;
  }
  if (!(slope > 0.0) || !(angle >= 0.0) || angle > 1.5) return std::nullopt;
  const double scale = target > 1e-12 ? std::tan(angle) / target : 1.0;
  return Vector3d(scale * m.x(), scale * m.y(), 1.0);
}

// Gauss-Legendre, 3 points.
std::optional<Vector2d> SimulatedCamera::MeanOverExposure(
    const FrameTiming& frame, const std::function<Vector3d(double)>& point_world,
    const Vector2d& px, double time_s) const {
  const double factor = scenario_.effects.exposure_lowpass.factor;
  if (!(factor > 0.0)) return px;
  const double offset_s = 0.5 * factor * frame.exposure_s * std::sqrt(0.6);
  Vector2d sum = 8.0 * px;
  for (const double at_s : {time_s - offset_s, time_s + offset_s}) {
    const CameraState state = trajectory_->At(at_s);
    const std::optional<Vector2d> there =
        Project(state.R_world_cam.transpose() * (point_world(at_s) - state.p_world_m), at_s);
    if (!there) return std::nullopt;
    sum += 5.0 * *there;
  }
  return sum / 18.0;
}

std::optional<SimulatedCamera::Observation> SimulatedCamera::Observe(
    const FrameTiming& frame, const std::function<Vector3d(double)>& point_world) const {
  const CameraOptions& camera = scenario_.camera;
  double time_s = ExposureTime(frame, {0.5 * camera.width_px, 0.5 * camera.height_px});
  for (int i = 0; i < 30; ++i) {
    const CameraState state = trajectory_->At(time_s);
    const Vector3d point = state.R_world_cam.transpose() * (point_world(time_s) - state.p_world_m);
    const std::optional<Vector2d> px = Project(point, time_s);
    if (!px) return std::nullopt;
    const double exposed_s = ExposureTime(frame, *px);
    if (std::abs(exposed_s - time_s) < 1e-13) {
      const std::optional<Vector2d> seen = MeanOverExposure(frame, point_world, *px, exposed_s);
      if (!seen || !InPicture(*seen)) return std::nullopt;
      return Observation{*seen, *seen - *px, exposed_s, point.z()};
    }
    // Newton's method with the motion of a static point through a pinhole: what this neglects
    // costs iterations, not accuracy.
    const Vector3d velocity =
        point.cross(state.omega_cam_rad_s) - state.R_world_cam.transpose() * state.v_world_m_s;
    const Vector2d motion = camera.focal_px / point.z() *
                            (velocity.head<2>() - point.head<2>() * velocity.z() / point.z());
    const double slope = 1.0 - ExposureSlope(*px) * motion;
    time_s += (exposed_s - time_s) / (slope > 0.3 ? slope : 1.0);
  }
  return std::nullopt;
}

// From the camera at `time_s` into the stabilised picture's orientation.
Matrix3d SimulatedCamera::Correction(const FrameTiming& frame, double time_s) const {
  const Matrix3d R_virtual_cam =
      frame.R_world_virtual.transpose() * trajectory_->At(time_s).R_world_cam;
  const double strength = scenario_.effects.electronic_stabilisation.strength;
  return Exp(Vector3d(strength * Log(Eigen::Quaterniond(R_virtual_cam)))).toRotationMatrix();
}

std::optional<Vector2d> SimulatedCamera::Stabilise(const FrameTiming& frame,
                                                   const Vector2d& sensor_px) const {
  if (!stabilises()) return sensor_px;
  const double time_s = ExposureTime(frame, sensor_px);
  const std::optional<Vector3d> ray = Unproject(sensor_px, time_s);
  if (!ray) return std::nullopt;
  return Project(Correction(frame, time_s) * *ray, time_s);
}

std::optional<Vector2d> SimulatedCamera::Destabilise(const FrameTiming& frame,
                                                     const Vector2d& picture_px) const {
  if (!stabilises()) return picture_px;
  Vector2d sensor_px = picture_px;
  for (int i = 0; i < 50; ++i) {
    const double time_s = ExposureTime(frame, sensor_px);
    const std::optional<Vector3d> ray = Unproject(picture_px, time_s);
    if (!ray) return std::nullopt;
    const std::optional<Vector2d> next =
        Project(Correction(frame, time_s).transpose() * *ray, time_s);
    if (!next) return std::nullopt;
    const double step_px = (*next - sensor_px).norm();
    sensor_px = *next;
    if (step_px < 1e-9) return sensor_px;
  }
  return std::nullopt;
}

bool SimulatedCamera::InPicture(const Vector2d& px) const {
  return px.x() >= 0.0 && px.y() >= 0.0 && px.x() <= scenario_.camera.width_px - 1 &&
         px.y() <= scenario_.camera.height_px - 1;
}

}  // namespace camgyro::simulation
