#include "factors/row_projection.h"

#include <ceres/sized_cost_function.h>
#include <glog/logging.h>

#include <Eigen/LU>

#include "core/calibration.h"
#include "core/so3.h"
#include "factors/rotation_manifold.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

constexpr double kLeastDepth = 1e-6;  // of a point of unit norm

// Columns of the calibration, and of the lens.
struct PinholeState {
  int state;
  size_t lens;
};
constexpr PinholeState kPinholeStates[] = {{kStateFocal, kFocal}, {kStateCx, kCx}, {kStateCy, kCy}};

enum Block { kQ, kP, kV, kGravity, kArm, kCalibration, kPoint };

template <int Columns>
using JacobianMap =
    Eigen::Map<Eigen::Matrix<double, 2, Columns, Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>>;

class RowProjection final
    : public ceres::SizedCostFunction<2, 4, 3, 3 /* node */, 3 /* gravity */, 3 /* p_gyro_cam */,
                                      kStateSize, 4 /* point */> {
 public:
  explicit RowProjection(const RowProjectionMeasurement& m)
      : m_(m), px_per_ray_(m.ray.J_ray_px.topRows<2>().inverse() / m.sigma_px) {
    CHECK_GT(m.sigma_px, 0.0);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Vector3d> P(parameters[kP]), V(parameters[kV]),
        gravity(parameters[kGravity]), arm(parameters[kArm]), X(parameters[kPoint]),
        db_g(parameters[kCalibration] + kStateBias), dq(parameters[kCalibration] + kStateRotation);
    const double* calibration = parameters[kCalibration];
    const double w = parameters[kPoint][3];
    const ImuDelta& d = m_.node_to_row;
    const double dt = calibration[kStateDelay] + calibration[kStateReadout] * m_.row_fraction;
    Row row;
    row.R_w_node = Quaterniond(Eigen::Map<const Quaterniond>(parameters[kQ])).toRotationMatrix();
    const Vector3d turn_by_bias = d.J_rot_bias_gyro * db_g;
    row.R_row_shifted = Exp(Vector3d(m_.omega_gyro_rad_s * dt)).toRotationMatrix();
    row.R_node_row = (d.q_i_j * Exp(turn_by_bias)).toRotationMatrix() * row.R_row_shifted;
    const Matrix3d R_row_w = (row.R_w_node * row.R_node_row).transpose();
    const Vector3d g = gravity * m_.gravity_m_s2;
    row.velocity = V + g * d.dt_s + row.R_w_node * d.dv;
    row.position =
        P + V * d.dt_s + g * (0.5 * d.dt_s * d.dt_s) + row.R_w_node * d.dp + row.velocity * dt;
    row.y = X - w * row.position;
    row.u = R_row_w * row.y;
    const Matrix3d R_cam_gyro = (m_.q_gyro_cam * Exp(Vector3d(dq))).toRotationMatrix().transpose();
    row.seen = R_cam_gyro * (row.u - w * arm);
    const double z = row.seen.z();
    if (!(z > kLeastDepth)) return false;
    const Vector2d ray = m_.ray.ray.head<2>() +
                         m_.ray.J_ray_lens.col(kFocal).head<2>() * calibration[kStateFocal] +
                         m_.ray.J_ray_lens.col(kCx).head<2>() * calibration[kStateCx] +
                         m_.ray.J_ray_lens.col(kCy).head<2>() * calibration[kStateCy];
    const Eigen::Matrix2d px_per_ray = px_per_ray_ - px_per_ray_ * ScaleBy(calibration);
    Eigen::Map<Vector2d> r(residuals);
    r = px_per_ray * (ray - row.seen.head<2>() / z);
    if (jacobians == nullptr) return true;

    Matrix23d by_seen;
    by_seen << 1.0 / z, 0.0, -row.seen.x() / (z * z), 0.0, 1.0 / z, -row.seen.y() / (z * z);
    by_seen = -px_per_ray * by_seen;
    FillJacobians(row, Matrix23d(by_seen * R_cam_gyro), by_seen, R_row_w, turn_by_bias, dt, w, dq,
                  arm, parameters, jacobians);
    if (jacobians[kCalibration] != nullptr) {
      JacobianMap<kStateSize> J(jacobians[kCalibration]);
      const Vector2d off = px_per_ray_ * (ray - row.seen.head<2>() / z);
      for (const auto& [state, lens] : kPinholeStates) {
        J.col(state) = px_per_ray * m_.ray.J_ray_lens.col(lens).head<2>() -
                       px_per_ray_ * m_.ray.J_ray_px_lens[lens].topRows<2>() * m_.sigma_px * off;
      }
    }
    return true;
  }

 private:
  // How far a ray per pixel differs from where it was linearised. Without it the residual would not
  // be in pixels: a larger focal length would make rays, and with them the noise, smaller.
  Eigen::Matrix2d ScaleBy(const double* calibration) const {
    Eigen::Matrix2d change = Eigen::Matrix2d::Zero();
    for (const auto& [state, lens] : kPinholeStates) {
      change += calibration[state] * m_.ray.J_ray_px_lens[lens].topRows<2>();
    }
    return change * px_per_ray_ * m_.sigma_px;
  }

  // What the residual is made of, world frame unless named otherwise.
  struct Row {
    Matrix3d R_w_node, R_node_row, R_row_shifted;
    Vector3d velocity, position;  // of the gyro frame at the row
    Vector3d y;                   // from the gyro frame to the point, times w
    Vector3d u;                   // the same in the gyro frame at the row
    Vector3d seen;                // camera frame
  };

  // by_u, by_seen: derivatives of the residual by row.u and row.seen.
  void FillJacobians(const Row& row, const Matrix23d& by_u, const Matrix23d& by_seen,
                     const Matrix3d& R_row_w, const Vector3d& turn_by_bias, double dt, double w,
                     const Vector3d& dq, const Vector3d& arm, double const* const* parameters,
                     double** jacobians) const {
    const ImuDelta& d = m_.node_to_row;
    const Matrix23d by_y = by_u * R_row_w;
    if (jacobians[kQ] != nullptr) {
      const Vector3d lever = row.R_w_node.transpose() * row.y + w * (d.dp + d.dv * dt);
      const Matrix23d by_tangent = by_u * row.R_node_row.transpose() * Hat(lever);
      JacobianMap<4> J(jacobians[kQ]);
      for (int i = 0; i < 2; ++i) {
        J.row(i) = RotationManifold::Lift(by_tangent.row(i), parameters[kQ]);
      }
    }
    const double span_s = d.dt_s;
    if (jacobians[kP] != nullptr) JacobianMap<3>{jacobians[kP]} = -w * by_y;
    if (jacobians[kV] != nullptr) JacobianMap<3>{jacobians[kV]} = -w * (span_s + dt) * by_y;
    if (jacobians[kGravity] != nullptr) {
      JacobianMap<3>{jacobians[kGravity]} =
          -w * m_.gravity_m_s2 * (0.5 * span_s * span_s + span_s * dt) * by_y;
    }
    if (jacobians[kArm] != nullptr) JacobianMap<3>{jacobians[kArm]} = -w * by_u;
    if (jacobians[kPoint] != nullptr) {
      JacobianMap<4> J(jacobians[kPoint]);
      J.leftCols<3>() = by_y;
      J.col(3) = -by_y * row.position - by_u * arm;
    }
    if (jacobians[kCalibration] == nullptr) return;
    JacobianMap<kStateSize> J(jacobians[kCalibration]);
    const Matrix23d by_turn = by_u * Hat(row.u);  // right perturbation of the gyro frame
    J.col(kStateDelay) = by_turn * m_.omega_gyro_rad_s - w * by_y * row.velocity;
    J.col(kStateReadout) = m_.row_fraction * J.col(kStateDelay);
    J.middleCols<3>(kStateBias) =
        by_turn * row.R_row_shifted.transpose() * RightJacobian(turn_by_bias) * d.J_rot_bias_gyro;
    J.middleCols<3>(kStateRotation) = by_seen * Hat(row.seen) * RightJacobian(dq);
  }

  const RowProjectionMeasurement m_;
  const Eigen::Matrix2d px_per_ray_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> MakeRowProjection(const RowProjectionMeasurement& m) {
  return std::make_unique<RowProjection>(m);
}

}  // namespace camgyro
