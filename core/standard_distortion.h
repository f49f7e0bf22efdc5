// The fitted lens in the coefficients that other programs know.
#ifndef CAMGYRO_CORE_STANDARD_DISTORTION_H_
#define CAMGYRO_CORE_STANDARD_DISTORTION_H_

#include <Eigen/Core>

#include "core/lens.h"

namespace camgyro {

// A lens in the four coefficients that other programs know.
struct DistortionCoefficients {
  DistortionModel model = DistortionModel::kNone;
  Eigen::Vector4d k = Eigen::Vector4d::Zero();  // of `model`
  Eigen::Matrix<double, 4, kLensSize> by_lens;  // derivative of k
};
// Of a pinhole with kb: the Kannala-Brandt lens that is nearest to it, along the rays of a picture
// of this size (rms; a tangential part is left out).
DistortionCoefficients StandardDistortion(DistortionModel model, const LensParameters& lens,
                                          const Eigen::Vector2d& size_px);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_STANDARD_DISTORTION_H_
