// Unit vectors: directions of a translation, or of gravity.
#ifndef CAMGYRO_CORE_SPHERE_H_
#define CAMGYRO_CORE_SPHERE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace camgyro {

// Two unit vectors across a unit vector and across each other: the columns of an orthonormal basis
// of the sphere's tangent plane there, in which a direction has two coordinates. The three are
// right-handed: column 0 x column 1 = the vector. The basis is no continuous function of it.
inline Eigen::Matrix<double, 3, 2> TangentsOf(const Eigen::Vector3d& unit) {
  Eigen::Matrix<double, 3, 2> tangents;
  tangents.col(0) = unit.unitOrthogonal();
  tangents.col(1) = unit.cross(tangents.col(0));
  return tangents;
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_SPHERE_H_
