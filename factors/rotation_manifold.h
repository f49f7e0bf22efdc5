// The manifold of unit quaternions with the full rotation vector as tangent.
#ifndef CAMGYRO_FACTORS_ROTATION_MANIFOLD_H_
#define CAMGYRO_FACTORS_ROTATION_MANIFOLD_H_

#include <ceres/manifold.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/so3.h"

namespace camgyro {

// Storage [x y z w] (Eigen's), Hamilton, perturbed on the right by a full rotation vector [rad]:
//   Plus(q, d) = q * Exp(d),   Minus(y, x) = Log(x^-1 * y)   (shortest arc)
// ceres::EigenQuaternionManifold perturbs on the left by half the rotation vector: covariances
// would come out four times too small, in another frame.
class RotationManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return 3; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(x);
    const Eigen::Vector3d d = Eigen::Map<const Eigen::Vector3d>(delta);
    Eigen::Map<Eigen::Quaterniond> out(x_plus_delta);
    out = (q * Exp(d)).normalized();
    return true;
  }

  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 4, 3, Eigen::RowMajor>> J(jacobian);
    J = PlusJacobianOf(x);
    return true;
  }

  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    const Eigen::Map<const Eigen::Quaterniond> qx(x), qy(y);
    Eigen::Map<Eigen::Vector3d> out(y_minus_x);
    out = Log(Eigen::Quaterniond(qx.conjugate() * qy));
    return true;
  }

  bool MinusJacobian(const double* x, double* jacobian) const override {
    // Of y [-] x by y at y = x: the pseudo-inverse of PlusJacobian, whose columns have norm 1/2.
    Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> J(jacobian);
    J = 4.0 * PlusJacobianOf(x).transpose();
    return true;
  }

  // d Plus(q, d) / d d at d = 0, rows in the order of the storage.
  static Eigen::Matrix<double, 4, 3> PlusJacobianOf(const double* x) {
    Eigen::Matrix<double, 4, 3> J;
    const double qx = x[0], qy = x[1], qz = x[2], qw = x[3];
    J << qw, -qz, qy, qz, qw, -qx, -qy, qx, qw, -qx, -qy, -qz;
    return 0.5 * J;
  }

  // Ceres asks factors for derivatives by the four stored numbers and multiplies them by
  // PlusJacobian. This is the row that becomes `by_tangent` after that multiplication.
  static Eigen::RowVector4d Lift(const Eigen::RowVector3d& by_tangent, const double* x) {
    return 4.0 * by_tangent * PlusJacobianOf(x).transpose();
  }
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_ROTATION_MANIFOLD_H_
