#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <vector>

#include "core/so3.h"
#include "simulation/trajectory.h"

namespace camgyro::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct StampedPose {
  double time_s;
  Eigen::Isometry3d T_world_cam;
};

// Cumulative cubic B-spline; the recursion for the rates is that of Sommer et al., "Efficient
// derivative computation for cumulative B-splines on Lie groups", CVPR 2020, sections 4-5.
class SplineTrajectory final : public Trajectory {
 public:
  SplineTrajectory(std::vector<Eigen::Isometry3d> knots, double knot_s)
      : knots_(std::move(knots)), knot_s_(knot_s) {}

  CameraState At(double time_s) const override {
    const double last = static_cast<double>(knots_.size()) - 4.0;
    const double position = std::clamp(time_s / knot_s_, 0.0, last + 1.0);
    const double first = std::min(std::floor(position), last);
    const double u = position - first;
    const bool held = time_s < 0.0 || time_s > (last + 1.0) * knot_s_;
    const double rate = held ? 0.0 : 1.0 / knot_s_;
    const Vector3d lambda((5.0 + u * (3.0 + u * (-3.0 + u))) / 6.0,
                          (1.0 + u * (3.0 + u * (3.0 - 2.0 * u))) / 6.0, u * u * u / 6.0);
    const Vector3d lambda_1 = rate * Vector3d((1.0 + u * (-2.0 + u)) / 2.0,
                                              (1.0 + u * (2.0 - 2.0 * u)) / 2.0, u * u / 2.0);
    const Vector3d lambda_2 = rate * rate * Vector3d(u - 1.0, 1.0 - 2.0 * u, u);

    const auto* knot = &knots_[static_cast<size_t>(first)];
    CameraState state;
    state.R_world_cam = knot[0].linear();
    state.p_world_m = knot[0].translation();
    state.v_world_m_s = state.a_world_m_s2 = Vector3d::Zero();
    state.omega_cam_rad_s = state.alpha_cam_rad_s2 = Vector3d::Zero();
    for (int j = 0; j < 3; ++j) {
      const Vector3d step = knot[j + 1].translation() - knot[j].translation();
      state.p_world_m += lambda[j] * step;
      state.v_world_m_s += lambda_1[j] * step;
      state.a_world_m_s2 += lambda_2[j] * step;
      const Vector3d turn =
          Log(Eigen::Quaterniond(knot[j].linear().transpose() * knot[j + 1].linear()));
      const Matrix3d A = Exp(Vector3d(lambda[j] * turn)).toRotationMatrix();
      state.R_world_cam = state.R_world_cam * A;
      const Vector3d omega = A.transpose() * state.omega_cam_rad_s;
      state.alpha_cam_rad_s2 = A.transpose() * state.alpha_cam_rad_s2 +
                               lambda_1[j] * omega.cross(turn) + lambda_2[j] * turn;
      state.omega_cam_rad_s = omega + lambda_1[j] * turn;
    }
    return state;
  }

 private:
  std::vector<Eigen::Isometry3d> knots_;
  double knot_s_;
};

Eigen::Isometry3d Interpolate(const StampedPose& a, const StampedPose& b, double time_s) {
  const double weight = (time_s - a.time_s) / (b.time_s - a.time_s);
  const Eigen::Quaterniond q_a(a.T_world_cam.linear()), q_b(b.T_world_cam.linear());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = q_a.slerp(weight, q_b).toRotationMatrix();
  pose.translation() =
      (1.0 - weight) * a.T_world_cam.translation() + weight * b.T_world_cam.translation();
  return pose;
}

// The poses at the knots of a spline.
std::vector<Eigen::Isometry3d> KnotsOf(const std::vector<StampedPose>& poses, double knot_s) {
  std::vector<Eigen::Isometry3d> knots;
  size_t next = 1;
  for (int i = -1; i * knot_s <= poses.back().time_s; ++i) {
    const double time_s = std::max(0.0, i * knot_s);
    while (poses[next].time_s < time_s) ++next;
    knots.push_back(Interpolate(poses[next - 1], poses[next], time_s));
  }
  return knots;
}

}  // namespace

Result<std::shared_ptr<const Trajectory>> ReadTrajectory(const std::string& path, double knot_s,
                                                         const Eigen::Isometry3d& T_pose_cam) {
  std::ifstream file(path);
  if (!file) return BadInput(path + ": cannot open the trajectory");
  // From z up to y down.
  Matrix3d R_down_up;
  R_down_up << 1, 0, 0, 0, 0, -1, 0, 1, 0;

  std::vector<StampedPose> poses;
  std::string line;
  double origin = 0.0;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line[0] == '#' || line[0] == '\r') continue;
    const bool euroc = line.find(',') != std::string::npos;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    double stamp, v[7];
    words >> stamp;
    for (double& value : v) words >> value;
    const Eigen::Quaterniond q = euroc ? Eigen::Quaterniond(v[3], v[4], v[5], v[6])
                                       : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
    if (!words || std::abs(q.norm() - 1.0) > 0.01) {
      return BadInput(path + ":" + std::to_string(number) +
                      ": expected \"t x y z qx qy qz qw\" or \"t[ns],x,y,z,qw,qx,qy,qz\" with a "
                      "unit quaternion");
    }
    if (poses.empty()) origin = stamp;
    const double time_s = (stamp - origin) * (euroc ? 1e-9 : 1.0);
    if (!poses.empty() && time_s <= poses.back().time_s) {
      return BadInput(path + ":" + std::to_string(number) + ": the time does not increase");
    }
    Eigen::Isometry3d T_up_pose = Eigen::Isometry3d::Identity();
    T_up_pose.linear() = q.normalized().toRotationMatrix();
    T_up_pose.translation() = Vector3d(v[0], v[1], v[2]);
    poses.push_back({time_s, Eigen::Isometry3d(R_down_up) * T_up_pose * T_pose_cam});
  }
  if (poses.size() < 2 || poses.back().time_s < 4.0 * knot_s) {
    return BadInput(path + ": a trajectory needs at least four knots of " + std::to_string(knot_s) +
                    " s");
  }

  std::vector<Eigen::Isometry3d> knots = KnotsOf(poses, knot_s);
  // The world's origin is the start, as for the other motions.
  const Vector3d start = knots.front().translation();
  for (Eigen::Isometry3d& knot : knots) knot.translation() -= start;
  return std::make_shared<SplineTrajectory>(std::move(knots), knot_s);
}

std::shared_ptr<const Trajectory> TurnsOfLog(const DeviceLog& log,
                                             const Eigen::Quaterniond& q_gyro_cam) {
  std::vector<StampedPose> poses;
  Eigen::Quaterniond q_world_gyro = q_gyro_cam.conjugate();  // the camera is level
  for (size_t i = 0; i < log.gyro_ns.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const double time_s = 1e-9 * static_cast<double>(log.gyro_ns[i]);
    if (i > 0) {
      const Vector3d mean =
          0.5 * (log.rate_gyro_rad_s.col(column - 1) + log.rate_gyro_rad_s.col(column));
      const Vector3d turn = (time_s - poses.back().time_s) * mean;
      q_world_gyro = (q_world_gyro * Exp(turn)).normalized();
    }
    poses.push_back({time_s, Eigen::Isometry3d(q_world_gyro * q_gyro_cam)});
  }
  const double interval_s = poses.back().time_s / static_cast<double>(poses.size() - 1);
  const double knot_s = 2.0 * interval_s;
  return std::make_shared<SplineTrajectory>(KnotsOf(poses, knot_s), knot_s);
}

}  // namespace camgyro::simulation
