#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/robust_statistics.h"
#include "core/time.h"
#include "estimator/start/slerp_delay_search.h"
#include "tools/vins_tables/vins_tables.h"

namespace camgyro {
namespace {

void AppendCurve(const std::string& name, const char* reference, double window_s,
                 const SlerpDelay& found, std::FILE* file) {
  for (const SlerpDelayPoint& point : found.curve) {
    std::fprintf(file, "%s,%s,%.3f,%.6f,%.6e\n", name.c_str(), reference, window_s, point.delay_s,
                 point.mean_square_rad2);
  }
}

}  // namespace

Status TabulateDelaySearch(const std::string& name, const Recording& recording,
                           const Calibration& calibrated, const std::string& curves_csv) {
  std::FILE* file = nullptr;
  if (!curves_csv.empty()) {
    file = std::fopen(curves_csv.c_str(), "a");
    if (file == nullptr) return BadInput(curves_csv + ": cannot be written");
    if (std::ftell(file) == 0) {
      std::fputs("#recording,reference,window [s],delay [s],mean square [rad^2]\n", file);
    }
  }
  const std::vector<CameraRotation> rotations = NeighbourRotations(recording, calibrated);
  for (const SlerpReference reference : {SlerpReference::kGyro, SlerpReference::kCamera}) {
    const char* const words = reference == SlerpReference::kGyro ? "gyro (paper)" : "camera";
    SlerpOptions options;
    options.reference = reference;
    std::vector<double> delays_ms, contrast;
    int windows = 0, refused = 0;
    for (int first = 0; first + options.window_pairs <= static_cast<int>(rotations.size());
         first += options.window_pairs) {
      ++windows;
      const Result<SlerpDelay> found = SlerpDelaySearch(
          recording, rotations, first, calibrated.q_gyro_cam, calibrated.bias_gyro_rad_s, options);
      if (!found) {
        ++refused;
        continue;
      }
      delays_ms.push_back(1e3 * found->delay_s);
      double least = 1e300;
      std::vector<double> residuals;
      for (const SlerpDelayPoint& point : found->curve) {
        least = std::min(least, point.mean_square_rad2);
        residuals.push_back(point.mean_square_rad2);
      }
      contrast.push_back(MedianInPlace(&residuals) / std::max(1e-18, least));
      if (file != nullptr) {
        const int frame = rotations[static_cast<size_t>(first)].frame_a;
        AppendCurve(name, words,
                    SecondsSince(recording.frames.front().stamp_ns,
                                 recording.frames[static_cast<size_t>(frame)].stamp_ns),
                    *found, file);
      }
    }
    if (delays_ms.empty()) {
      std::printf("| %s | %s | %d | %d | | | | | |\n", name.c_str(), words, windows, refused);
      continue;
    }
    const auto [low, high] = std::minmax_element(delays_ms.begin(), delays_ms.end());
    const double lowest = *low, highest = *high;
    const double middle = MedianInPlace(&delays_ms);
    std::vector<double> off;
    for (const double delay : delays_ms) off.push_back(std::abs(delay - middle));
    const double spread = kSigmaOfMedian * MedianInPlace(&off);
    const StateCovariance& C = calibrated.covariance;
    const double sigma_ms =
        1e3 * std::sqrt(C(kStateDelay, kStateDelay) + C(kStateDelay, kStateReadout) +
                        0.25 * C(kStateReadout, kStateReadout));
    std::printf("| %s | %s | %d | %d | %.2f | %.2f | %.1f .. %.1f | %.0f | %.2f ± %.2f |\n",
                name.c_str(), words, windows, refused, middle, spread, lowest, highest,
                MedianInPlace(&contrast), 1e3 * (calibrated.delay_s + 0.5 * calibrated.readout_s),
                sigma_ms);
  }
  std::fflush(stdout);
  if (file != nullptr && std::fclose(file) != 0)
    return BadInput(curves_csv + ": cannot be written");
  return {};
}

}  // namespace camgyro
