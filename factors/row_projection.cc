#include "factors/row_projection.h"

#include <ceres/autodiff_cost_function.h>
#include <glog/logging.h>

#include <Eigen/LU>

#include "core/calibration.h"
#include "core/so3.h"

namespace camgyro {
namespace {

class RowProjection {
 public:
  explicit RowProjection(const RowProjectionMeasurement& m)
      : m_(m), px_per_ray_(m.ray.J_ray_px.topRows<2>().inverse() / m.sigma_px) {
    CHECK_GT(m.sigma_px, 0.0);
  }

  template <typename T>
  bool operator()(const T* q, const T* p, const T* v, const T* gravity, const T* arm,
                  const T* calibration, const T* point, T* residual) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Vector2 = Eigen::Matrix<T, 2, 1>;
    using Quaternion = Eigen::Quaternion<T>;
    const Eigen::Map<const Quaternion> Q(q);
    const Eigen::Map<const Vector3> P(p), V(v), up(gravity), p_gyro_cam(arm), X(point),
        db_g(calibration + kStateBias), dq(calibration + kStateRotation);
    const ImuDelta& d = m_.node_to_row;
    const T dt = calibration[kStateDelay] + calibration[kStateReadout] * T(m_.row_fraction);
    const T span(d.dt_s);
    const Vector3 g = up * T(m_.gravity_m_s2);
    const Quaternion q_w_gyro = Q * (d.q_i_j.cast<T>() * Exp(Vector3(d.J_rot_bias_gyro * db_g)) *
                                     Exp(Vector3(m_.omega_gyro_rad_s.cast<T>() * dt)));
    const Vector3 velocity = V + g * span + Q * Vector3(d.dv.cast<T>());
    const Vector3 position =
        P + V * span + g * (T(0.5) * span * span) + Q * Vector3(d.dp.cast<T>()) + velocity * dt;
    const Vector3 seen_gyro =
        q_w_gyro.conjugate() * Vector3(X - point[3] * position) - point[3] * p_gyro_cam;
    const Vector3 seen = (m_.q_gyro_cam.cast<T>() * Exp(Vector3(dq))).conjugate() * seen_gyro;
    if (!(seen.z() > T(1e-6))) return false;  // of a unit norm
    Vector2 ray = m_.ray.ray.head<2>().cast<T>();
    ray += m_.ray.J_ray_lens.col(kFocal).head<2>() * calibration[kStateFocal] +
           m_.ray.J_ray_lens.col(kCx).head<2>() * calibration[kStateCx] +
           m_.ray.J_ray_lens.col(kCy).head<2>() * calibration[kStateCy];
    Eigen::Map<Vector2> r(residual);
    r = px_per_ray_ * Vector2(ray - seen.template head<2>() / seen.z());
    return true;
  }

 private:
  const RowProjectionMeasurement m_;
  const Eigen::Matrix2d px_per_ray_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> MakeRowProjection(const RowProjectionMeasurement& m) {
  return std::make_unique<
      ceres::AutoDiffCostFunction<RowProjection, 2 /* residual */, 4, 3, 3 /* node */,
                                  3 /* gravity */, 3 /* p_gyro_cam */, kStateSize, 4 /* point */>>(
      new RowProjection(m));
}

}  // namespace camgyro
