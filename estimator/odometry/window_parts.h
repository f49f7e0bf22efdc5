// What the odometry's window consists of.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_WINDOW_PARTS_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_WINDOW_PARTS_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "estimator/odometry/navigation_state.h"
#include "factors/row_projection.h"

namespace camgyro {

// A keyframe. Parameter blocks have addresses for life: keyframes live in a deque, landmarks in a
// map.
struct OdometryNode {
  int64_t frame_stamp_ns = 0, time_ns = 0;
  int64_t frame_number = 0;
  NavigationState state;  // its position is counted from origin_m_
  // From the keyframe before; null at the oldest.
  std::unique_ptr<ceres::CostFunction> inertial, gyro_walk, accel_walk;

  double* q() { return state.q_world_gyro.coeffs().data(); }
  double* p() { return state.p_world_m.data(); }
  double* v() { return state.v_world_m_s.data(); }
  double* bias_gyro() { return state.bias_gyro_rad_s.data(); }
  double* bias_accel() { return state.bias_accel_m_s2.data(); }
};

struct OdometrySighting {
  OdometryNode* keyframe = nullptr;
  RowProjectionMeasurement measurement;
  std::unique_ptr<ceres::CostFunction> factor;
};

struct OdometryLandmark {
  // Homogeneous, unit norm, as RowProjection takes it, from origin_m_; all zero: not known yet.
  Eigen::Vector4d point = Eigen::Vector4d::Zero();
  std::vector<OdometrySighting> sightings;  // by keyframe
  // The prior speaks of it: keyframes that have left the window saw it.
  bool in_prior = false;

  bool known() const { return !point.isZero(); }
  bool used() const { return known() && (in_prior || sightings.size() >= 2); }
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_WINDOW_PARTS_H_
