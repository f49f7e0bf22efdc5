// The window's factors as a problem of Ceres.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_WINDOW_PROGRAM_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_WINDOW_PROGRAM_H_

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <map>
#include <memory>
#include <vector>

#include "estimator/odometry/odometry_window.h"
#include "estimator/odometry/reduced_information.h"
#include "factors/rotation_manifold.h"

namespace camgyro {

// All factors of a window as a Ceres problem, which owns none of them.
class OdometryWindow::Program {
 public:
  explicit Program(OdometryWindow* window);

  ceres::Problem& problem() { return problem_; }
  const ceres::Problem& problem() const { return problem_; }

  // Residual blocks: the prior; of each keyframe those of its link; of each sighting.
  ceres::ResidualBlockId prior() const { return prior_; }
  const std::vector<ceres::ResidualBlockId>& LinksOf(size_t keyframe) const {
    return links_[keyframe];
  }
  const std::vector<ceres::ResidualBlockId>& SightingsOf(int64_t track_id) const {
    return sightings_.at(track_id);
  }

  // Where a keyframe's blocks stand in an information matrix: q, p, v, b_g, b_a.
  static void AddKeyframe(OdometryNode* keyframe, ReducedInformation* information);
  void AddShared(ReducedInformation* information);  // calibration, p_gyro_cam

 private:
  ceres::ResidualBlockId AddSighting(const OdometrySighting& sighting, OdometryLandmark* landmark);
  ceres::ResidualBlockId AddDriftStep(const OdometrySighting& from, const OdometrySighting& to,
                                      OdometryLandmark* landmark);

  OdometryWindow* window_;
  RotationManifold rotation_manifold_;
  std::unique_ptr<ceres::Manifold> point_manifold_;
  std::unique_ptr<ceres::LossFunction> loss_;
  std::vector<std::unique_ptr<ceres::CostFunction>> drift_steps_;
  ceres::Problem problem_;
  ceres::ResidualBlockId prior_ = nullptr;
  std::vector<std::vector<ceres::ResidualBlockId>> links_;
  std::map<int64_t, std::vector<ceres::ResidualBlockId>> sightings_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_WINDOW_PROGRAM_H_
