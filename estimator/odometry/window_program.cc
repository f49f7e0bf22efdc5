#include "estimator/odometry/window_program.h"

#include <ceres/loss_function.h>
#include <ceres/sphere_manifold.h>

#include "factors/drift_step.h"

namespace camgyro {
namespace {

constexpr double kCauchySigmas = 2.0;

ceres::Problem::Options OwnNothing() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  return options;
}

}  // namespace

OdometryWindow::Program::Program(OdometryWindow* window)
    : window_(window),
      point_manifold_(std::make_unique<ceres::SphereManifold<4>>()),
      loss_(std::make_unique<ceres::CauchyLoss>(kCauchySigmas)),
      problem_(OwnNothing()) {
  for (OdometryNode& k : window->keyframes_) {
    problem_.AddParameterBlock(k.q(), 4, &rotation_manifold_);
    for (double* block : {k.p(), k.v(), k.bias_gyro(), k.bias_accel()}) {
      problem_.AddParameterBlock(block, 3);
    }
  }
  problem_.AddParameterBlock(window->gravity_.data(), 3);
  problem_.SetParameterBlockConstant(window->gravity_.data());
  problem_.AddParameterBlock(window->arm_.data(), 3);
  problem_.AddParameterBlock(window->calibration_.data(), kStateSize);
  for (auto& [track_id, landmark] : window->landmarks_) {
    if (!landmark.used()) continue;
    problem_.AddParameterBlock(landmark.point.data(), 4, point_manifold_.get());
  }
  std::vector<double*> prior_blocks;
  for (const PriorBlock& block : window->prior_blocks_) prior_blocks.push_back(block.values);
  prior_ = problem_.AddResidualBlock(window->prior_.get(), nullptr, prior_blocks);
  links_.resize(window->keyframes_.size());
  for (size_t n = 1; n < window->keyframes_.size(); ++n) {
    OdometryNode &i = window->keyframes_[n - 1], &j = window->keyframes_[n];
    links_[n] = {
        problem_.AddResidualBlock(j.inertial.get(), nullptr, i.q(), i.p(), i.v(), j.q(), j.p(),
                                  j.v(), window->gravity_.data(), i.bias_gyro(), i.bias_accel()),
        problem_.AddResidualBlock(j.gyro_walk.get(), nullptr, i.bias_gyro(), j.bias_gyro()),
        problem_.AddResidualBlock(j.accel_walk.get(), nullptr, i.bias_accel(), j.bias_accel())};
  }
  for (auto& [track_id, landmark] : window->landmarks_) {
    if (!landmark.used()) continue;
    std::vector<ceres::ResidualBlockId>& ids = sightings_[track_id];
    const std::vector<OdometrySighting>& all = landmark.sightings;
    for (size_t i = 0; i < all.size(); ++i) {
      ids.push_back(window->options_.tracks_drift && i > 0
                        ? AddDriftStep(all[i - 1], all[i], &landmark)
                        : AddSighting(all[i], &landmark));
    }
  }
}

ceres::ResidualBlockId OdometryWindow::Program::AddSighting(const OdometrySighting& sighting,
                                                            OdometryLandmark* landmark) {
  OdometryNode* k = sighting.keyframe;
  return problem_.AddResidualBlock(sighting.factor.get(), loss_.get(), k->q(), k->p(), k->v(),
                                   window_->gravity_.data(), window_->arm_.data(),
                                   window_->calibration_.data(), landmark->point.data());
}

ceres::ResidualBlockId OdometryWindow::Program::AddDriftStep(const OdometrySighting& from,
                                                             const OdometrySighting& to,
                                                             OdometryLandmark* landmark) {
  OdometryNode *a = from.keyframe, *b = to.keyframe;
  drift_steps_.push_back(MakeDriftStep(
      {from.factor.get(), from.measurement.sigma_px}, {to.factor.get(), to.measurement.sigma_px},
      to.measurement.sigma_px, static_cast<double>(b->frame_number - a->frame_number)));
  return problem_.AddResidualBlock(drift_steps_.back().get(), loss_.get(), a->q(), a->p(), a->v(),
                                   b->q(), b->p(), b->v(), window_->gravity_.data(),
                                   window_->arm_.data(), window_->calibration_.data(),
                                   landmark->point.data());
}

void OdometryWindow::Program::AddKeyframe(OdometryNode* k, ReducedInformation* information) {
  for (double* block : {k->q(), k->p(), k->v(), k->bias_gyro(), k->bias_accel()}) {
    information->AddBlock(block, 3);
  }
}

void OdometryWindow::Program::AddShared(ReducedInformation* information) {
  information->AddBlock(window_->calibration_.data(), kStateSize);
  information->AddBlock(window_->arm_.data(), 3);
}

}  // namespace camgyro
