// The course of the gyro's readings in time, for effects that depend on it.
#ifndef CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_
#define CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_

#include <Eigen/Core>
#include <memory>

#include "core/effects/effect.h"

namespace camgyro {

// Least-squares polynomials of fourth degree over 40 ms (at least 3 samples) to both sides of each
// sample; zero at the ends. They see 0.2 % too little of a rotation of 4 Hz; parabolas over 25 ms,
// which let a fifth less noise through, see 5 and 3 % too little, more than three sigmas of what 40
// s of running tell. Made where they are asked for: hours have millions of samples, of which a fit
// uses few.
class RateDerivatives {
 public:
  static constexpr double kReach_s = 0.04;
  // Row k: the k-th derivative by time over k! [rad/s^(k+1)]. Columns: the gyro's axes.
  using Coefficients = Eigen::Matrix<double, 5, 3>;
  explicit RateDerivatives(const EffectSetup& setup);
  // The sample at a time, or the first after it; -1 past the end.
  Eigen::Index IndexAt(double time_gyro_s) const;
  Coefficients At(Eigen::Index sample) const;
  const SensorSamples& gyro() const { return *gyro_; }
  // Samples come every 25 ms or faster, and there are enough of them.
  static bool Possible(const EffectSetup& setup);

 private:
  std::shared_ptr<const SensorSamples> gyro_;
  Eigen::Index half_;  // samples to either side
  double unit_s_;      // of time, in the least squares
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_
