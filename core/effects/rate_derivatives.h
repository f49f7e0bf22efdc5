// Time derivatives of the gyro's readings, for effects that depend on them.
#ifndef CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_
#define CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_

#include <Eigen/Core>
#include <vector>

#include "core/effects/effect.h"

namespace camgyro {

// The first or the second, of least-squares parabolas over 25 ms (at least 2 samples) to both sides
// of each sample; zero at the ends. One of them only: hours have millions of samples.
struct RateDerivatives {
  enum Order { kFirst = 1, kSecond = 2 };
  RateDerivatives(const EffectSetup& setup, Order order);
  // The sample at a time, or the first after it; -1 past the end.
  Eigen::Index At(double time_gyro_s) const;
  // Samples come every 25 ms or faster, and there are enough of them.
  static bool Possible(const EffectSetup& setup);

  std::vector<double> times_s;
  Eigen::Matrix3Xd values;  // columns: samples [rad/s^2] or [rad/s^3]
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_RATE_DERIVATIVES_H_
