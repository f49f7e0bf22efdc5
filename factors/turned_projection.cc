#include "factors/turned_projection.h"

#include <ceres/sized_cost_function.h>
#include <glog/logging.h>

#include <Eigen/LU>
#include <cmath>

namespace camgyro {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

class TurnedProjectionFactor final
    : public ceres::SizedCostFunction<2 /* residual */, 4 /* shift_turn */> {
 public:
  explicit TurnedProjectionFactor(const TurnedProjection& seen)
      : R_cam_world_(seen.q_world_cam.conjugate().toRotationMatrix()),
        from_pivot_m_(seen.point_m - seen.pivot_m),
        from_cam_m_(seen.pivot_m - seen.p_cam_m),
        ray_(seen.ray.ray.head<2>() / seen.ray.ray.z()),
        px_by_ray_(seen.ray.J_ray_px.topRows<2>().inverse() / seen.sigma_px) {
    CHECK_GT(seen.sigma_px, 0.0);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Vector3d> shift_m(parameters[0]);
    const double turn_rad = parameters[0][3];
    const Vector3d turned = Eigen::AngleAxisd(turn_rad, Vector3d::UnitZ()) * from_pivot_m_;
    const Vector3d seen = R_cam_world_ * (turned + from_cam_m_ + shift_m);
    if (!(seen.z() > kLeastDepthM)) return false;
    const Vector2d projected = seen.head<2>() / seen.z();
    Eigen::Map<Vector2d>(residuals, 2) = px_by_ray_ * (ray_ - projected);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Matrix<double, 2, 3> J_projected_seen;
    J_projected_seen << Matrix2d::Identity(), -projected;
    J_projected_seen /= seen.z();
    const Eigen::Matrix<double, 2, 3> J = -px_by_ray_ * J_projected_seen * R_cam_world_;
    Eigen::Map<Eigen::Matrix<double, 2, 4, Eigen::RowMajor>> out(jacobians[0]);
    out.leftCols<3>() = J;
    out.col(3) = J * Vector3d::UnitZ().cross(turned);
    return true;
  }

 private:
  static constexpr double kLeastDepthM = 1e-6;

  const Matrix3d R_cam_world_;
  const Vector3d from_pivot_m_, from_cam_m_;
  const Vector2d ray_;
  const Matrix2d px_by_ray_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> MakeTurnedProjection(const TurnedProjection& seen) {
  return std::make_unique<TurnedProjectionFactor>(seen);
}

}  // namespace camgyro
