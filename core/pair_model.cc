#include "core/pair_model.h"

#include <algorithm>
#include <limits>

#include "core/so3.h"

namespace camgyro {

namespace {

// What effects add to the delay at a pixel [s].
double TimeChange(const PairEffects& effects, const Observation& observation) {
  if (effects.set == nullptr) return 0.0;
  EffectSet::Change change;
  effects.set->ChangeObservation(observation, &change);
  return change.time.row(0).dot(
      Eigen::Map<const Eigen::VectorXd>(effects.values, effects.set->size()));
}

}  // namespace

std::pair<double, double> ExposureSpan(const ShutterParameters& shutter,
                                       const Eigen::Vector2d& size_px, const PairEffects& effects,
                                       const FrameTime& frame_a, const FrameTime& frame_b) {
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (const FrameTime& frame : {frame_a, frame_b}) {
    for (const Eigen::Vector2d& part : {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(1.0, 0.0),
                                        Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(1.0, 1.0)}) {
      const Eigen::Vector2d px = part.cwiseProduct(size_px);
      const double time_s = RowTimeGyroS(frame.stamp_s + frame.offset_s, shutter, part.y(), 1.0) +
                            TimeChange(effects, {px, size_px, frame});
      first = std::min(first, time_s);
      last = std::max(last, time_s);
    }
  }
  return {first, last};
}

Scan ScanOf(const ShutterParameters& shutter, const Eigen::Vector2d& size_px,
            const PairEffects& effects, const FrameTime& frame) {
  const double rows_s = shutter[kReadout];
  const double columns_s = TimeChange(effects, {{size_px.x(), 0.5 * size_px.y()}, size_px, frame}) -
                           TimeChange(effects, {{0.0, 0.5 * size_px.y()}, size_px, frame});
  if (std::abs(columns_s) > std::abs(rows_s)) return {columns_s, {1.0, rows_s / columns_s}};
  if (rows_s == 0.0) return {};
  return {rows_s, {columns_s / rows_s, 1.0}};
}

double ColumnReadoutOf(const Calibration& calibration) {
  const Scan scan =
      ScanOf(ShutterOf(calibration), Eigen::Vector2d(calibration.width_px, calibration.height_px),
             calibration.pair_effects(), FrameTime());
  return scan.readout_s * scan.shares.x();
}

Eigen::Vector3d TrueRate(const PairEffects& effects, double time_gyro_s,
                         const Eigen::Vector3d& reading_less_bias) {
  if (effects.set == nullptr) return reading_less_bias;
  Eigen::Matrix3Xd columns(3, effects.set->size());
  Eigen::Vector3d rate = reading_less_bias;
  for (int iteration = 0; iteration < 3; ++iteration) {  // the change depends on the rate, weakly
    rate = reading_less_bias - effects.set->ChangeRate(time_gyro_s, rate, effects.values, columns);
  }
  return rate;
}

namespace {

// The part of a bearing that lens, shutter and effects make; time_s: of exposure.
bool ExposePixel(const Lens& lens_model, const LensParameters& lens,
                 const ShutterParameters& shutter, const FrameTime& frame,
                 const Eigen::Vector2d& size_px, const Eigen::Vector2d& px,
                 const PairEffects& effects, LensDerivatives by_lens, Bearing* b, double* time_s) {
  const double height_px = size_px.y();
  b->row_fraction = px.y() / height_px;
  b->J_time_px << 0.0, shutter[kReadout] / height_px;
  LensParameters lens_here = lens;
  *time_s = RowTimeGyroS(frame.stamp_s + frame.offset_s, shutter, px.y(), height_px);
  if (effects.set != nullptr) {
    effects.set->ChangeObservation({px, size_px, frame}, &b->change);
    const Eigen::Map<const Eigen::VectorXd> values(effects.values, effects.set->size());
    // Few columns: lazy products do without the set-up of large ones.
    lens_here += b->change.lens.lazyProduct(values);
    const Eigen::Vector3d change = b->change.time.lazyProduct(values);
    *time_s += change[0];
    b->J_time_px += change.tail<2>().transpose();
  }
  if (!lens_model.Unproject(px, lens_here, &b->lens_ray, by_lens)) return false;
  if (b->change.lens_slope[0].cols() > 0 && by_lens == LensDerivatives::kAll) {
    const Eigen::Map<const Eigen::VectorXd> values(effects.values, effects.set->size());
    for (int k = 0; k < 2; ++k) {
      b->lens_ray.J_ray_px.col(k) +=
          b->lens_ray.J_ray_lens * (b->change.lens_slope[static_cast<size_t>(k)] * values);
    }
  }
  return true;
}

// The rest of it, which the camera's motion makes.
void Turn(double time_s, const Eigen::Matrix3d& R_gyro_cam, const RotationChain& chain,
          Bearing* b) {
  chain.At(time_s, &b->rotation);
  b->R_ref_cam = b->rotation.R_ref_gyro * R_gyro_cam;
  b->omega_cam_rad_s = R_gyro_cam.transpose() * b->rotation.omega_gyro_rad_s;
  b->ray_ref = b->R_ref_cam * b->lens_ray.ray;
  // A pixel further down is exposed later, when the camera has turned a little more.
  const Eigen::Matrix<double, 3, 2> J_cam =
      b->lens_ray.J_ray_px + b->omega_cam_rad_s.cross(b->lens_ray.ray) * b->J_time_px;
  b->J_ray_px = b->R_ref_cam * J_cam;
  b->noise_factor.setIdentity();
}

}  // namespace

bool EvaluateBearing(const Lens& lens_model, const LensParameters& lens,
                     const ShutterParameters& shutter, const Eigen::Matrix3d& R_gyro_cam,
                     const RotationChain& chain, const FrameTime& frame,
                     const Eigen::Vector2d& size_px, const Eigen::Vector2d& px,
                     const PairEffects& effects, Bearing* b, LensDerivatives by_lens) {
  double time_s = 0.0;
  if (!ExposePixel(lens_model, lens, shutter, frame, size_px, px, effects, by_lens, b, &time_s)) {
    return false;
  }
  Turn(time_s, R_gyro_cam, chain, b);
  return true;
}

bool EvaluateTimedRay(const Lens& lens_model, const LensParameters& lens,
                      const ShutterParameters& shutter, const FrameTime& frame,
                      const Eigen::Vector2d& size_px, const Eigen::Vector2d& px,
                      const PairEffects& effects, TimedRay* timed) {
  Bearing b;
  if (!ExposePixel(lens_model, lens, shutter, frame, size_px, px, effects, LensDerivatives::kNone,
                   &b, &timed->time_gyro_s)) {
    return false;
  }
  timed->ray = b.lens_ray.ray;
  timed->J_ray_px = b.lens_ray.J_ray_px;
  timed->J_time_px = b.J_time_px;
  return true;
}

void TurnRay(const TimedRay& timed, double later_s, const Eigen::Matrix3d& R_gyro_cam,
             const RotationChain& chain, Bearing* b) {
  b->lens_ray.ray = timed.ray;
  b->lens_ray.J_ray_px = timed.J_ray_px;
  b->lens_ray.num_lens = 0;
  b->J_time_px = timed.J_time_px;
  Turn(timed.time_gyro_s + later_s, R_gyro_cam, chain, b);
}

void Bearing::ScaleNoise(const Eigen::Vector3d& factor) {
  noise_factor << factor[0], 0.0, factor[1], factor[2];
  J_ray_px *= noise_factor;
}

double ByTime(const Bearing& b, const Eigen::Vector3d& by_ray,
              const Eigen::Matrix<double, 3, 2>& by_J_ray_px) {
  const Eigen::Vector3d by_phi = b.ray_ref.cross(by_ray) +
                                 b.J_ray_px.col(0).cross(by_J_ray_px.col(0)) +
                                 b.J_ray_px.col(1).cross(by_J_ray_px.col(1));
  const Eigen::Vector3d by_J_time = b.R_ref_cam.transpose() *
                                    (by_J_ray_px * b.noise_factor.transpose()) *
                                    b.J_time_px.transpose();  // by omega x ray, camera frame
  const Eigen::Vector3d by_omega =
      b.rotation.R_ref_gyro.transpose() * (b.R_ref_cam * b.lens_ray.ray.cross(by_J_time));
  return by_phi.dot(b.rotation.PhiPerSecond()) + by_omega.dot(b.rotation.alpha_gyro_rad_s2);
}

void Backpropagate(const Bearing& b, const RotationChain& chain, double height_px,
                   const Eigen::Vector3d& by_ray, const Eigen::Matrix<double, 3, 2>& by_J_ray_px,
                   PairGradient* gradient, RotationChain::RateGradient by_rates) {
  const Eigen::Vector3d& ray = b.lens_ray.ray;
  const Eigen::Vector3d& omega = b.omega_cam_rad_s;
  // In the camera frame at the time of exposure.
  const Eigen::Vector3d by_ray_cam = b.R_ref_cam.transpose() * by_ray;
  const Eigen::Matrix<double, 3, 2> by_J_cam =
      b.R_ref_cam.transpose() * by_J_ray_px * b.noise_factor.transpose();
  const Eigen::Vector3d by_J_time = by_J_cam * b.J_time_px.transpose();  // by omega x ray

  // Lens: through the ray (which also enters the row-time part of J) and through J_ray_px.
  const Eigen::Vector3d by_lens_ray = by_ray_cam + by_J_time.cross(omega);
  Eigen::Matrix<double, 1, kLensSize> by_lens = Eigen::Matrix<double, 1, kLensSize>::Zero();
  for (int k = 0; k < b.lens_ray.num_lens; ++k) {
    by_lens[k] = by_lens_ray.dot(b.lens_ray.J_ray_lens.col(k)) +
                 b.lens_ray.J_ray_px_lens[k].cwiseProduct(by_J_cam).sum();
  }
  gradient->by_lens += by_lens;

  // q_gyro_cam, right perturbation: ray and J_ray_px turn in the camera frame, omega_gyro stays.
  const Eigen::Vector3d by_J0 = by_J_cam.col(0), by_J1 = by_J_cam.col(1);
  const Eigen::Vector3d J0 = b.lens_ray.J_ray_px.col(0), J1 = b.lens_ray.J_ray_px.col(1);
  gradient->by_rotation += (ray.cross(by_lens_ray) + J0.cross(by_J0) + J1.cross(by_J1)).transpose();

  // Orientation at the exposure (left perturbation in the reference) and rate at the exposure.
  const Eigen::Vector3d by_phi = b.ray_ref.cross(by_ray) +
                                 b.J_ray_px.col(0).cross(by_J_ray_px.col(0)) +
                                 b.J_ray_px.col(1).cross(by_J_ray_px.col(1));
  const Eigen::Vector3d by_omega_cam = ray.cross(by_J_time);
  const Eigen::Matrix3d R_gyro_cam = b.rotation.R_ref_gyro.transpose() * b.R_ref_cam;
  const Eigen::Vector3d by_omega = R_gyro_cam * by_omega_cam;

  // Time of exposure, then delay and readout; the readout also scales the row-time part of J.
  const double by_time =
      by_phi.dot(b.rotation.PhiPerSecond()) + by_omega.dot(b.rotation.alpha_gyro_rad_s2);
  const Eigen::RowVector2d by_slope = omega.cross(ray).transpose() * by_J_cam;
  gradient->by_shutter[kDelay] += by_time;
  gradient->by_shutter[kReadout] += by_time * b.row_fraction + by_slope.y() / height_px;

  if (b.change.lens.cols() > 0) {
    if (gradient->by_effects.size() == 0) gradient->by_effects.setZero(b.change.lens.cols());
    const Eigen::RowVector3d by_times(by_time, by_slope.x(), by_slope.y());
    gradient->by_effects += by_lens.lazyProduct(b.change.lens);
    gradient->by_effects += by_times.lazyProduct(b.change.time);
    for (int k = 0; k < 2 && b.change.lens_slope[0].cols() > 0; ++k) {
      gradient->by_effects += (by_J_cam.col(k).transpose() * b.lens_ray.J_ray_lens) *
                              b.change.lens_slope[static_cast<size_t>(k)];
    }
  }

  chain.AddRateGradient(b.rotation, by_phi, by_omega, by_rates);
}

}  // namespace camgyro
