#include "core/standard_distortion.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/linear_algebra.h"

namespace camgyro {

DistortionCoefficients StandardDistortion(DistortionModel model, const LensParameters& lens,
                                          const Eigen::Vector2d& size_px) {
  DistortionCoefficients result;
  result.by_lens.setZero();
  if (model == DistortionModel::kKannalaBrandt || lens.tail<4>().isZero(0.0)) {
    result.model = model;
    if (model == DistortionModel::kNone && !lens.segment<4>(kK1).isZero(0.0)) {
      result.model = DistortionModel::kRadTan;
    }
    const LensIndex first = FirstCoefficient(result.model);
    result.k = lens.segment<4>(first);
    result.by_lens.middleCols<4>(first).setIdentity();
    return result;
  }
  // theta + sum k_i theta^(2i+1) = r (radial part), least squares over the angles of the picture.
  result.model = DistortionModel::kKannalaBrandt;
  LensParameters axial = lens;
  axial[kP1] = axial[kP2] = 0.0;
  double radius = 0.0;
  for (const double u : {0.0, size_px.x()}) {
    for (const double v : {0.0, size_px.y()}) {
      RayJet ray;
      if (GetLens(model).Unproject({u, v}, axial, &ray, LensDerivatives::kNone)) {
        radius = std::max(radius, ray.ray.head<2>().norm());
      }
    }
  }
  constexpr int kAngles = 200;
  const double widest = radius > 0.0 ? std::atan(radius) : 1.0;
  Eigen::MatrixXd A(kAngles, 4);
  Eigen::MatrixXd by_lens = Eigen::MatrixXd::Zero(kAngles, kLensSize);
  Eigen::VectorXd rest(kAngles);  // what the coefficients do not change
  for (int i = 0; i < kAngles; ++i) {
    const double theta = widest * (i + 0.5) / kAngles, r = std::tan(theta);
    for (int k = 0; k < 4; ++k) A(i, k) = std::pow(theta, 2 * k + 3);
    by_lens.col(kK1)[i] = r * r * r;
    by_lens.col(kK2)[i] = r * r * r * r * r;
    by_lens.block<1, 4>(i, kKb1) = A.row(i);
    rest[i] = r - theta;
  }
  result.by_lens = LeastSquares(A, by_lens);
  result.k = LeastSquares(A, rest + by_lens * axial);
  return result;
}

}  // namespace camgyro
