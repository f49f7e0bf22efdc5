#include "core/known_camera.h"

#include <algorithm>

#include "core/division_lens.h"
#include "core/lens.h"

namespace camgyro {

Calibration DeclaredCamera(const CameraGuess& camera, double focal_px) {
  Calibration c;
  c.width_px = camera.width_px;
  c.height_px = camera.height_px;
  c.distortion_model = camera.distortion_model;
  c.lens = MakePinhole(focal_px, camera.Centre(), camera.aspect_ratio);
  for (size_t i = 0; i < std::min<size_t>(camera.distortion.size(), 4); ++i) {
    c.lens[FirstCoefficient(camera.distortion_model) + static_cast<int>(i)] = camera.distortion[i];
  }
  return c;
}

Calibration KnownCamera(const CameraGuess& camera, double focal_px) {
  Calibration c = DeclaredCamera(camera, focal_px);
  if (camera.division_lambda == 0.0) return c;
  const DivisionLens lens(camera.division_lambda, camera.Centre(),
                          Eigen::Vector2d(camera.width_px, camera.height_px));
  c.distortion_model = DistortionModel::kRadTan;
  c.lens.segment<2>(kK1) = RadTanLike(camera.division_lambda, lens.radius_px() / focal_px);
  return c;
}

std::vector<Match> ThroughPinhole(const Calibration& camera, const std::vector<Match>& matches) {
  const Lens& lens = GetLens(camera.distortion_model);
  const Eigen::Vector2d focal_px(camera.lens[kAspect] * camera.lens[kFocal], camera.lens[kFocal]);
  std::vector<Match> seen;
  for (Match match : matches) {
    RayJet a, b;
    if (!lens.Unproject(match.px_a, camera.lens, &a, LensDerivatives::kNone) ||
        !lens.Unproject(match.px_b, camera.lens, &b, LensDerivatives::kNone)) {
      continue;
    }
    match.px_a = camera.lens.segment<2>(kCx) + focal_px.cwiseProduct(a.ray.head<2>());
    match.px_b = camera.lens.segment<2>(kCx) + focal_px.cwiseProduct(b.ray.head<2>());
    seen.push_back(match);
  }
  return seen;
}

}  // namespace camgyro
