#include "estimator/vins/alignment.h"

#include <algorithm>
#include <cmath>

#include "core/linear_algebra.h"
#include "core/sphere.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kWeightRounds = 4;
constexpr int kSphereRounds = 5;
constexpr double kMinSigmaM = 1e-3, kMinSigmaMS = 2e-3;  // better is not believed at first

class LinearAlignment {
 public:
  LinearAlignment(const VinsWindow& window, const VinsStructure& structure,
                  const Vector3d& p_gyro_cam_m, double bias_sigma_m_s2)
      : window_(window),
        structure_(structure),
        arm_m_(p_gyro_cam_m),
        bias_sigma_m_s2_(bias_sigma_m_s2),
        count_(static_cast<int>(window.keyframes.size())) {
    for (int i = 0; i + 1 < count_; ++i) {
      deltas_.push_back(window.imu.Between(Keyframe(i).time_s, Keyframe(i + 1).time_s));
    }
  }

  struct Solution {
    Eigen::VectorXd velocities;  // 3 per keyframe
    Eigen::VectorXd gravity;     // coordinates in `directions`
    double scale = 0.0;
    Vector3d bias_accel = Vector3d::Zero();
  };

  // Gravity is `known` + directions * (2 or 3 unknowns).
  Solution Solve(const Vector3d& known, const Eigen::Matrix3Xd& directions) const {
    const int n_gravity = static_cast<int>(directions.cols());
    const int scale = 3 * count_, gravity = scale + 1, bias = gravity + n_gravity;
    const int rows = 6 * (count_ - 1);
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(rows + 3, bias + 3);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(rows + 3);
    double sigma_m = 0.01, sigma_m_s = 0.01;
    Eigen::VectorXd x;
    for (int round = 0; round < kWeightRounds; ++round) {
      for (int i = 0; i + 1 < count_; ++i) {
        const ImuDelta& d = deltas_[static_cast<size_t>(i)];
        const Matrix3d R = Rotation(i);
        const double dt = d.dt_s;
        auto position = A.middleRows<3>(6 * i), velocity = A.middleRows<3>(6 * i + 3);
        const double w_p = 1.0 / sigma_m, w_v = 1.0 / sigma_m_s;
        position.col(scale) = w_p * (structure_.centres.col(i + 1) - structure_.centres.col(i));
        position.middleCols<3>(3 * i) = -w_p * dt * Matrix3d::Identity();
        position.middleCols(gravity, n_gravity) = -w_p * 0.5 * dt * dt * directions;
        position.middleCols<3>(bias) = -w_p * R * d.J_dp_bias_accel;
        b.segment<3>(6 * i) =
            w_p * (R * d.dp + (Rotation(i + 1) - R) * arm_m_ + 0.5 * dt * dt * known);
        velocity.middleCols<3>(3 * i) = -w_v * Matrix3d::Identity();
        velocity.middleCols<3>(3 * (i + 1)) = w_v * Matrix3d::Identity();
        velocity.middleCols(gravity, n_gravity) = -w_v * dt * directions;
        velocity.middleCols<3>(bias) = -w_v * R * d.J_dv_bias_accel;
        b.segment<3>(6 * i + 3) = w_v * (R * d.dv + dt * known);
      }
      A.block<3, 3>(rows, bias) = Matrix3d::Identity() / bias_sigma_m_s2_;
      x = LeastSquares(A, b);
      const Eigen::VectorXd residual = A * x - b;
      double sum_p = 0.0, sum_v = 0.0;
      for (int i = 0; i + 1 < count_; ++i) {
        sum_p += residual.segment<3>(6 * i).squaredNorm();
        sum_v += residual.segment<3>(6 * i + 3).squaredNorm();
      }
      sigma_m = std::max(kMinSigmaM, sigma_m * std::sqrt(sum_p / (3.0 * (count_ - 1))));
      sigma_m_s = std::max(kMinSigmaMS, sigma_m_s * std::sqrt(sum_v / (3.0 * (count_ - 1))));
    }
    return {x.head(3 * count_), x.segment(gravity, n_gravity), x[scale], x.segment<3>(bias)};
  }

  Matrix3d Rotation(int i) const { return Keyframe(i).q_world_gyro.toRotationMatrix(); }
  int count() const { return count_; }

 private:
  const VinsKeyframe& Keyframe(int i) const { return window_.keyframes[static_cast<size_t>(i)]; }

  const VinsWindow& window_;
  const VinsStructure& structure_;
  const Vector3d arm_m_;
  const double bias_sigma_m_s2_;
  const int count_;
  std::vector<ImuDelta> deltas_;
};

}  // namespace

Result<VinsAlignment> AlignWithInertial(const VinsWindow& window, const VinsStructure& structure,
                                        const Vector3d& p_gyro_cam_m, double bias_sigma_m_s2,
                                        double gravity_m_s2) {
  const LinearAlignment linear(window, structure, p_gyro_cam_m, bias_sigma_m_s2);
  LinearAlignment::Solution solution = linear.Solve(Vector3d::Zero(), Matrix3d::Identity());
  VinsAlignment alignment;
  alignment.free_gravity_m_s2 = solution.gravity.norm();
  Vector3d gravity = gravity_m_s2 * solution.gravity.normalized();
  for (int round = 0; round < kSphereRounds; ++round) {
    const Eigen::Matrix3Xd tangent = TangentsOf(gravity.normalized());
    solution = linear.Solve(gravity, gravity_m_s2 * tangent);
    gravity =
        gravity_m_s2 * (gravity / gravity_m_s2 + tangent * solution.gravity.head<2>()).normalized();
  }
  if (!(solution.scale > 0.0) || !gravity.allFinite() || !solution.velocities.allFinite()) {
    return CannotEstimate(
        "the accelerometer and the camera's path do not fit together: the scale "
        "between them comes out as " +
        std::to_string(solution.scale));
  }
  alignment.scale = solution.scale;
  alignment.gravity_world = gravity;
  alignment.bias_accel_m_s2 = solution.bias_accel;
  alignment.v_world_m_s =
      Eigen::Map<Eigen::Matrix3Xd>(solution.velocities.data(), 3, linear.count());
  alignment.p_world_m.resize(3, linear.count());
  for (int i = 0; i < linear.count(); ++i) {
    alignment.p_world_m.col(i) = solution.scale * structure.centres.col(i) -
                                 (linear.Rotation(i) - linear.Rotation(0)) * p_gyro_cam_m;
  }
  return alignment;
}

}  // namespace camgyro
