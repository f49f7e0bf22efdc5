// Image motion by rotation alone, as the gyro and a calibration give it: where the tracker should
// look, and the common orientation in which outliers show.
#ifndef CAMGYRO_FRONTEND_GYRO_ROTATION_H_
#define CAMGYRO_FRONTEND_GYRO_ROTATION_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/rotation_chain.h"
#include "frontend/outliers.h"

namespace camgyro {

class GyroRotation {
 public:
  // Between the frames of these two stamps (camera clock). Nothing if the gyro does not cover both.
  // Copies what it needs.
  static std::optional<GyroRotation> Between(const std::vector<GyroSample>& gyro,
                                             const Calibration& calibration, int64_t stamp_a_ns,
                                             int64_t stamp_b_ns);

  // Where a point of frame a, infinitely far away, is seen in frame b. NaN where the lens has no
  // ray or the point gets out of sight.
  Eigen::Vector2d Predict(const Eigen::Vector2d& px_a) const;

  // Both rays in the gyro frame at the pair's beginning, each feature by its own row times. Nothing
  // where the lens has no ray.
  std::optional<RotatedMatch> Rotate(const Match& match) const;

  // Both rays as a global shutter would have seen them, had the camera only turned while its rows
  // were read: each in the camera's frame at the time of its middle row, third component 1. Nothing
  // where the lens has no ray.
  std::optional<RotatedMatch> Unroll(const Match& match) const;
  // R_a_b between these two frames.
  Eigen::Matrix3d BetweenMiddleRows() const;

 private:
  GyroRotation(const Calibration& calibration, RotationChain chain, double interval_s);

  Eigen::Matrix3d MiddleRow(double frame_time_s) const;  // R_ref_cam at its time

  Calibration calibration_;
  RotationChain chain_;  // seconds from frame a's stamp
  Eigen::Matrix3d R_gyro_cam_;
  double interval_s_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_GYRO_ROTATION_H_
