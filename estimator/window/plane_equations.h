// Normal equations of the plane of a pair's matches.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PLANE_EQUATIONS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PLANE_EQUATIONS_H_

#include <Eigen/Core>

#include "estimator/window/pair_view.h"
#include "factors/robust.h"

namespace camgyro {

// Of the matches first, first + step, ..., about a plane: two coordinates of the direction
// (TangentsOf), then the bend, with its prior.
struct PlaneEquations {
  using Matrix8d = Eigen::Matrix<double, 8, 8>;
  using Vector8d = Eigen::Matrix<double, 8, 1>;

  PlaneEquations(const PairView& view, const PairPlane& plane, size_t first, size_t step);

  // Derivatives of match i's residual.
  Vector8d RowOf(const PairView& view, const PlaneResidual& r, const RobustResidual& robust,
                 size_t i) const;
  Matrix8d WithPrior() const;

  Eigen::Matrix<double, 3, 2> basis;
  Matrix8d data = Matrix8d::Zero();
  Vector8d prior = Vector8d::Zero(), g = Vector8d::Zero();
  double cost = 0.0;  // [sigmas^2]
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PLANE_EQUATIONS_H_
