#include "core/lens_shift.h"

#include <algorithm>

#include "core/time.h"

namespace camgyro {

LensShift::LensShift(const std::vector<LensSample>& samples, int64_t origin_ns)
    : shift_px_(2, static_cast<Eigen::Index>(samples.size())) {
  times_s_.reserve(samples.size());
  for (const LensSample& sample : samples) {
    shift_px_.col(static_cast<Eigen::Index>(times_s_.size())) = sample.shift_px;
    times_s_.push_back(SecondsSince(origin_ns, sample.stamp_ns));
  }
}

Eigen::Vector2d LensShift::At(double time_s) const {
  const auto next = std::upper_bound(times_s_.begin(), times_s_.end(), time_s);
  if (next == times_s_.begin()) return shift_px_.leftCols<1>();
  if (next == times_s_.end()) return shift_px_.rightCols<1>();
  const Eigen::Index i = next - times_s_.begin();
  const double u = (time_s - *(next - 1)) / (*next - *(next - 1));
  return (1.0 - u) * shift_px_.col(i - 1) + u * shift_px_.col(i);
}

Eigen::Vector2d LensShift::RateAt(double time_s) const {
  constexpr double kStep_s = 0.004;  // of one sample of a lens, at 250 Hz
  return (At(time_s + kStep_s) - At(time_s - kStep_s)) / (2.0 * kStep_s);
}

}  // namespace camgyro
