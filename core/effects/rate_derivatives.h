// Time derivatives of the gyro's readings, for effects that depend on them.
#ifndef CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_
#define CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_

#include <Eigen/Core>
#include <memory>

#include "core/effects/effect.h"

namespace camgyro {

// The first or the second, of least-squares polynomials of fourth degree over 40 ms (at least 3
// samples) to both sides of each sample; zero at the ends. They see 0.2 % too little of a rotation
// of 4 Hz; parabolas over 25 ms, which let a fifth less noise through, see 5 and 3 % too little,
// more than three sigmas of what 40 s of running tell. Made where they are asked for: hours have
// millions of samples, of which a fit uses few.
class RateDerivatives {
 public:
  enum Order { kFirst = 1, kSecond = 2 };
  RateDerivatives(const EffectSetup& setup, Order order);
  // The sample at a time, or the first after it; -1 past the end.
  Eigen::Index IndexAt(double time_gyro_s) const;
  // At a sample [rad/s^2] or [rad/s^3].
  Eigen::Vector3d At(Eigen::Index sample) const;
  const SensorSamples& gyro() const { return *gyro_; }
  // Samples come every 25 ms or faster, and there are enough of them.
  static bool Possible(const EffectSetup& setup);

 private:
  const std::shared_ptr<const SensorSamples> gyro_;
  const Order order_;
  const Eigen::Index half_;  // samples to either side
  const double unit_s_;      // of time, in the parabola
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_
