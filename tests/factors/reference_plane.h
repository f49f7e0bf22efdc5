// CoplanarityPlane and the determinant written a second time, plainly and for autodiff scalars: the
// reference for the hand-written derivatives. Shares no code with the factors.
#ifndef CAMGYRO_TESTS_FACTORS_REFERENCE_PLANE_H_
#define CAMGYRO_TESTS_FACTORS_REFERENCE_PLANE_H_

#include <ceres/jet.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "factors/pair_bearings.h"

namespace camgyro {
namespace reference {

template <typename T>
using Vec2 = Eigen::Matrix<T, 2, 1>;
template <typename T>
using Vec3 = Eigen::Matrix<T, 3, 1>;
template <typename T>
using Mat32 = Eigen::Matrix<T, 3, 2>;

template <typename T>
Eigen::Matrix<T, 3, 3> Rodrigues(const Vec3<T>& w) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T angle = sqrt(w.squaredNorm() + T(1e-30));
  Eigen::Matrix<T, 3, 3> K;
  K << T(0), -w.z(), w.y(), w.z(), T(0), -w.x(), -w.y(), w.x(), T(0);
  return Eigen::Matrix<T, 3, 3>::Identity() + sin(angle) / angle * K +
         (T(1) - cos(angle)) / (angle * angle) * K * K;
}

template <typename T>
Vec2<T> Distort(const T* lens, const Vec2<T>& p) {
  const T r2 = p.squaredNorm();
  const T &x = p.x(), &y = p.y();
  const T radial = T(1) + lens[4] * r2 + lens[5] * r2 * r2;
  return {x * radial + T(2) * lens[6] * x * y + lens[7] * (r2 + T(2) * x * x),
          y * radial + lens[6] * (r2 + T(2) * y * y) + T(2) * lens[7] * x * y};
}

// Ray of a pixel in the reference, and its derivative by the pixel: row v is exposed t_r / h after
// row v - 1, when the camera has turned by omega t_r / h.
template <typename T>
void RayAndJacobian(const PairMeasurement& pair, const T* lens, const T* shutter, const T* q,
                    const std::vector<T>& rates, const Eigen::Vector2d& px, double stamp,
                    Vec3<T>* ray, Mat32<T>* J) {
  const Vec2<T> target((T(px.x()) - lens[1]) / (lens[0] * lens[3]),
                       (T(px.y()) - lens[2]) / lens[0]);
  Vec2<T> p = target;  // fixed-point iteration of the undistortion, to convergence
  for (int i = 0; i < 200; ++i) p += target - Distort(lens, p);
  // Derivative of the distortion by differences: it is a polynomial of degree 5, for which the
  // seven-point stencil is exact.
  Eigen::Matrix<T, 2, 2> D;
  for (int k = 0; k < 2; ++k) {
    Vec2<T> sum = Vec2<T>::Zero();
    const double weights[] = {45.0 / 60, -9.0 / 60, 1.0 / 60};
    for (int i = 1; i <= 3; ++i) {
      Vec2<T> plus = p, minus = p;
      plus[k] += T(0.1 * i);
      minus[k] -= T(0.1 * i);
      sum += T(weights[i - 1] / 0.1) * (Distort(lens, plus) - Distort(lens, minus));
    }
    D.col(k) = sum;
  }
  const T det = D(0, 0) * D(1, 1) - D(0, 1) * D(1, 0);
  const T fx = lens[0] * lens[3], fy = lens[0];
  const Vec3<T> ray_cam(p.x(), p.y(), T(1));
  const Vec3<T> by_u(D(1, 1) / det / fx, -D(1, 0) / det / fx, T(0));
  const Vec3<T> by_v(-D(0, 1) / det / fy, D(0, 0) / det / fy, T(0));

  const T line_delay = shutter[kReadout] / T(pair.size_px.y());
  const T time = T(stamp) + shutter[kDelay] + line_delay * T(px.y());
  const Eigen::Matrix<T, 3, 3> R_gyro_cam =
      Eigen::Quaternion<T>(q[3], q[0], q[1], q[2]).toRotationMatrix();
  Eigen::Matrix<T, 3, 3> R = Eigen::Matrix<T, 3, 3>::Identity();
  for (size_t i = 0; i + 1 < pair.rate_times_s.size(); ++i) {
    const T dt(pair.rate_times_s[i + 1] - pair.rate_times_s[i]);
    const Vec3<T> w0(rates[3 * i], rates[3 * i + 1], rates[3 * i + 2]);
    const Vec3<T> w1(rates[3 * i + 3], rates[3 * i + 4], rates[3 * i + 5]);
    const T left = time - T(pair.rate_times_s[i]);
    if (left < dt) {
      const T s = left / dt;
      R = R * Rodrigues<T>(left * (w0 + T(0.5) * s * (w1 - w0)));
      const Vec3<T> omega = w0 + s * (w1 - w0);
      *ray = R * (R_gyro_cam * ray_cam);
      J->col(0) = R * (R_gyro_cam * by_u);
      J->col(1) = R * (R_gyro_cam * by_v + line_delay * omega.cross(R_gyro_cam * ray_cam));
      return;
    }
    R = R * Rodrigues<T>(T(0.5) * dt * (w0 + w1));
  }
  ADD_FAILURE() << "exposure after the last rate";
}

// Residual of one match against tau, unrobust. parameters as in CoplanarityPlane.
template <typename T>
T Plane(const PairMeasurement& pair, const Match& match, const T* lens, const T* shutter,
        const T* q, const Vec3<T>& tau0, const Vec3<T>& turn, const Vec3<T>& bow,
        const std::vector<T>& rates) {
  using std::sqrt;
  const double height = pair.size_px.y();
  const double from = match.px_a.y() / height - 0.5, to = match.px_b.y() / height - 0.5;
  const double rho = pair.readout_over_gap;
  // (u^2 + u u' + u'^2) / 6 of u = -T / 2 + t_r from, u' = T / 2 + t_r to, in units of T t_r / 12,
  // less what does not depend on the rows
  const double u = -0.5 + rho * from, u2 = 0.5 + rho * to;
  const double c = ((u * u + u * u2 + u2 * u2) / 6.0 - 1.0 / 24.0) * 12.0 / rho;
  const Vec3<T> tau = tau0 + turn * T((from + to) / 2.0) + bow * T(c);
  Vec3<T> a, b;
  Mat32<T> A, B;
  RayAndJacobian(pair, lens, shutter, q, rates, match.px_a, pair.frame_a.stamp_s, &a, &A);
  RayAndJacobian(pair, lens, shutter, q, rates, match.px_b, pair.frame_b.stamp_s, &b, &B);
  T variance(0);
  for (int k = 0; k < 2; ++k) {
    const T by_a = tau.dot(Vec3<T>(A.col(k)).cross(b)), by_b = tau.dot(a.cross(Vec3<T>(B.col(k))));
    variance += T(pair.variance_a()) * by_a * by_a + T(pair.variance_b()) * by_b * by_b;
  }
  return tau.dot(a.cross(b)) / sqrt(variance);
}

template <typename T>
T Determinant(const PairMeasurement& pair, const Match* const* matches, const T* lens,
              const T* shutter, const T* q, const std::vector<T>& rates) {
  using std::sqrt;
  Vec3<T> a[3], b[3], n[3];
  Mat32<T> A[3], B[3];
  for (int i = 0; i < 3; ++i) {
    RayAndJacobian(pair, lens, shutter, q, rates, matches[i]->px_a, pair.frame_a.stamp_s, &a[i],
                   &A[i]);
    RayAndJacobian(pair, lens, shutter, q, rates, matches[i]->px_b, pair.frame_b.stamp_s, &b[i],
                   &B[i]);
    n[i] = a[i].cross(b[i]);
  }
  const auto det = [](const Vec3<T>& x, const Vec3<T>& y, const Vec3<T>& z) {
    return x.dot(y.cross(z));
  };
  T variance(0);
  for (int i = 0; i < 3; ++i) {
    const Vec3<T>&n1 = n[(i + 1) % 3], &n2 = n[(i + 2) % 3];
    for (int k = 0; k < 2; ++k) {
      const T by_a = det(Vec3<T>(A[i].col(k)).cross(b[i]), n1, n2);
      const T by_b = det(a[i].cross(Vec3<T>(B[i].col(k))), n1, n2);
      variance += T(pair.variance_a()) * by_a * by_a + T(pair.variance_b()) * by_b * by_b;
    }
  }
  return det(n[0], n[1], n[2]) / sqrt(variance);
}

}  // namespace reference
}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FACTORS_REFERENCE_PLANE_H_
