#include "core/lens.h"

#include <Eigen/Dense>
#include <cmath>

namespace camgyro {
namespace {

using Matrix32 = Eigen::Matrix<double, 3, 2>;

// A function of t = r^2 with two derivatives.
struct Radial {
  double value = 0.0, slope = 0.0, curvature = 0.0;
};

// c = theta / r = atan(r) / r.
Radial AngleOverRadius(double t) {
  Radial c;
  if (t < 0.02) {  // sum of (-t)^j / (2j + 1), to 1e-16
    double power = 1.0;
    for (int j = 0; j < 11; ++j) {
      c.value += power / (2 * j + 1);
      c.slope -= (j + 1) * power / (2 * j + 3);
      c.curvature += (j + 1) * (j + 2) * power / (2 * j + 5);
      power *= -t;
    }
    return c;
  }
  c.value = std::atan(std::sqrt(t)) / std::sqrt(t);
  c.slope = (1.0 / (1.0 + t) - c.value) / (2.0 * t);
  c.curvature = (-1.0 / ((1.0 + t) * (1.0 + t)) - 3.0 * c.slope) / (2.0 * t);
  return c;
}

// theta^(2k+1) / r = c^(2k+1) t^k for k = 1..4: the factors of kb1..kb4.
std::array<Radial, 4> AngleSeries(const Radial& c, double t) {
  std::array<Radial, 4> series;
  const double c_sq = c.value * c.value;
  double p2 = c.value, t2 = 0.0, t1 = 1.0;  // c^(2k-1), (t^k)'' / (k (k - 1)), t^(k-1)
  for (int k = 1; k <= 4; ++k, p2 *= c_sq, t2 = t1, t1 *= t) {
    const int n = 2 * k + 1;
    const double p1 = p2 * c.value, p0 = p1 * c.value, t0 = t1 * t;
    const double p_slope = n * p1 * c.slope;
    Radial& m = series[static_cast<size_t>(k - 1)];
    m.value = p0 * t0;
    m.slope = p_slope * t0 + k * p0 * t1;
    m.curvature = (n * (n - 1) * p2 * c.slope * c.slope + n * p1 * c.curvature) * t0 +
                  2.0 * k * p_slope * t1 + k * (k - 1) * p0 * t2;
  }
  return series;
}

// Derivative of (x, y) m(r^2) by (x, y).
Eigen::Matrix2d RadialJacobian(double x, double y, const Radial& m) {
  Eigen::Matrix2d J;
  J(0, 0) = m.value + 2.0 * x * x * m.slope;
  J(0, 1) = J(1, 0) = 2.0 * x * y * m.slope;
  J(1, 1) = m.value + 2.0 * y * y * m.slope;
  return J;
}

struct Distortion {
  Eigen::Vector2d value;  // distorted normalised coordinates
  Eigen::Matrix2d J;      // by the undistorted ones
  Radial radial;
};

// The lens block of core/lens.h: by Newton's method from the pixel to the ray; derivatives of the
// inverse follow from the implicit function theorem.
class AxialLens final : public Lens {
 public:
  // equidistant: kKannalaBrandt.
  explicit AxialLens(bool equidistant) : equidistant_(equidistant) {}

  bool Unproject(const Eigen::Vector2d& px, const LensParameters& lens, RayJet* out,
                 LensDerivatives by_lens) const override {
    const double f = lens[kFocal], aspect = lens[kAspect];
    const double fx = f * aspect;
    const Eigen::Vector2d distorted((px.x() - lens[kCx]) / fx, (px.y() - lens[kCy]) / f);
    const bool has_distortion = equidistant_ || !lens.tail<kLensSize - kK1>().isZero(0.0);
    if (!has_distortion && by_lens <= LensDerivatives::kPinhole) {
      return UnprojectPinhole(distorted, fx, f, by_lens, out);
    }
    const bool by_angle = equidistant_ || !lens.tail<4>().isZero(0.0);
    Eigen::Vector2d xy = distorted;
    Distortion d = Distort(xy, lens, by_angle);
    if (has_distortion) {
      for (int i = 0; i < 20; ++i) {
        const Eigen::Vector2d error = distorted - d.value;
        if (error.squaredNorm() < 1e-26) break;
        if (!IsInvertible(d, xy)) return false;
        xy += d.J.inverse() * error;
        d = Distort(xy, lens, by_angle);
      }
      if (!((distorted - d.value).squaredNorm() < 1e-20) || !IsInvertible(d, xy)) return false;
    }
    if (!xy.allFinite()) return false;

    out->ray << xy, 1.0;
    out->J_ray_px.topRows<2>() = d.J.inverse() * Eigen::Vector2d(1.0 / fx, 1.0 / f).asDiagonal();
    out->J_ray_px.row(2).setZero();
    out->num_lens = NumDerivatives(by_lens);
    if (out->num_lens > 0) DifferentiateByLens(xy, distorted, d, lens, out);
    return true;
  }

  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point_cam,
                                         const LensParameters& lens) const override {
    if (!(point_cam.z() > 0.0)) return std::nullopt;
    const Eigen::Vector2d xy = point_cam.head<2>() / point_cam.z();
    const Distortion d = Distort(xy, lens, equidistant_ || !lens.tail<4>().isZero(0.0));
    if (!IsInvertible(d, xy)) return std::nullopt;
    return Eigen::Vector2d(lens[kFocal] * lens[kAspect] * d.value.x() + lens[kCx],
                           lens[kFocal] * d.value.y() + lens[kCy]);
  }

 private:
  static int NumDerivatives(LensDerivatives by_lens) {
    switch (by_lens) {
      case LensDerivatives::kNone:
        return 0;
      case LensDerivatives::kPinhole:
        return kAspect;
      case LensDerivatives::kRadTan:
        return kKb1;
      case LensDerivatives::kAll:
        break;
    }
    return kLensSize;
  }

  // Without distortion, and without derivatives by it: what the rest of this class computes then,
  // without inverting a distortion that is not there.
  static bool UnprojectPinhole(const Eigen::Vector2d& xy, double fx, double fy,
                               LensDerivatives by_lens, RayJet* out) {
    if (!xy.allFinite()) return false;
    out->ray << xy, 1.0;
    out->J_ray_px << 1.0 / fx, 0.0, 0.0, 1.0 / fy, 0.0, 0.0;
    out->num_lens = NumDerivatives(by_lens);
    if (out->num_lens == 0) return true;
    out->J_ray_lens.leftCols<kAspect>().setZero();
    out->J_ray_lens.col(kFocal).head<2>() = -xy / fy;
    out->J_ray_lens(0, kCx) = -1.0 / fx;
    out->J_ray_lens(1, kCy) = -1.0 / fy;
    for (int k = 0; k < kAspect; ++k) out->J_ray_px_lens[k].setZero();
    out->J_ray_px_lens[kFocal](0, 0) = -(1.0 / fx) / fy;
    out->J_ray_px_lens[kFocal](1, 1) = -(1.0 / fy) / fy;
    return true;
  }

  // Derivatives of the ray of a pixel and of its J_ray_px by the first out->num_lens parameters.
  // xy: undistorted, `distorted`: normalised coordinates; d: of the distortion at xy.
  static void DifferentiateByLens(const Eigen::Vector2d& xy, const Eigen::Vector2d& distorted,
                                  const Distortion& d, const LensParameters& lens, RayJet* out) {
    const double f = lens[kFocal], aspect = lens[kAspect], fx = f * aspect;
    const double x = xy.x(), y = xy.y(), r2 = xy.squaredNorm();
    const double p1 = lens[kP1], p2 = lens[kP2];
    const double slope = d.radial.slope, curvature = d.radial.curvature;
    const Eigen::Matrix2d J_inv = d.J.inverse();
    const Eigen::Matrix2d J_px = J_inv * Eigen::Vector2d(1.0 / fx, 1.0 / f).asDiagonal();

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

    // By each parameter: of the distorted coordinates, of the distortion at fixed xy, and of its J.
    Eigen::Matrix<double, 2, kLensSize> distorted_by = Eigen::Matrix<double, 2, kLensSize>::Zero();
    distorted_by.col(kFocal) = -distorted / f;
    distorted_by(0, kCx) = -1.0 / fx;
    distorted_by(1, kCy) = -1.0 / f;
    distorted_by(0, kAspect) = -distorted.x() / aspect;
    Eigen::Matrix<double, 2, kLensSize> value_by = Eigen::Matrix<double, 2, kLensSize>::Zero();
    std::array<Radial, 4> series;
    if (out->num_lens >= kKb1) {
      value_by.col(kK1) = xy * r2;
      value_by.col(kK2) = xy * r2 * r2;
      value_by.col(kP1) << 2.0 * x * y, r2 + 2.0 * y * y;
      value_by.col(kP2) << r2 + 2.0 * x * x, 2.0 * x * y;
    }
    if (out->num_lens == kLensSize) {
      series = AngleSeries(AngleOverRadius(r2), r2);
      for (int k = 0; k < 4; ++k) {
        value_by.col(kKb1 + k) = xy * series[static_cast<size_t>(k)].value;
      }
    }

    out->J_ray_lens.row(2).setZero();
    for (int k = 0; k < out->num_lens; ++k) {
      const Eigen::Vector2d xy_k = J_inv * (distorted_by.col(k) - value_by.col(k));
      out->J_ray_lens.col(k).head<2>() = xy_k;
      Eigen::Matrix2d J_k = J_x * xy_k.x() + J_y * xy_k.y();
      if (k == kK1) J_k += RadialJacobian(x, y, {r2, 1.0, 0.0});
      if (k == kK2) J_k += RadialJacobian(x, y, {r2 * r2, 2.0 * r2, 2.0});
      if (k == kP1) J_k += symmetric(2.0 * y, 2.0 * x, 6.0 * y);
      if (k == kP2) J_k += symmetric(6.0 * x, 2.0 * y, 2.0 * x);
      if (k >= kKb1) J_k += RadialJacobian(x, y, series[static_cast<size_t>(k - kKb1)]);
      Eigen::Matrix2d J_px_k = -(J_inv * J_k) * J_px;
      if (k == kFocal) J_px_k -= J_px / f;
      if (k == kAspect) J_px_k.col(0) -= J_px.col(0) / aspect;
      out->J_ray_px_lens[k].row(2).setZero();
      out->J_ray_px_lens[k].topRows<2>() = J_px_k;
    }
  }

  // by_angle: the lens has terms of the angle, whose series takes longest.
  Distortion Distort(const Eigen::Vector2d& xy, const LensParameters& lens, bool by_angle) const {
    const double k1 = lens[kK1], k2 = lens[kK2], p1 = lens[kP1], p2 = lens[kP2];
    const double x = xy.x(), y = xy.y(), r2 = xy.squaredNorm();
    Distortion d;
    d.radial = {(k1 + k2 * r2) * r2, k1 + 2.0 * k2 * r2, 2.0 * k2};
    if (by_angle) {
      const Radial c = AngleOverRadius(r2);
      const std::array<Radial, 4> series = AngleSeries(c, r2);
      for (int k = 0; k < 4; ++k) {
        d.radial.value += lens[kKb1 + k] * series[static_cast<size_t>(k)].value;
        d.radial.slope += lens[kKb1 + k] * series[static_cast<size_t>(k)].slope;
        d.radial.curvature += lens[kKb1 + k] * series[static_cast<size_t>(k)].curvature;
      }
      if (equidistant_) {
        d.radial.value += c.value;
        d.radial.slope += c.slope;
        d.radial.curvature += c.curvature;
      }
    }
    if (!equidistant_) d.radial.value += 1.0;
    d.value << x * d.radial.value + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * d.radial.value + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    d.J = RadialJacobian(x, y, d.radial);
    d.J(0, 0) += 2.0 * p1 * y + 6.0 * p2 * x;
    d.J(0, 1) += 2.0 * p1 * x + 2.0 * p2 * y;
    d.J(1, 0) += 2.0 * p1 * x + 2.0 * p2 * y;
    d.J(1, 1) += 6.0 * p1 * y + 2.0 * p2 * x;
    return d;
  }

  // Not beyond the fold of the distortion. A wide lens squeezes more than a fold does, so there it
  // is against the squeeze of theta alone: 1 / (1 + r^2) along the radius, theta / r across.
  bool IsInvertible(const Distortion& d, const Eigen::Vector2d& xy) const {
    const double r2 = xy.squaredNorm();
    const double plain = equidistant_ ? AngleOverRadius(r2).value / (1.0 + r2) : 1.0;
    return d.J.determinant() > 0.05 * plain;
  }

  const bool equidistant_;
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

const Lens& GetLens(DistortionModel model) {
  // A pinhole is the radial-tangential lens with coefficients zero.
  static const AxialLens pinhole(false), equidistant(true);
  return model == DistortionModel::kKannalaBrandt ? equidistant : pinhole;
}

std::string DistortionModelName(DistortionModel model) {
  switch (model) {
    case DistortionModel::kRadTan:
      return "radtan";
    case DistortionModel::kKannalaBrandt:
      return "kannala_brandt";
    case DistortionModel::kNone:
      break;
  }
  return "none";
}

}  // namespace camgyro
