// The state of eq. (7): one table for the order, the names and the units of its parameters, for
// what is believed of them before, and for what makes an estimate useful. A parameter's number is
// its row.
#ifndef CAMGYRO_CORE_STATE_H_
#define CAMGYRO_CORE_STATE_H_

#include <Eigen/Core>
#include <array>
#include <string>

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

using StateVector = Eigen::Matrix<double, kStateSize, 1>;
using StateCovariance = Eigen::Matrix<double, kStateSize, kStateSize>;

// What a width is counted in. The lengths in StateScales are in the state's units.
enum class StateUnit { kOne, kFocal, kPictureWidth, kPictureDiagonal, kFrameInterval };
struct StateScales {
  double focal_px = 0.0, width_px = 0.0, diagonal_px = 0.0, frame_interval_s = 0.0;
};
struct StateWidth {
  double value = 0.0;
  StateUnit of = StateUnit::kOne;
  double In(const StateScales& scales) const;  // [px, s, rad/s, rad]
};

struct StateParameter {
  const char* name;       // in files, such as calibration.yaml's `covariance: order`
  const char* long_name;  // with its unit: of the library's interface
  // Its value as people see it: shown = unit_scale * value.
  const char* label;
  const char* unit;
  double unit_scale;
  // Its errors, which are small, in tables and plots.
  const char* symbol;
  const char* error_unit;
  double error_scale;
  // Nothing that a recording of attitudes holds depends on it.
  bool needs_pixels;
  // Unknown while the fit of the pictures has not settled; the others follow from the rates.
  bool needs_fit;
  // Standard deviation of the prior: where the recording declares a value, and where it does not.
  StateWidth declared_sigma, usual_sigma;
  // A standard deviation above this one tells a user too little to call the parameter determined.
  StateWidth useful_sigma;
};

// In the order of StateIndex.
const std::array<StateParameter, kStateSize>& StateTable();

// The column `name` of the table.
const std::array<std::string, kStateSize>& StateNames();

}  // namespace camgyro

#endif  // CAMGYRO_CORE_STATE_H_
