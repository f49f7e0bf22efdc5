// A slow function of time for effects that wander: a uniform cubic B-spline.
#ifndef CAMGYRO_CORE_EFFECTS_TIME_CURVE_H_
#define CAMGYRO_CORE_EFFECTS_TIME_CURVE_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace camgyro {

// Spans from_s to to_s with intervals of at least `min_interval_s`, at most `max_intervals` of
// them. The first coefficient is held at zero, so that the curve leaves a constant to others.
class TimeCurve {
 public:
  TimeCurve(double from_s, double to_s, double min_interval_s, int max_intervals)
      : from_s_(from_s),
        intervals_(
            std::clamp(static_cast<int>((to_s - from_s) / min_interval_s), 1, max_intervals)),
        interval_s_(std::max(1e-9, to_s - from_s) / intervals_) {}

  int size() const { return intervals_ + 2; }
  double interval_s() const { return interval_s_; }

  // Calls add(coefficient, weight) for the coefficients that a time depends on; the curve is held
  // outside of its span.
  template <typename Add>
  void At(double time_s, const Add& add) const {
    const double x = std::clamp((time_s - from_s_) / interval_s_, 0.0, intervals_ - 1e-9);
    const int first = static_cast<int>(x);
    const double u = x - first, v = 1.0 - u;
    const double weights[4] = {v * v * v / 6.0, (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0,
                               (4.0 - 6.0 * v * v + 3.0 * v * v * v) / 6.0, u * u * u / 6.0};
    for (int i = 0; i < 4; ++i) {
      if (first + i > 0) add(first + i - 1, weights[i]);
    }
  }

 private:
  double from_s_;
  int intervals_;
  double interval_s_;
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_TIME_CURVE_H_
