#include "core/division_lens.h"

#include <Eigen/Dense>

namespace camgyro {
namespace {

// Least squares of radii over the picture: powers(undistorted radius, terms) for each coefficient.
template <int kTerms, typename Powers>
Eigen::Matrix<double, kTerms, 1> Fit(double lambda, double edge, const Powers& powers) {
  constexpr int kRadii = 40;
  Eigen::Matrix<double, kRadii, kTerms> A;
  Eigen::Matrix<double, kRadii, 1> b;
  for (int i = 0; i < kRadii; ++i) {
    const double part = (i + 1.0) / kRadii, seen = part * edge;
    const double pinhole = seen / (1.0 + lambda * part * part);
    A.row(i) = powers(pinhole);
    b[i] = seen - pinhole;
  }
  return A.colPivHouseholderQr().solve(b);
}

}  // namespace

Eigen::Vector2d RadTanLike(double lambda, double edge_tan) {
  return Fit<2>(lambda, edge_tan,
                [](double r) { return Eigen::RowVector2d(std::pow(r, 3), std::pow(r, 5)); });
}

Eigen::Vector4d KannalaBrandtLike(double lambda, double edge_tan) {
  return Fit<4>(lambda, edge_tan, [](double r) {
    const double a = std::atan(r);
    return Eigen::RowVector4d(std::pow(a, 3), std::pow(a, 5), std::pow(a, 7), std::pow(a, 9));
  });
}

}  // namespace camgyro
