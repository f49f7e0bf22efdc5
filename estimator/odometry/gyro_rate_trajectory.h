// The way at every gyro sample, through what is finally known of the keyframes.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_GYRO_RATE_TRAJECTORY_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_GYRO_RATE_TRAJECTORY_H_

#include <cstdint>
#include <vector>

#include "core/recording.h"
#include "estimator/odometry/navigation_state.h"
#include "estimator/odometry/odometry.h"

namespace camgyro {

struct StateAtTime {
  int64_t time_ns = 0;  // gyro clock
  int segment = 0;
  NavigationState state;
};

// States at the stamps of all gyro samples that lie between two neighbouring keyframes of the same
// segment; keyframes are by time. From each keyframe the inertial data are integrated with its
// biases. Where they arrive differs from the next keyframe by a rotation d (right perturbation), a
// velocity dv and a position dp; after the share s of the span T the state is corrected by
//   rotation  s d
//   position  (3 s^2 - 2 s^3) dp + (s^3 - s^2) T dv,   velocity: its derivative by time,
// which is what white noise of the gyro and of the accelerometer most probably were (the least
// integral of their squares), to first order and with both taken for independent. The result goes
// through every keyframe; rotation, position and velocity are continuous.
std::vector<StateAtTime> AtGyroRate(const std::vector<GyroSample>& gyro,
                                    const std::vector<AccelSample>& accel,
                                    const std::vector<OdometryPose>& keyframes,
                                    double gravity_m_s2);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_GYRO_RATE_TRAJECTORY_H_
