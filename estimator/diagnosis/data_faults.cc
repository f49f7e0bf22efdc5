#include "estimator/diagnosis/data_faults.h"

#include <algorithm>
#include <cmath>

#include "core/constant_axes.h"
#include "core/effects/catalogue.h"
#include "core/format.h"
#include "core/gyro_gap.h"
#include "core/robust_statistics.h"
#include "core/saturation.h"
#include "core/time.h"

namespace camgyro {
namespace {

// Gaps longer than 1.5 intervals that are not made up for by the items after them, which have only
// come late: how many, how many steps are missing, where the longest is.
struct Gaps {
  int count = 0, missing = 0;
  double longest_s = 0.0, longest_at_s = 0.0;
};

// known(i): the gap before item i is one of our making.
template <typename Stamped, typename Known>
Gaps FindGaps(const std::vector<Stamped>& items, int64_t origin_ns, const Known& known) {
  constexpr double kShort = 0.95;  // [intervals] between an item that was late and the next
  Gaps gaps;
  const double interval = MedianInterval(items);
  for (size_t i = 1; i < items.size(); ++i) {
    const double step = SecondsSince(items[i - 1].stamp_ns, items[i].stamp_ns);
    if (step < 1.5 * interval || known(i)) continue;
    double made_up = 0.0;
    for (size_t k = i + 1; k < items.size(); ++k) {
      const double next = SecondsSince(items[k - 1].stamp_ns, items[k].stamp_ns);
      if (next > kShort * interval) break;
      made_up += interval - next;
    }
    const auto missing = static_cast<int>(std::lround((step - made_up) / interval)) - 1;
    if (missing <= 0) continue;
    ++gaps.count;
    gaps.missing += missing;
    if (step > gaps.longest_s) {
      gaps.longest_s = step;
      gaps.longest_at_s = SecondsSince(origin_ns, items[i - 1].stamp_ns);
    }
  }
  return gaps;
}

double MotionOf(const std::vector<Match>& matches) {
  std::vector<double> motion;
  for (const Match& match : matches) motion.push_back((match.px_b - match.px_a).norm());
  return motion.empty() ? 0.0 : MedianInPlace(&motion);
}

// Motion of a repeated picture over that of the pictures around it: tracking noise and coding only.
constexpr double kRepeatedMotion = 0.02;
constexpr double kMovingPx = 1.0;      // between the pictures around
constexpr size_t kFewestRepeated = 8;  // matches that show it

// Frames that show the picture of the frame before, one or several in a row, while the camera moves
// before and after.
std::vector<int> RepeatedPictures(const Recording& recording) {
  struct Step {
    int frame_b = 0;
    size_t matches = 0;
    double motion_px = 0.0;
  };
  std::vector<Step> steps;  // of neighbours
  const auto add = [&](int frame_b, const std::vector<Match>& matches) {
    steps.push_back({frame_b, matches.size(), MotionOf(matches)});
  };
  if (recording.matches.empty()) {
    for (size_t b = 1; b < recording.tracks.size(); ++b) {
      add(static_cast<int>(b), MatchesBetween(recording.tracks[b - 1], recording.tracks[b]));
    }
  } else {
    for (const FramePair& pair : recording.matches) {
      if (pair.frame_b == pair.frame_a + 1) add(pair.frame_b, pair.matches);
    }
  }
  std::vector<int> repeated;
  for (size_t i = 1; i + 1 < steps.size(); ++i) {
    if (!(steps[i - 1].motion_px > kMovingPx)) continue;
    const double still_px = kRepeatedMotion * steps[i - 1].motion_px;
    size_t end = i;  // of the pairs that do not move
    while (end < steps.size() && steps[end].matches >= kFewestRepeated &&
           steps[end].motion_px < still_px) {
      ++end;
    }
    if (end == i || end == steps.size() || !(steps[end].motion_px > kMovingPx)) continue;
    for (; i < end; ++i) {
      if (steps[i].motion_px < kRepeatedMotion * steps[end].motion_px)
        repeated.push_back(steps[i].frame_b);
    }
  }
  return repeated;
}

}  // namespace

std::vector<DataFault> FindDataFaults(const Recording& recording) {
  std::vector<DataFault> faults;
  if (recording.gyro.size() < 10 || recording.frames.size() < 3) return faults;
  const int64_t origin_ns = recording.gyro.front().stamp_ns;

  const std::vector<bool> saturated = FindSaturated(recording.gyro);
  const auto count = std::count(saturated.begin(), saturated.end(), true);
  if (count > 0) {
    double rail = 0.0;
    for (size_t i = 0; i < saturated.size(); ++i) {
      if (saturated[i]) {
        rail = std::max(rail, recording.gyro[i].omega_gyro_rad_s.cwiseAbs().maxCoeff());
      }
    }
    faults.push_back({"gyro_saturation",
                      Format("%ld of %zu gyro samples stay at the rail of %.3f rad/s (%.0f deg/s)",
                             static_cast<long>(count), saturated.size(), rail, rail * 57.29578),
                      FindEffect("gyro_saturation")->advice, static_cast<int>(count)});
  }
  if (const std::string constant = ConstantAxes(recording.gyro); !constant.empty()) {
    faults.push_back(
        {"gyro_axis_constant",
         Format("all %zu rates about %s have the same value", recording.gyro.size(),
                constant.c_str()),
         "find out why that axis measures nothing; what depends on it is not determined",
         static_cast<int>(constant.size())});
  }
  const Gaps frames = FindGaps(recording.frames, origin_ns, [&](size_t i) {
    return recording.PictureOf(i) > recording.PictureOf(i - 1) + 1;  // left out
  });
  if (frames.count > 0) {
    faults.push_back(
        {"dropped_frames",
         Format("%d gaps in the frames' stamps (about %d frames missing), the longest "
                "of %.0f ms at %.2f s",
                frames.count, frames.missing, 1e3 * frames.longest_s, frames.longest_at_s),
         "harmless if the stamps are right: check for a delay_step at these times", frames.count});
  }
  const Gaps samples = FindGaps(recording.gyro, origin_ns, [](size_t) { return false; });
  if (samples.longest_s > LongestGyroStep(MedianInterval(recording.gyro))) {
    faults.push_back({"dropped_samples",
                      Format("%d gaps in the gyro's stamps, the longest of %.0f ms at %.2f s",
                             samples.count, 1e3 * samples.longest_s, samples.longest_at_s),
                      "pairs of frames in such gaps are left out; give the logger more time",
                      samples.count});
  }
  const int duplicates = static_cast<int>(RepeatedPictures(recording).size());
  if (duplicates > 0) {
    faults.push_back(
        {"duplicated_frames",
         Format("%d frames repeat the picture before them while the camera moves", duplicates),
         "drop them: their stamps belong to another picture", duplicates});
  }
  const double interval = MedianInterval(recording.gyro);
  if (recording.gyro_info.declared_rate_hz && interval > 0.0 &&
      std::abs(*recording.gyro_info.declared_rate_hz * interval - 1.0) > 0.03) {
    faults.push_back({"gyro_rate",
                      Format("the file declares %.6g Hz, the stamps show %.6g Hz",
                             *recording.gyro_info.declared_rate_hz, 1.0 / interval),
                      "trust the stamps, or find out which of the two is wrong"});
  }
  return faults;
}

int DropRepeatedPictures(Recording* recording) {
  const std::vector<int> repeated = RepeatedPictures(*recording);
  if (repeated.empty() || 2 * repeated.size() > recording->frames.size()) return 0;
  LeaveOutFrames(repeated, /*repeats=*/true, recording);
  const int count = static_cast<int>(repeated.size());
  const std::string finding =
      Format("%d frames repeat the picture before them while the camera moves; left out", count);
  recording->faults.push_back({"duplicated_frames", count, finding});
  recording->notes.push_back(finding);
  return count;
}

}  // namespace camgyro
