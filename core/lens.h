// Lens: pixel -> ray in the camera frame (x right, y down, z forward), with the derivatives that
// the propagation of noise needs. Part 1 of the measurement function (design.md section 2).
#ifndef CAMGYRO_CORE_LENS_H_
#define CAMGYRO_CORE_LENS_H_

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

namespace camgyro {

enum class DistortionModel {
  kNone,    // pinhole
  kRadTan,  // Brown-Conrady k1, k2, p1, p2 as in OpenCV, EuRoC "radial-tangential"
};

// One parameter block for every lens, so that a solver never has to know the model:
//   [ f, cx, cy, aspect, k1, k2, p1, p2 ]
// f is the focal length of the rows (fy) [px], fx = aspect * f; (cx, cy) the principal point [px];
// distortion coefficients have no unit, zero without distortion.
enum LensIndex : int { kFocal, kCx, kCy, kAspect, kK1, kK2, kP1, kP2, kLensSize };
using LensParameters = Eigen::Matrix<double, kLensSize, 1>;

LensParameters MakePinhole(double focal_px, const Eigen::Vector2d& principal_px,
                           double aspect_ratio = 1.0);

// A ray and its derivatives. Only the direction of `ray` has a meaning; its third component is 1.
struct RayJet {
  Eigen::Vector3d ray;
  Eigen::Matrix<double, 3, 2> J_ray_px;
  Eigen::Matrix<double, 3, kLensSize> J_ray_lens;
  // Derivative of J_ray_px by each lens parameter.
  std::array<Eigen::Matrix<double, 3, 2>, kLensSize> J_ray_px_lens;
};

class Lens {
 public:
  virtual ~Lens() = default;

  // Ray of a pixel and its derivative by the pixel; the derivatives by the lens only on request.
  // False where the model has no ray (outside the invertible part of the distortion): the caller
  // drops the observation.
  [[nodiscard]] virtual bool Unproject(const Eigen::Vector2d& px, const LensParameters& lens,
                                       RayJet* ray, bool derivatives_by_lens = true) const = 0;

  // Pixel of a point in the camera frame; nothing for points behind the camera.
  [[nodiscard]] virtual std::optional<Eigen::Vector2d> Project(
      const Eigen::Vector3d& point_cam, const LensParameters& lens) const = 0;

  // Names of the distortion coefficients that this model uses, in the order of the block.
  virtual std::array<const char*, 4> DistortionNames() const = 0;
};

// The lens of a model; lives as long as the program.
const Lens& GetLens(DistortionModel model);

// "none", "radtan": the value of `distortion: model:` in calibration.yaml.
std::string DistortionModelName(DistortionModel model);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_LENS_H_
