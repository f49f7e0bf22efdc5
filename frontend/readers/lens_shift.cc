#include "frontend/readers/lens_shift.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/format.h"
#include "core/time.h"
#include "frontend/readers/csv_reader.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

// A lens is sampled some 250 times a second. Beyond this, nobody knows where it is: it is a tenth
// of a period of 5 Hz, at which hands tremble.
constexpr double kNear_s = 0.02;
constexpr double kMoves_px = 0.01;  // less is rounding of a lens that is held

size_t FramesWithout(const std::vector<LensSample>& samples, const std::vector<Frame>& frames) {
  size_t without = 0;
  for (const Frame& frame : frames) {
    const auto next = std::lower_bound(
        samples.begin(), samples.end(), frame.stamp_ns,
        [](const LensSample& sample, int64_t stamp) { return sample.stamp_ns < stamp; });
    const auto is_near = [&](const LensSample& sample) {
      return std::abs(SecondsSince(frame.stamp_ns, sample.stamp_ns)) < kNear_s;
    };
    const bool known = (next != samples.end() && is_near(*next)) ||
                       (next != samples.begin() && is_near(*(next - 1)));
    if (!known) ++without;
  }
  return without;
}

}  // namespace

Status SetLensShift(const std::string& file, std::vector<LensSample> samples,
                    Recording* recording) {
  std::stable_sort(samples.begin(), samples.end(), [](const LensSample& a, const LensSample& b) {
    return a.stamp_ns < b.stamp_ns;
  });
  const auto is_same = [](const LensSample& a, const LensSample& b) {
    return a.stamp_ns == b.stamp_ns;
  };
  samples.erase(std::unique(samples.begin(), samples.end(), is_same), samples.end());
  if (samples.size() < 2) {
    return BadInput(Concat(file, ": has ", samples.size(), " positions of the lens, expected two"));
  }
  const CameraGuess& camera = recording->camera;
  double farthest_px = 0.0;
  for (const LensSample& sample : samples) {
    const double shift_px = sample.shift_px.norm();
    farthest_px = std::max(farthest_px, shift_px);
    if (std::isfinite(shift_px) && shift_px < std::max(camera.width_px, camera.height_px)) continue;
    return BadInput(Concat(file, ": stamp ", sample.stamp_ns, ": a shift of ", shift_px,
                           " px was found, expected less than a picture"));
  }
  if (const size_t without = FramesWithout(samples, recording->frames);
      TooManyLost(without, recording->frames.size())) {
    recording->notes.push_back(Concat(file, ": says where the lens was for ",
                                      recording->frames.size() - without, " of ",
                                      recording->frames.size(), " pictures only; it is not used"));
    return {};
  }
  const auto moved = [&](const LensSample& sample) {
    return (sample.shift_px - samples.front().shift_px).norm() > kMoves_px;
  };
  if (std::none_of(samples.begin(), samples.end(), moved)) {
    recording->notes.push_back(file + ": the lens does not move");
    return {};
  }
  recording->notes.push_back(file + Format(": the lens shifts the picture by up to %.1f px, which "
                                           "is part of the model (optical_stabilisation:logged)",
                                           farthest_px));
  recording->lens_shift = std::move(samples);
  return {};
}

Status ReadLensShift(const std::string& file, Recording* recording) {
  CsvReader csv(file, {"timestamp [ns]", "shift_x [px]", "shift_y [px]"}, {3});
  std::vector<LensSample> samples;
  while (csv.NextRow()) {
    samples.push_back({csv.Stamp(0), Eigen::Vector2d(csv.Number(1), csv.Number(2))});
  }
  return csv.status() ? SetLensShift(file, std::move(samples), recording) : csv.status();
}

}  // namespace camgyro
