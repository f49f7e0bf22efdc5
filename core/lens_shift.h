// Where a stabilised lens was, as the device logged it.
#ifndef CAMGYRO_CORE_LENS_SHIFT_H_
#define CAMGYRO_CORE_LENS_SHIFT_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace camgyro {

// By how much the lens shifts the picture, to the right and down: the principal point with it.
// Android's OisSample has the same signs; its pixels are the sensor's (docs/recording_format.md).
struct LensSample {
  int64_t stamp_ns = 0;  // camera clock
  Eigen::Vector2d shift_px =
      Eigen::Vector2d::Zero();  // as the device says, in pixels of the picture
};

// The same as a function of time.
class LensShift {
 public:
  // samples: at least one, stamps strictly increasing; times are seconds after `origin_ns`.
  LensShift(const std::vector<LensSample>& samples, int64_t origin_ns);

  // On a straight line between samples, as the nearest one before the first and after the last
  // [px].
  Eigen::Vector2d At(double time_s) const;
  // Its derivative over some ms around a time [px/s].
  Eigen::Vector2d RateAt(double time_s) const;

 private:
  std::vector<double> times_s_;
  Eigen::Matrix2Xd shift_px_;
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_LENS_SHIFT_H_
