#include "estimator/window/plane_equations.h"

#include "core/sphere.h"
#include "factors/coplanarity_plane.h"

namespace camgyro {

PlaneEquations::PlaneEquations(const PairView& view, const PairPlane& plane, size_t first,
                               size_t step)
    : basis(TangentsOf(plane.tau)) {
  const PairMeasurement& m = view.measurement;
  prior.tail<6>() = view.bend_sigma_rad.cwiseAbs2().cwiseInverse();
  g.tail<6>() = prior.tail<6>().cwiseProduct(plane.bend);
  cost = plane.bend.dot(g.tail<6>());
  for (size_t i = first; i < m.matches.size(); i += step) {
    const PlaneResidual r = ResidualOf(view, plane, i);
    const RobustResidual robust = Robustify(r.value, m.robust_threshold);
    const Vector8d J = RowOf(view, r, robust, i);
    data += J * J.transpose();
    g += J * robust.value;
    cost += robust.value * robust.value;
  }
}

PlaneEquations::Vector8d PlaneEquations::RowOf(const PairView& view, const PlaneResidual& r,
                                               const RobustResidual& robust, size_t i) const {
  const PairMeasurement& m = view.measurement;
  const Eigen::Vector2d shares = CoplanarityPlane::BendShares(m, m.matches[i]);
  Vector8d J;
  J.head<2>() = robust.derivative * (basis.transpose() * r.by_tau);
  J.segment<3>(2) = robust.derivative * shares[0] * r.by_tau;
  J.tail<3>() = robust.derivative * shares[1] * r.by_tau;
  return J;
}

PlaneEquations::Matrix8d PlaneEquations::WithPrior() const {
  Matrix8d H = data;
  H.diagonal() += prior;
  H.diagonal().array() += 1e-9;  // a direction that nothing determines
  return H;
}

}  // namespace camgyro
