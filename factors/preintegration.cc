#include "factors/preintegration.h"

#include <ceres/autodiff_cost_function.h>
#include <glog/logging.h>

#include "core/calibration.h"
#include "core/linear_algebra.h"
#include "core/so3.h"

namespace camgyro {
namespace {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

class Preintegration {
 public:
  explicit Preintegration(const PreintegrationMeasurement& m)
      : delta_(m.delta),
        gravity_m_s2_(m.gravity_m_s2),
        sqrt_information_(InverseRoot(m.covariance)) {
    CHECK(sqrt_information_.allFinite()) << "covariance:\n" << m.covariance;
  }

  // Biases as differences from those that were taken out.
  template <typename T>
  bool Evaluate(const T* q_i, const T* p_i, const T* v_i, const T* q_j, const T* p_j, const T* v_j,
                const T* gravity, const Eigen::Matrix<T, 3, 1>& db_g,
                const Eigen::Matrix<T, 3, 1>& db_a, T* residual) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    using Quaternion = Eigen::Quaternion<T>;
    const Eigen::Map<const Quaternion> Q_i(q_i), Q_j(q_j);
    const Eigen::Map<const Vector3> P_i(p_i), V_i(v_i), P_j(p_j), V_j(v_j), up(gravity);
    const T dt(delta_.dt_s);
    const Vector3 g = up * T(gravity_m_s2_);
    const Quaternion q_i_j = delta_.q_i_j.cast<T>() * Exp(Vector3(delta_.J_rot_bias_gyro * db_g));
    const Quaternion q_i_w = Q_i.conjugate();
    Eigen::Matrix<T, 9, 1> r;
    r.template segment<3>(0) = Log(Quaternion(q_i_j.conjugate() * (q_i_w * Q_j)));
    r.template segment<3>(3) = q_i_w * Vector3(V_j - V_i - g * dt) - delta_.dv.cast<T>() -
                               delta_.J_dv_bias_gyro * db_g - delta_.J_dv_bias_accel * db_a;
    r.template segment<3>(6) = q_i_w * Vector3(P_j - P_i - V_i * dt - T(0.5) * g * dt * dt) -
                               delta_.dp.cast<T>() - delta_.J_dp_bias_gyro * db_g -
                               delta_.J_dp_bias_accel * db_a;
    Eigen::Map<Eigen::Matrix<T, 9, 1>> whitened(residual);
    whitened = sqrt_information_ * r;
    return true;
  }

 private:
  const ImuDelta delta_;
  const double gravity_m_s2_;
  const Matrix9d sqrt_information_;
};

// The gyro's bias is the calibration's, the accelerometer's one for all.
class WithCalibration {
 public:
  explicit WithCalibration(const PreintegrationMeasurement& m) : preintegration_(m) {}

  template <typename T>
  bool operator()(const T* q_i, const T* p_i, const T* v_i, const T* q_j, const T* p_j,
                  const T* v_j, const T* gravity, const T* bias_accel, const T* calibration,
                  T* residual) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    return preintegration_.Evaluate(q_i, p_i, v_i, q_j, p_j, v_j, gravity,
                                    Vector3(Eigen::Map<const Vector3>(calibration + kStateBias)),
                                    Vector3(Eigen::Map<const Vector3>(bias_accel)), residual);
  }

 private:
  const Preintegration preintegration_;
};

// Both biases are parameters of state i.
class WithBias {
 public:
  explicit WithBias(const BiasedPreintegrationMeasurement& m)
      : preintegration_(m.preintegration),
        bias_gyro_(m.bias_gyro_rad_s),
        bias_accel_(m.bias_accel_m_s2) {}

  template <typename T>
  bool operator()(const T* q_i, const T* p_i, const T* v_i, const T* q_j, const T* p_j,
                  const T* v_j, const T* gravity, const T* bias_gyro, const T* bias_accel,
                  T* residual) const {
    using Vector3 = Eigen::Matrix<T, 3, 1>;
    const Vector3 db_g = Eigen::Map<const Vector3>(bias_gyro) - bias_gyro_.cast<T>();
    const Vector3 db_a = Eigen::Map<const Vector3>(bias_accel) - bias_accel_.cast<T>();
    return preintegration_.Evaluate(q_i, p_i, v_i, q_j, p_j, v_j, gravity, db_g, db_a, residual);
  }

 private:
  const Preintegration preintegration_;
  const Eigen::Vector3d bias_gyro_, bias_accel_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> MakePreintegration(const PreintegrationMeasurement& m) {
  return std::make_unique<
      ceres::AutoDiffCostFunction<WithCalibration, 9 /* residual */, 4, 3, 3 /* i */, 4, 3,
                                  3 /* j */, 3 /* gravity */, 3 /* bias_accel */, kStateSize>>(
      new WithCalibration(m));
}

std::unique_ptr<ceres::CostFunction> MakePreintegrationWithBias(
    const BiasedPreintegrationMeasurement& m) {
  return std::make_unique<
      ceres::AutoDiffCostFunction<WithBias, 9 /* residual */, 4, 3, 3 /* i */, 4, 3, 3 /* j */,
                                  3 /* gravity */, 3 /* bias_gyro */, 3 /* bias_accel */>>(
      new WithBias(m));
}

}  // namespace camgyro
