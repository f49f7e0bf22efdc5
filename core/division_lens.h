// A distorting lens with one parameter, in pixels: what matches alone can tell of a lens.
#ifndef CAMGYRO_CORE_DIVISION_LENS_H_
#define CAMGYRO_CORE_DIVISION_LENS_H_

#include <Eigen/Core>
#include <cmath>

namespace camgyro {

// The division model of Fitzgibbon (CVPR 2001): what a pinhole would show at
//   centre + (px - centre) / (1 + lambda q),   q = |px - centre|^2 / R^2,
// is seen at px. R is the distance of the centre from the farthest corner of the picture [px], so
// that lambda, which has no unit, is how far the lens moves a corner, as part of its distance:
// negative for a barrel. Focal lengths are the same through both, at the centre.
class DivisionLens {
 public:
  DivisionLens(double lambda, const Eigen::Vector2d& centre_px, const Eigen::Vector2d& size_px)
      : lambda_(lambda),
        centre_px_(centre_px),
        radius2_px2_((size_px / 2.0 + (centre_px - size_px / 2.0).cwiseAbs()).squaredNorm()) {}

  // False where there is no ray, and beyond which pixels come nearer again.
  bool HasRay(const Eigen::Vector2d& px) const { return std::abs(lambda_ * Part(px)) < 1.0; }
  // Where a pinhole would show it.
  Eigen::Vector2d Undistorted(const Eigen::Vector2d& px) const {
    return centre_px_ + (px - centre_px_) / (1.0 + lambda_ * Part(px));
  }
  double radius_px() const { return std::sqrt(radius2_px2_); }
  // How much longer a short line gets by that, on average of all directions (root of the area's).
  double Stretch(const Eigen::Vector2d& px) const {
    const double bent = lambda_ * Part(px);
    return std::sqrt((1.0 - bent) / std::pow(1.0 + bent, 3));
  }

 private:
  double Part(const Eigen::Vector2d& px) const {
    return (px - centre_px_).squaredNorm() / radius2_px2_;
  }

  const double lambda_;
  const Eigen::Vector2d centre_px_;
  const double radius2_px2_;
};

// The coefficients (k1, k2), or (kb1..kb4) of a pinhole's lens block (core/lens.h), with which such
// a lens images the angles of a picture whose corner is at edge_tan (radius over focal length) most
// nearly: least squares of the radii.
Eigen::Vector2d RadTanLike(double lambda, double edge_tan);
Eigen::Vector4d KannalaBrandtLike(double lambda, double edge_tan);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_DIVISION_LENS_H_
