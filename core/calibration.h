// The result: Jia & Evans' parameters with their covariance, and what the motion determined.
#ifndef CAMGYRO_CORE_CALIBRATION_H_
#define CAMGYRO_CORE_CALIBRATION_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <string>

#include "core/effects/catalogue.h"
#include "core/lens.h"

namespace camgyro {

// Order of the state in covariances, as in eq. (7): f, c, t_r, t_d, b_g, q_c. The rotation is its
// tangent: right perturbation of q_gyro_cam, about the camera's axes [rad].
enum StateIndex : int {
  kStateFocal,
  kStateCx,
  kStateCy,
  kStateReadout,
  kStateDelay,
  kStateBias,          // 3
  kStateRotation = 8,  // 3
  kStateSize = 11
};
// Names in that order, as in calibration.yaml's `covariance: order`.
const std::array<std::string, kStateSize>& StateNames();

using StateVector = Eigen::Matrix<double, kStateSize, 1>;
using StateCovariance = Eigen::Matrix<double, kStateSize, kStateSize>;

struct Calibration {
  int width_px = 0, height_px = 0;
  DistortionModel distortion_model = DistortionModel::kNone;
  LensParameters lens = LensParameters::Zero();
  double readout_s = 0.0;
  double delay_s = 0.0;  // t_gyro = t_camera + delay
  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();

  StateCovariance covariance = StateCovariance::Zero();
  // Standard deviations that the start gave: the uncertainty without this recording's frames.
  StateVector prior_sigma = StateVector::Zero();
  // Parameters that the data informed: sigma well below the prior's.
  std::array<bool, kStateSize> determined{};

  // Effects of the catalogue in the model, beside the parameters above; null: none.
  std::shared_ptr<const EffectSet> effects;
  Eigen::VectorXd effect_values;      // effects->size()
  Eigen::MatrixXd effect_covariance;  // of effect_values

  // The lens with the effects that are a constant part of it (distortion, aspect ratio).
  LensParameters FullLens() const {
    return effects ? effects->ConstantLens(lens, effect_values) : lens;
  }
  PairEffects pair_effects() const {
    return effects && effects->size() > 0 ? PairEffects{effects.get(), effect_values.data()}
                                          : PairEffects();
  }
  StateVector sigma() const { return covariance.diagonal().cwiseSqrt(); }
};

// a [-] b: difference of two calibrations in the tangent, in the order of StateIndex.
StateVector Difference(const Calibration& a, const Calibration& b);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_CALIBRATION_H_
