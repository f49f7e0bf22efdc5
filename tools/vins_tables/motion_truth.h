// Where the gyro frame really was: what the tables compare with.
#ifndef CAMGYRO_TOOLS_VINS_TABLES_MOTION_TRUTH_H_
#define CAMGYRO_TOOLS_VINS_TABLES_MOTION_TRUTH_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "estimator/vins/initialise.h"
#include "simulation/simulate.h"

namespace camgyro {

// The gyro frame's state at a time of the gyro clock [ns], in a world of the truth's own, and the
// gravity of that world [m/s^2].
struct MotionState {
  VinsState state;
  Eigen::Vector3d gravity_m_s2 = Eigen::Vector3d::Zero();
};

// All states of one window and what follows come from one call's world: ask for a stretch first.
class MotionTruth {
 public:
  virtual ~MotionTruth() = default;
  // Nothing if the truth does not reach over the stretch [gyro clock, ns].
  using Stretch = std::function<MotionState(int64_t time_ns)>;
  virtual std::optional<Stretch> Over(int64_t from_ns, int64_t to_ns) const = 0;
};

std::unique_ptr<MotionTruth> SimulatedTruth(const simulation::Simulated& simulated,
                                            const simulation::Scenario& scenario);

// For recordings whose calibration is known, but whose motion is not: our own visual-inertial fit
// with the true calibration over `span_s`, much longer than the windows compared with it, begun
// every `step_s`. Between its keyframes the state follows the inertial samples. `sigma_m_s`, if not
// null, becomes the median sigma of its velocities.
std::unique_ptr<MotionTruth> FittedTruth(const Recording& recording, const Calibration& truth,
                                         const VinsOptions& options, double span_s, double step_s,
                                         double* sigma_m_s);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_VINS_TABLES_MOTION_TRUTH_H_
