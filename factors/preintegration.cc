#include "factors/preintegration.h"

#include <ceres/autodiff_cost_function.h>
#include <glog/logging.h>

#include <Eigen/Cholesky>

#include "core/calibration.h"
#include "core/so3.h"

namespace camgyro {
namespace {

class Preintegration {
 public:
  explicit Preintegration(const PreintegrationMeasurement& m)
      : delta_(m.delta), gravity_m_s2_(m.gravity_m_s2) {
    // Velocities, positions and angles differ by orders of magnitude: unit diagonal first.
    const Eigen::Matrix<double, 9, 1> scale = m.covariance.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::LLT<Eigen::Matrix<double, 9, 9>> llt(scale.asDiagonal() * m.covariance *
                                                      scale.asDiagonal());
    CHECK(llt.info() == Eigen::Success) << m.covariance;
    sqrt_information_.setIdentity();
    llt.matrixL().solveInPlace(sqrt_information_);
    sqrt_information_ = sqrt_information_ * scale.asDiagonal();
  }

  template <typename T>
  bool operator()(const T* q_i, const T* p_i, const T* v_i, const T* q_j, const T* p_j,
                  const T* v_j, const T* gravity, const T* bias_accel, const T* calibration,
                  T* residual) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Quaternion = Eigen::Quaternion<T>;
    const Eigen::Map<const Quaternion> Q_i(q_i), Q_j(q_j);
    const Eigen::Map<const Vector3> P_i(p_i), V_i(v_i), P_j(p_j), V_j(v_j), up(gravity),
        b_a(bias_accel), db_g(calibration + kStateBias);
    const T dt(delta_.dt_s);
    const Vector3 g = up * T(gravity_m_s2_);
    const Quaternion q_i_j = delta_.q_i_j.cast<T>() * Exp(Vector3(delta_.J_rot_bias_gyro * db_g));
    const Quaternion q_i_w = Q_i.conjugate();
    Eigen::Matrix<T, 9, 1> r;
    r.template segment<3>(0) = Log(Quaternion(q_i_j.conjugate() * (q_i_w * Q_j)));
    r.template segment<3>(3) = q_i_w * Vector3(V_j - V_i - g * dt) - delta_.dv.cast<T>() -
                               delta_.J_dv_bias_gyro * db_g - delta_.J_dv_bias_accel * b_a;
    r.template segment<3>(6) = q_i_w * Vector3(P_j - P_i - V_i * dt - T(0.5) * g * dt * dt) -
                               delta_.dp.cast<T>() - delta_.J_dp_bias_gyro * db_g -
                               delta_.J_dp_bias_accel * b_a;
    Eigen::Map<Eigen::Matrix<T, 9, 1>> whitened(residual);
    whitened = sqrt_information_ * r;
    return true;
  }

 private:
  const ImuDelta delta_;
  const double gravity_m_s2_;
  Eigen::Matrix<double, 9, 9> sqrt_information_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> MakePreintegration(const PreintegrationMeasurement& m) {
  return std::make_unique<
      ceres::AutoDiffCostFunction<Preintegration, 9 /* residual */, 4, 3, 3 /* i */, 4, 3,
                                  3 /* j */, 3 /* gravity */, 3 /* bias_accel */, kStateSize>>(
      new Preintegration(m));
}

}  // namespace camgyro
