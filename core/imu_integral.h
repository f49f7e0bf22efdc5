// Pre-integrated gyro and accelerometer: rotation, velocity and position between any two times, as
// far as they do not depend on where the motion started.
#ifndef CAMGYRO_CORE_IMU_INTEGRAL_H_
#define CAMGYRO_CORE_IMU_INTEGRAL_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Noise of one axis: white densities, continuous.
struct ImuNoise {
  double gyro_rad_s_rtHz = 2e-4;
  double accel_m_s2_rtHz = 3e-3;
};

// Motion of the gyro (IMU) frame from time i to time j, j before i allowed:
//   R_w_j = R_w_i * R(q_i_j)
//   v_j   = v_i + g dt + R_w_i * dv
//   p_j   = p_i + v_i dt + g dt^2 / 2 + R_w_i * dp
// with derivatives by the biases that were taken out; the rotation's is a right perturbation.
struct ImuDelta {
  double dt_s = 0.0;
  Eigen::Quaterniond q_i_j = Eigen::Quaterniond::Identity();
  Eigen::Vector3d dv = Eigen::Vector3d::Zero();  // [m/s], gyro frame at i
  Eigen::Vector3d dp = Eigen::Vector3d::Zero();  // [m]
  Eigen::Matrix3d J_rot_bias_gyro = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d J_dv_bias_gyro = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d J_dv_bias_accel = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d J_dp_bias_gyro = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d J_dp_bias_accel = Eigen::Matrix3d::Zero();
};

// Integrals of the samples of both sensors over one stretch of time, as prefix sums: one Between
// costs the same however long it is. Between gyro samples, rate and specific force (in the frame of
// reference) are parabolas, bent as their neighbours say: straight lines would take (2 pi 4 Hz
// 5 ms)^2 / 12 = 1.3e-3 away of what swings at 4 Hz with samples at 200 Hz.
// Without accelerometer samples dv and dp are zero. Outside of the samples the last ones are held.
class ImuIntegral {
 public:
  // Samples with increasing stamps, at least two of the gyro; times are seconds from origin_ns.
  // Accelerometer samples may have stamps of their own: they are interpolated.
  ImuIntegral(const std::vector<GyroSample>& gyro, const std::vector<AccelSample>& accel,
              int64_t origin_ns, const Eigen::Vector3d& bias_gyro_rad_s,
              const Eigen::Vector3d& bias_accel_m_s2 = Eigen::Vector3d::Zero());

  double begin_s() const { return times_s_.front(); }
  double end_s() const { return times_s_.back(); }

  ImuDelta Between(double from_s, double to_s) const;

  // Covariance of (right perturbation of q_i_j, dv, dp) by white noise; from_s < to_s.
  using Matrix9d = Eigen::Matrix<double, 9, 9>;
  Matrix9d Covariance(double from_s, double to_s, const ImuNoise& noise) const;

  Eigen::Quaterniond RotationAt(double time_s) const;  // q_ref_gyro(t), ref: the first sample
  Eigen::Vector3d RateAt(double time_s) const;         // gyro frame, bias removed [rad/s]
  Eigen::Vector3d ForceAt(double time_s) const;        // gyro frame, bias removed [m/s^2]

 private:
  // A vector, and its derivatives by the biases of gyro and accelerometer.
  using WithDerivatives = Eigen::Matrix<double, 3, 7>;
  struct State {  // at one time, in the gyro frame of the first sample
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d J_rot = Eigen::Matrix3d::Zero();  // right perturbation by the gyro's bias
    WithDerivatives v = WithDerivatives::Zero(), p = WithDerivatives::Zero();
  };
  void ResampleForce(const std::vector<AccelSample>& accel, int64_t origin_ns,
                     const Eigen::Vector3d& bias_accel_m_s2);
  // From sample i on by dt_s: rotation, then velocity and position.
  void Turn(const State& from, size_t i, double dt_s, State* to) const;
  void Travel(const State& from, size_t i, double dt_s, State* to) const;
  State At(double time_s) const;
  size_t Segment(double time_s, double* weight_next) const;

  std::vector<double> times_s_;  // of the gyro samples
  // At the gyro samples; accel_: the force in the frame of reference, WithDerivatives. Bends:
  // second derivatives by time of the stretch from each sample to the next.
  Eigen::Matrix3Xd omega_, force_;
  Eigen::MatrixXd accel_, omega_bend_, accel_bend_;
  std::vector<State> states_;
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_IMU_INTEGRAL_H_
