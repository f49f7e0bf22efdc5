// Lens: pixel -> ray in the camera frame (x right, y down, z forward), with the derivatives that
// the propagation of noise needs. Part 1 of the measurement function (docs/architecture.md).
#ifndef CAMGYRO_CORE_LENS_H_
#define CAMGYRO_CORE_LENS_H_

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

namespace camgyro {

enum class DistortionModel {
  kNone,           // pinhole
  kRadTan,         // Brown-Conrady k1, k2, p1, p2 as in OpenCV, EuRoC "radial-tangential"
  kKannalaBrandt,  // k1..k4 of Kannala & Brandt 2006, as OpenCV's fisheye, Kalibr "equidistant"
};

// One parameter block for every lens, so that a solver never has to know the model:
//   [ f, cx, cy, aspect, k1, k2, p1, p2, kb1, kb2, kb3, kb4 ]
// f is the focal length of the rows (fy) [px], fx = aspect * f; (cx, cy) the principal point [px];
// distortion coefficients have no unit, zero without distortion. With (x, y) = (X/Z, Y/Z), r its
// norm and theta = atan r, a pixel is at f times
//   (x, y) (b + k1 r^2 + k2 r^4 + (kb1 theta^3 + kb2 theta^5 + kb3 theta^7 + kb4 theta^9) / r)
//   + tangential(p1, p2)
// with b = 1, but b = theta / r for kKannalaBrandt, whose k1..k4 the kb are. A pinhole with kb is
// how a wide lens departs from one: the way that an effect of the lens takes from none.
enum LensIndex : int {
  kFocal,
  kCx,
  kCy,
  kAspect,
  kK1,
  kK2,
  kP1,
  kP2,
  kKb1,
  kKb2,
  kKb3,
  kKb4,
  kLensSize
};
using LensParameters = Eigen::Matrix<double, kLensSize, 1>;

LensParameters MakePinhole(double focal_px, const Eigen::Vector2d& principal_px,
                           double aspect_ratio = 1.0);

// Lens parameters to differentiate by: none, f with the principal point, all but kb1..kb4, all.
enum class LensDerivatives { kNone, kPinhole, kRadTan, kAll };

// A ray and its derivatives. Only the direction of `ray` has a meaning; its third component is 1.
struct RayJet {
  Eigen::Vector3d ray;
  Eigen::Matrix<double, 3, 2> J_ray_px;
  int num_lens = 0;  // the next two are by so many lens parameters
  Eigen::Matrix<double, 3, kLensSize> J_ray_lens;
  // Derivative of J_ray_px by each lens parameter.
  std::array<Eigen::Matrix<double, 3, 2>, kLensSize> J_ray_px_lens;
};

class Lens {
 public:
  virtual ~Lens() = default;

  // Ray of a pixel and its derivative by the pixel; the derivatives by the lens as asked for.
  // False where the model has no ray (outside the invertible part of the distortion): the caller
  // drops the observation.
  [[nodiscard]] virtual bool Unproject(const Eigen::Vector2d& px, const LensParameters& lens,
                                       RayJet* ray,
                                       LensDerivatives by_lens = LensDerivatives::kAll) const = 0;

  // Pixel of a point in the camera frame; nothing for points behind the camera.
  [[nodiscard]] virtual std::optional<Eigen::Vector2d> Project(
      const Eigen::Vector3d& point_cam, const LensParameters& lens) const = 0;
};

// The lens of a model; lives as long as the program.
const Lens& GetLens(DistortionModel model);

// "none", "radtan", "kannala_brandt": the value of `distortion: model:` in calibration.yaml.
std::string DistortionModelName(DistortionModel model);

// Where a model's four coefficients begin in the lens block.
inline LensIndex FirstCoefficient(DistortionModel model) {
  return model == DistortionModel::kKannalaBrandt ? kKb1 : kK1;
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_LENS_H_
