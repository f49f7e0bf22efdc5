#include "core/pair_model.h"

#include "core/so3.h"

namespace camgyro {

bool EvaluateBearing(const Lens& lens_model, const LensParameters& lens,
                     const ShutterParameters& shutter, const Eigen::Matrix3d& R_gyro_cam,
                     const RotationChain& chain, double frame_time_s, double height_px,
                     const Eigen::Vector2d& px, Bearing* b, bool derivatives) {
  if (!lens_model.Unproject(px, lens, &b->lens_ray, derivatives)) return false;
  b->row_fraction = px.y() / height_px;
  b->line_delay_s = shutter[kReadout] / height_px;
  b->rotation = chain.At(RowTimeGyroS(frame_time_s, shutter, px.y(), height_px));
  b->R_ref_cam = b->rotation.R_ref_gyro * R_gyro_cam;
  b->omega_cam_rad_s = R_gyro_cam.transpose() * b->rotation.omega_gyro_rad_s;
  b->ray_ref = b->R_ref_cam * b->lens_ray.ray;
  // A pixel further down is exposed line_delay later, when the camera has turned a little more.
  Eigen::Matrix<double, 3, 2> J_cam = b->lens_ray.J_ray_px;
  J_cam.col(1) += b->line_delay_s * b->omega_cam_rad_s.cross(b->lens_ray.ray);
  b->J_ray_px = b->R_ref_cam * J_cam;
  return true;
}

void Backpropagate(const Bearing& b, const RotationChain& chain, double height_px,
                   const Eigen::Vector3d& by_ray, const Eigen::Matrix<double, 3, 2>& by_J_ray_px,
                   PairGradient* gradient, Eigen::Ref<Eigen::Matrix3Xd> by_rates) {
  const Eigen::Vector3d& ray = b.lens_ray.ray;
  const Eigen::Vector3d& omega = b.omega_cam_rad_s;
  // In the camera frame at the time of exposure.
  const Eigen::Vector3d by_ray_cam = b.R_ref_cam.transpose() * by_ray;
  const Eigen::Matrix<double, 3, 2> by_J_cam = b.R_ref_cam.transpose() * by_J_ray_px;
  const Eigen::Vector3d by_J1 = by_J_cam.col(1);

  // Lens: through the ray (which also enters the row-time part of J) and through J_ray_px.
  const Eigen::Vector3d by_lens_ray = by_ray_cam + b.line_delay_s * by_J1.cross(omega);
  gradient->by_lens += by_lens_ray.transpose() * b.lens_ray.J_ray_lens;
  for (int k = 0; k < kLensSize; ++k) {
    gradient->by_lens[k] += b.lens_ray.J_ray_px_lens[k].cwiseProduct(by_J_cam).sum();
  }

  // q_gyro_cam, right perturbation: ray and J_ray_px turn in the camera frame, omega_gyro stays.
  const Eigen::Vector3d by_J0 = by_J_cam.col(0);
  const Eigen::Vector3d J0 = b.lens_ray.J_ray_px.col(0), J1 = b.lens_ray.J_ray_px.col(1);
  gradient->by_rotation += (ray.cross(by_lens_ray) + J0.cross(by_J0) + J1.cross(by_J1)).transpose();

  // Orientation at the exposure (left perturbation in the reference) and rate at the exposure.
  const Eigen::Vector3d by_phi = b.ray_ref.cross(by_ray) +
                                 b.J_ray_px.col(0).cross(by_J_ray_px.col(0)) +
                                 b.J_ray_px.col(1).cross(by_J_ray_px.col(1));
  const Eigen::Vector3d by_omega_cam = b.line_delay_s * ray.cross(by_J1);
  const Eigen::Matrix3d R_gyro_cam = b.rotation.R_ref_gyro.transpose() * b.R_ref_cam;
  const Eigen::Vector3d by_omega = R_gyro_cam * by_omega_cam;

  // Time of exposure, then delay and readout; the readout also scales the row-time part of J.
  const double by_time =
      by_phi.dot(b.rotation.PhiPerSecond()) + by_omega.dot(b.rotation.alpha_gyro_rad_s2);
  gradient->by_shutter[kDelay] += by_time;
  gradient->by_shutter[kReadout] +=
      by_time * b.row_fraction + by_J1.dot(omega.cross(ray)) / height_px;

  chain.AddRateGradient(b.rotation, by_phi, by_omega, by_rates);
}

}  // namespace camgyro
