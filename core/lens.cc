#include "core/lens.h"

#include <Eigen/LU>
#include <cmath>

namespace camgyro {
namespace {

using Matrix32 = Eigen::Matrix<double, 3, 2>;

struct Distortion {
  Eigen::Vector2d value;  // distorted normalised coordinates
  Eigen::Matrix2d J;      // by the undistorted ones
};

Distortion DistortRadTan(const Eigen::Vector2d& xy, const LensParameters& lens) {
  const double k1 = lens[kK1], k2 = lens[kK2], p1 = lens[kP1], p2 = lens[kP2];
  const double x = xy.x(), y = xy.y(), r2 = xy.squaredNorm();
  const double radial = 1.0 + (k1 + k2 * r2) * r2;
  const double slope = k1 + 2.0 * k2 * r2;  // d radial / d r2
  Distortion d;
  d.value << x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
      y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  d.J(0, 0) = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x;
  d.J(0, 1) = d.J(1, 0) = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
  d.J(1, 1) = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return d;
}

// Pinhole with radial-tangential distortion. Unprojection inverts the distortion by Newton's
// method; derivatives of the inverse follow from the implicit function theorem.
class PinholeRadTan final : public Lens {
 public:
  bool Unproject(const Eigen::Vector2d& px, const LensParameters& lens, RayJet* out,
                 bool derivatives_by_lens) const override {
    const double f = lens[kFocal], aspect = lens[kAspect];
    const double fx = f * aspect;
    const Eigen::Vector2d distorted((px.x() - lens[kCx]) / fx, (px.y() - lens[kCy]) / f);
    Eigen::Vector2d xy = distorted;
    Distortion d = DistortRadTan(xy, lens);
    const bool has_distortion = !lens.segment<4>(kK1).isZero(0.0);
    if (has_distortion) {
      for (int i = 0; i < 20; ++i) {
        const Eigen::Vector2d error = distorted - d.value;
        if (error.squaredNorm() < 1e-26) break;
        if (!(d.J.determinant() > 0.05)) return false;  // beyond the fold of the distortion
        xy += d.J.inverse() * error;
        d = DistortRadTan(xy, lens);
      }
      if (!((distorted - d.value).squaredNorm() < 1e-20) || !(d.J.determinant() > 0.05)) {
        return false;
      }
    }
    if (!xy.allFinite()) return false;

    const double x = xy.x(), y = xy.y(), r2 = xy.squaredNorm();
    out->ray << x, y, 1.0;
    out->J_ray_px.topRows<2>() = d.J.inverse() * Eigen::Vector2d(1.0 / fx, 1.0 / f).asDiagonal();
    out->J_ray_px.row(2).setZero();
    if (!derivatives_by_lens) return true;

    const double k1 = lens[kK1], k2 = lens[kK2], p1 = lens[kP1], p2 = lens[kP2];
    const double slope = k1 + 2.0 * k2 * r2, curvature = 2.0 * k2;
    const Eigen::Matrix2d J_inv = d.J.inverse();
    Eigen::Matrix2d scale = Eigen::Matrix2d::Zero();  // d distorted / d px
    scale(0, 0) = 1.0 / fx;
    scale(1, 1) = 1.0 / f;

    // Second derivatives of the distortion: dJ/dx, dJ/dy (symmetric, three distinct entries).
    const auto symmetric = [](double a, double b, double c) {
      return (Eigen::Matrix2d() << a, b, b, c).finished();
    };
    const double dxxx = 6.0 * x * slope + 4.0 * x * x * x * curvature + 6.0 * p2;
    const double dxxy = 2.0 * y * slope + 4.0 * x * x * y * curvature + 2.0 * p1;
    const double dxyy = 2.0 * x * slope + 4.0 * x * y * y * curvature + 2.0 * p2;
    const double dyyy = 6.0 * y * slope + 4.0 * y * y * y * curvature + 6.0 * p1;
    const Eigen::Matrix2d J_x = symmetric(dxxx, dxxy, dxyy);
    const Eigen::Matrix2d J_y = symmetric(dxxy, dxyy, dyyy);

    // By each parameter: of the distorted coordinates, of the distortion at fixed xy, of its J,
    // and of `scale`.
    Eigen::Matrix<double, 2, kLensSize> distorted_by = Eigen::Matrix<double, 2, kLensSize>::Zero();
    distorted_by.col(kFocal) = -distorted / f;
    distorted_by(0, kCx) = -1.0 / fx;
    distorted_by(1, kCy) = -1.0 / f;
    distorted_by(0, kAspect) = -distorted.x() / aspect;
    Eigen::Matrix<double, 2, kLensSize> value_by = Eigen::Matrix<double, 2, kLensSize>::Zero();
    value_by.col(kK1) = xy * r2;
    value_by.col(kK2) = xy * r2 * r2;
    value_by.col(kP1) << 2.0 * x * y, r2 + 2.0 * y * y;
    value_by.col(kP2) << r2 + 2.0 * x * x, 2.0 * x * y;

    out->J_ray_lens.row(2).setZero();
    for (int k = 0; k < kLensSize; ++k) {
      const Eigen::Vector2d xy_k = J_inv * (distorted_by.col(k) - value_by.col(k));
      out->J_ray_lens.col(k).head<2>() = xy_k;
      Eigen::Matrix2d J_k = J_x * xy_k.x() + J_y * xy_k.y();
      if (k == kK1) J_k += symmetric(r2 + 2.0 * x * x, 2.0 * x * y, r2 + 2.0 * y * y);
      if (k == kK2) {
        J_k += r2 * symmetric(r2 + 4.0 * x * x, 4.0 * x * y, r2 + 4.0 * y * y);
      }
      if (k == kP1) J_k += symmetric(2.0 * y, 2.0 * x, 6.0 * y);
      if (k == kP2) J_k += symmetric(6.0 * x, 2.0 * y, 2.0 * x);
      Eigen::Matrix2d scale_k = Eigen::Matrix2d::Zero();
      if (k == kFocal) scale_k = -scale / f;
      if (k == kAspect) scale_k(0, 0) = -scale(0, 0) / aspect;
      out->J_ray_px_lens[k].row(2).setZero();
      out->J_ray_px_lens[k].topRows<2>() = J_inv * (scale_k - J_k * J_inv * scale);
    }
    return true;
  }

  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point_cam,
                                         const LensParameters& lens) const override {
    if (!(point_cam.z() > 0.0)) return std::nullopt;
    const Eigen::Vector2d xy = point_cam.head<2>() / point_cam.z();
    const Distortion d = DistortRadTan(xy, lens);
    if (!(d.J.determinant() > 0.05)) return std::nullopt;
    return Eigen::Vector2d(lens[kFocal] * lens[kAspect] * d.value.x() + lens[kCx],
                           lens[kFocal] * d.value.y() + lens[kCy]);
  }

  std::array<const char*, 4> DistortionNames() const override { return {"k1", "k2", "p1", "p2"}; }
};

}  // namespace

LensParameters MakePinhole(double focal_px, const Eigen::Vector2d& principal_px,
                           double aspect_ratio) {
  LensParameters lens = LensParameters::Zero();
  lens[kFocal] = focal_px;
  lens[kCx] = principal_px.x();
  lens[kCy] = principal_px.y();
  lens[kAspect] = aspect_ratio;
  return lens;
}

const Lens& GetLens(DistortionModel) {
  // A pinhole is the radial-tangential lens with coefficients zero.
  static const PinholeRadTan lens;
  return lens;
}

std::string DistortionModelName(DistortionModel model) {
  return model == DistortionModel::kRadTan ? "radtan" : "none";
}

}  // namespace camgyro
