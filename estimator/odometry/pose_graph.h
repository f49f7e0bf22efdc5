// The way of an odometry, bent so that it closes where a place was seen again: keyframes with four
// degrees of freedom, joined in their order by what the odometry says of the way between them, and
// across by loops.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_POSE_GRAPH_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_POSE_GRAPH_H_

#include <Eigen/Core>
#include <vector>

#include "core/result.h"
#include "estimator/odometry/odometry.h"
#include "factors/relative_yaw_position.h"

namespace camgyro {

// Yaws of keyframes are turns about the world's z from what the odometry says of them, since an
// orientation has no heading of its own: all are zero at first, and "the frame of a, turned
// upright" of a measurement is the world as the odometry had it at a.

// A keyframe's place relative to an older one, as pictures have it.
struct LoopEdge {
  size_t older = 0, newer = 0;  // indices of keyframes
  RelativeYawPosition measured;
};

struct ClosedLoops {
  // Yaw, position and velocity moved, with their covariance; all else as the odometry has it. As it
  // was if no loop is believed.
  std::vector<OdometryPose> keyframes;
  std::vector<bool> believed;  // of the loops, in their order
  // Of all residuals in sigmas, per loop's four: 1 if odometry and loops are as good as they say.
  // The sigmas have been multiplied by its root where it is beyond what chance makes of 1.
  double variance_factor = 1.0;
};

// The way from keyframe i to i + 1 as the odometry has it. Its covariance is the increment that
// takes the covariance of the one to that of the other, so that the chain of all of them claims of
// every keyframe what the odometry claims:  Q = C_b - F C_a F',  F: what a turn at a does at b.
// Where the odometry has become surer (Q is not positive definite), a least sigma stays in its
// place. The first keyframe is the frame of all.
RelativeYawPosition WayBetween(const OdometryPose& a, const OdometryPose& b);

// The most likely poses of keyframes (by time) given both. Loops are weighed down by a Cauchy loss
// at 2 sigma; those that are beyond 5 sigma then are not believed and leave. The covariance counts
// loops as independent of each other; it is widened where they contradict the odometry. Errors:
// kBadInput for a loop between keyframes that are not there or not in order; kCannotEstimate if
// Ceres finds no solution.
Result<ClosedLoops> CloseLoops(const std::vector<OdometryPose>& keyframes,
                               const std::vector<LoopEdge>& loops);

// Poses of frames, as known at their time, moved as the keyframes among them have moved since: one
// between two keyframes of its segment by shares of time, one before or after all of them as the
// nearest. They get the covariance of these keyframes, by the same shares. Frames of a segment
// without keyframes stay. All by time.
std::vector<OdometryPose> MoveWithKeyframes(const std::vector<OdometryPose>& frames,
                                            const std::vector<OdometryPose>& keyframes);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_POSE_GRAPH_H_
