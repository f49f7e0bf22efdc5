#include "factors/relative_yaw_position.h"

#include <ceres/autodiff_cost_function.h>
#include <glog/logging.h>

#include <Eigen/Core>
#include <cmath>

#include "core/linear_algebra.h"

namespace camgyro {
namespace {

class Factor {
 public:
  explicit Factor(const RelativeYawPosition& measured)
      : measured_(measured), sqrt_info_(InverseRoot(measured.covariance)) {
    CHECK(sqrt_info_.allFinite()) << "covariance:\n" << measured.covariance;
  }

  template <typename T>
  bool operator()(const T* pose_a, const T* pose_b, T* residual) const {
    using std::atan2;
    using std::cos;
    using std::sin;
    const T c = cos(pose_a[3]), s = sin(pose_a[3]);
    const T x = pose_b[0] - pose_a[0], y = pose_b[1] - pose_a[1], z = pose_b[2] - pose_a[2];
    const T turn = pose_b[3] - pose_a[3] - measured_.yaw_a_b_rad;
    Eigen::Matrix<T, 4, 1> error(c * x + s * y - measured_.p_a_b_m.x(),
                                 c * y - s * x - measured_.p_a_b_m.y(), z - measured_.p_a_b_m.z(),
                                 atan2(sin(turn), cos(turn)));
    Eigen::Map<Eigen::Matrix<T, 4, 1>> out(residual);
    out = sqrt_info_.cast<T>() * error;
    return true;
  }

 private:
  const RelativeYawPosition measured_;
  Eigen::Matrix4d sqrt_info_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> MakeRelativeYawPosition(const RelativeYawPosition& measured) {
  return std::make_unique<
      ceres::AutoDiffCostFunction<Factor, 4 /* residual */, 4 /* pose_a */, 4 /* pose_b */>>(
      new Factor(measured));
}

}  // namespace camgyro
