// Rotations as Hamilton unit quaternions; perturbation on the right by a full rotation vector:
//   q [+] d = q * Exp(d),   y [-] x = Log(x^-1 * y)   (shortest arc), d in rad.
// `R_a_b`, `q_a_b` map vectors of b into a.
#ifndef CAMGYRO_CORE_SO3_H_
#define CAMGYRO_CORE_SO3_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace camgyro {

// Matrix of the cross product: Hat(a) * b = a x b.
inline Eigen::Matrix3d Hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Unit quaternion of the rotation vector phi [rad]. Works with autodiff scalars at zero too.
template <typename T>
Eigen::Quaternion<T> Exp(const Eigen::Matrix<T, 3, 1>& phi) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T angle_sq = phi.squaredNorm();
  T real, imag_scale;  // cos(angle/2), sin(angle/2)/angle
  if (angle_sq < T(1e-8)) {
    real = T(1) - angle_sq / T(8) + angle_sq * angle_sq / T(384);
    imag_scale = T(0.5) - angle_sq / T(48) + angle_sq * angle_sq / T(3840);
  } else {
    const T angle = sqrt(angle_sq);
    real = cos(angle * T(0.5));
    imag_scale = sin(angle * T(0.5)) / angle;
  }
  return Eigen::Quaternion<T>(real, imag_scale * phi.x(), imag_scale * phi.y(),
                              imag_scale * phi.z());
}

// Rotation vector [rad] of a unit quaternion, shortest arc (norm <= pi).
template <typename T>
Eigen::Matrix<T, 3, 1> Log(const Eigen::Quaternion<T>& q) {
  using std::atan2;
  using std::sqrt;
  const Eigen::Matrix<T, 3, 1> imag = q.vec();
  const T sin_sq = imag.squaredNorm();
  const T& w = q.w();
  if (sin_sq < T(1e-12)) {
    // angle / sin(angle/2) -> (2/w)(1 - sin_sq/(3 w^2)), valid for both signs of w.
    const T scale = T(2) / w * (T(1) - sin_sq / (T(3) * w * w));
    return scale * imag;
  }
  const T sine = sqrt(sin_sq);
  // The sign of w picks the shortest arc.
  const T angle = w < T(0) ? T(2) * atan2(-sine, -w) : T(2) * atan2(sine, w);
  return (angle / sine) * imag;
}

// The matrix of Exp(phi), and its left Jacobian: Exp(phi + d) = Exp(J_l(phi) d) * Exp(phi) to first
// order.
struct TurnAndJacobian {
  Eigen::Matrix3d R, J_left;
};
inline TurnAndJacobian TurnAndLeftJacobian(const Eigen::Vector3d& phi) {
  const double angle_sq = phi.squaredNorm();
  double a, b;            // (1 - cos)/angle^2, (angle - sin)/angle^3
  if (angle_sq < 1e-2) {  // to 1e-14; a gyro sample's turn
    a = 0.5 - angle_sq * (1.0 / 24.0 - angle_sq * (1.0 / 720.0 - angle_sq / 40320.0));
    b = 1.0 / 6.0 - angle_sq * (1.0 / 120.0 - angle_sq * (1.0 / 5040.0 - angle_sq / 362880.0));
  } else {
    const double angle = std::sqrt(angle_sq);
    a = (1.0 - std::cos(angle)) / angle_sq;
    b = (angle - std::sin(angle)) / (angle_sq * angle);
  }
  // J_l = I + a phi^ + b phi^ phi^ and R = I + J_l phi^, with phi^ phi^ = phi phi' - angle^2 I.
  const double sine = 1.0 - b * angle_sq;  // sin / angle
  const double cosine = 1.0 - a * angle_sq;
  const auto sum = [&phi](double one, double skew, double square) {
    const double x = phi.x(), y = phi.y(), z = phi.z();
    const double sx = skew * x, sy = skew * y, sz = skew * z;
    const double xy = square * x * y, yz = square * y * z, zx = square * z * x;
    Eigen::Matrix3d m;
    m << one + square * x * x, xy - sz, zx + sy,  //
        xy + sz, one + square * y * y, yz - sx,   //
        zx - sy, yz + sx, one + square * z * z;
    return m;
  };
  return {sum(cosine, sine, a), sum(sine, a, b)};
}

inline Eigen::Matrix3d LeftJacobian(const Eigen::Vector3d& phi) {
  return TurnAndLeftJacobian(phi).J_left;
}

// Right Jacobian: Exp(phi + d) = Exp(phi) * Exp(J_r(phi) d) to first order.
inline Eigen::Matrix3d RightJacobian(const Eigen::Vector3d& phi) { return LeftJacobian(-phi); }

// Inverse of the left Jacobian, for |phi| < 2 pi.
inline Eigen::Matrix3d LeftJacobianInverse(const Eigen::Vector3d& phi) {
  const double angle_sq = phi.squaredNorm();
  const Eigen::Matrix3d hat = Hat(phi);
  double c;  // 1/angle^2 - (1 + cos)/(2 angle sin)
  if (angle_sq < 1e-4) {
    c = 1.0 / 12.0 + angle_sq / 720.0 + angle_sq * angle_sq / 30240.0;
  } else {
    const double half = 0.5 * std::sqrt(angle_sq);
    c = (1.0 - half * std::cos(half) / std::sin(half)) / angle_sq;
  }
  return Eigen::Matrix3d::Identity() - 0.5 * hat + c * hat * hat;
}

inline Eigen::Matrix3d RightJacobianInverse(const Eigen::Vector3d& phi) {
  return LeftJacobianInverse(-phi);
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_SO3_H_
