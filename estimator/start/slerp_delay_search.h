// Delay by grid search over a window of camera rotations: Feng, Li & Dai, CSNC 2018, eq. (1)-(3).
#ifndef CAMGYRO_ESTIMATOR_START_SLERP_DELAY_SEARCH_H_
#define CAMGYRO_ESTIMATOR_START_SLERP_DELAY_SEARCH_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

enum class SlerpReference {
  kGyro,    // the paper's: gyro changes between the stamps stand, camera attitudes are interpolated
  kCamera,  // camera changes stand, the gyro (sampled faster, so interpolated with less error)
            // moves
};

struct SlerpOptions {
  int window_pairs = 50;
  double centre_s = 0.0;  // delays centre_s +- range_s are searched
  double range_s = 0.5;
  double step_s = 0.001;
  SlerpReference reference = SlerpReference::kGyro;
};

struct SlerpDelayPoint {
  double delay_s = 0.0;
  double mean_square_rad2 = 0.0;  // of the angle of the quaternion error of eq. (2)
};

struct SlerpDelay {
  // Design sign: t_gyro = t_camera + delay. The paper's t_d (t' = t + t_d, t' the frame's stamp) is
  // minus this. Minimum of the parabola through the best grid point and its neighbours.
  double delay_s = 0.0;
  std::vector<SlerpDelayPoint> curve;  // ascending delays, all of `terms` terms
  int terms = 0;
};

// Window of `window_pairs` consecutive camera rotations (each starts at the frame where the one
// before ends) from rotations[first] on; q_gyro_cam and the gyro's bias are taken as known.
//
// Eq. (3) averages error quaternions. Their vector parts cancel between terms of opposite sign, so
// what is minimised here is what their scalar part measures: 1 - w = angle^2 / 8.
//
// Errors: kBadUsage for options out of range; kBadInput for rotations that are not consecutive;
// kCannotEstimate if window or gyro are too short for the range, or the minimum is at its edge.
Result<SlerpDelay> SlerpDelaySearch(const Recording& recording,
                                    const std::vector<CameraRotation>& rotations, int first,
                                    const Eigen::Quaterniond& q_gyro_cam,
                                    const Eigen::Vector3d& bias_gyro_rad_s,
                                    const SlerpOptions& options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_SLERP_DELAY_SEARCH_H_
