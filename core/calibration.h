// The result: Jia & Evans' parameters with their covariance, and what the motion determined.
#ifndef CAMGYRO_CORE_CALIBRATION_H_
#define CAMGYRO_CORE_CALIBRATION_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <optional>

#include "core/effects/catalogue.h"
#include "core/lens.h"
#include "core/state.h"

namespace camgyro {

struct Calibration {
  int width_px = 0, height_px = 0;
  DistortionModel distortion_model = DistortionModel::kNone;
  LensParameters lens = LensParameters::Zero();
  double readout_s = 0.0;
  double delay_s = 0.0;  // t_gyro = t_camera + delay
  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();

  StateCovariance covariance = StateCovariance::Zero();  // of noise
  // Mean squared error of the values with what effects that nobody has declared may add
  // (estimator/diagnosis/model_check.h); absent: not known.
  std::optional<StateCovariance> total_covariance;
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
  std::optional<StateVector> sigma_total() const {
    if (!total_covariance) return std::nullopt;
    return StateVector(total_covariance->diagonal().cwiseSqrt());
  }
};

// What is believed of a calibration before a recording's frames: a Gaussian around the values of
// `mean`, whose parameters are independent. The covariance in `mean` is not used.
struct Prior {
  Calibration mean;
  StateVector sigma = StateVector::Zero();  // [px, s, rad/s, rad]
  // Of the mean's effects, in their units. Empty: each has the prior of its own, around zero.
  Eigen::VectorXd effect_sigma = {};
};

// a [-] b: difference of two calibrations in the tangent, in the order of StateIndex.
StateVector Difference(const Calibration& a, const Calibration& b);

// c [+] d: the calibration that differs from c by d.
Calibration Moved(Calibration c, const StateVector& d);

// The parameters as numbers; the mounting as a rotation vector about the camera's axes, counted
// from `q_reference` (camera -> gyro) [px, s, rad/s, rad].
StateVector ValuesOf(const Calibration& c, const Eigen::Quaterniond& q_reference);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_CALIBRATION_H_
