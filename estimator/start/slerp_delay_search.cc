#include "estimator/start/slerp_delay_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/rotation_chain.h"
#include "core/so3.h"
#include "core/time.h"
#include "estimator/start/rate_alignment.h"

namespace camgyro {
namespace {

// Attitude of a camera, q_first_t, between the attitudes at frames.
Eigen::Quaterniond Slerp(const std::vector<double>& times_s,
                         const std::vector<Eigen::Quaterniond>& q_first_frame, double time_s) {
  const auto upper = std::upper_bound(times_s.begin() + 1, times_s.end() - 1, time_s);
  const auto k = static_cast<size_t>(upper - times_s.begin());
  const double fraction = (time_s - times_s[k - 1]) / (times_s[k] - times_s[k - 1]);
  return q_first_frame[k - 1].slerp(fraction, q_first_frame[k]);
}

double SquaredAngle(const Eigen::Quaterniond& q_gyro_a_b, const Eigen::Quaterniond& q_cam_a_b,
                    const Eigen::Quaterniond& q_gyro_cam) {
  // Eq. (2): gamma_b * (q_c gamma_c q_c^-1)^-1, the identity without error.
  return Log(q_gyro_a_b * (q_gyro_cam * q_cam_a_b * q_gyro_cam.conjugate()).conjugate())
      .squaredNorm();
}

// The camera's intervals that stay inside for every delay of the range: a constant number of terms.
std::vector<size_t> IntervalsInside(const std::vector<double>& times_s,
                                    const std::vector<double>& gyro_times_s,
                                    const SlerpOptions& options) {
  const bool move_camera = options.reference == SlerpReference::kGyro;
  const double begin_s = move_camera ? times_s.front() : gyro_times_s.front();
  const double end_s = move_camera ? times_s.back() : gyro_times_s.back();
  std::vector<size_t> inside;
  for (size_t k = 0; k + 1 < times_s.size(); ++k) {
    const bool gyro_covers =
        times_s[k] >= gyro_times_s.front() && times_s[k + 1] <= gyro_times_s.back();
    if (times_s[k] - options.range_s >= begin_s && times_s[k + 1] + options.range_s <= end_s &&
        (gyro_covers || !move_camera)) {
      inside.push_back(k);
    }
  }
  return inside;
}

// Where the parabola through the least point of a curve and its neighbours is least; nothing where
// that point is at the edge.
std::optional<double> MinimumOf(const std::vector<SlerpDelayPoint>& curve, double step_s) {
  const auto best = std::min_element(curve.begin(), curve.end(),
                                     [](const SlerpDelayPoint& x, const SlerpDelayPoint& y) {
                                       return x.mean_square_rad2 < y.mean_square_rad2;
                                     });
  if (best == curve.begin() || best + 1 == curve.end()) return std::nullopt;
  const double before = (best - 1)->mean_square_rad2, after = (best + 1)->mean_square_rad2;
  const double bend = before - 2.0 * best->mean_square_rad2 + after;
  return best->delay_s + (bend > 0.0 ? 0.5 * (before - after) / bend : 0.0) * step_s;
}

// The gyro's rotations from one time to another, and a sample on either side.
RotationChain ChainOver(const GyroRates& gyro, double begin_s, double end_s,
                        const Eigen::Vector3d& bias_gyro_rad_s) {
  const std::vector<double>& times_s = gyro.times_s;
  const auto begin = std::lower_bound(times_s.begin(), times_s.end(), begin_s);
  const auto end = std::upper_bound(begin, times_s.end(), end_s);
  const auto size = static_cast<ptrdiff_t>(times_s.size());
  const ptrdiff_t first = std::clamp<ptrdiff_t>(begin - times_s.begin() - 1, 0, size - 2);
  const ptrdiff_t last = std::clamp<ptrdiff_t>(end - times_s.begin(), first + 1, size - 1);
  return {std::vector<double>(times_s.begin() + first, times_s.begin() + last + 1),
          gyro.omega_gyro_rad_s.middleCols(first, last - first + 1).colwise() - bias_gyro_rad_s};
}

}  // namespace

Result<SlerpDelay> SlerpDelaySearch(const Recording& recording,
                                    const std::vector<CameraRotation>& rotations, int first,
                                    const Eigen::Quaterniond& q_gyro_cam,
                                    const Eigen::Vector3d& bias_gyro_rad_s,
                                    const SlerpOptions& options) {
  const int n = options.window_pairs;
  if (n < 2 || !(options.range_s > 0.0) || !(options.step_s > 0.0)) {
    return BadUsage("delay search: expected a window of 2 pairs or more, range and step above 0");
  }
  if (first < 0 || first + n > static_cast<int>(rotations.size()) || recording.gyro.size() < 2) {
    return CannotEstimate("delay search: the recording has less than " + std::to_string(n) +
                          " camera rotations from number " + std::to_string(first));
  }
  // Seconds from the first gyro stamp, camera times shifted by the centre: what is searched is the
  // rest, within +- range.
  std::vector<double> times_s;
  std::vector<Eigen::Quaterniond> q_first_frame = {Eigen::Quaterniond::Identity()};
  const auto frame_time_s = [&](int frame) {
    return SecondsSince(recording.gyro.front().stamp_ns, recording.frames[frame].stamp_ns) +
           options.centre_s;
  };
  for (int i = first; i < first + n; ++i) {
    const CameraRotation& rotation = rotations[i];
    if (i > first && rotation.frame_a != rotations[i - 1].frame_b) {
      return BadInput("delay search: camera rotations " + std::to_string(i - 1) + " and " +
                      std::to_string(i) + " are not consecutive");
    }
    if (times_s.empty()) times_s.push_back(frame_time_s(rotation.frame_a));
    times_s.push_back(frame_time_s(rotation.frame_b));
    q_first_frame.push_back((q_first_frame.back() * rotation.q_a_b).normalized());
  }
  const GyroRates gyro(recording.gyro);
  // What the search may look at.
  const double reach_s = options.range_s + options.step_s;
  const RotationChain chain =
      ChainOver(gyro, times_s.front() - reach_s, times_s.back() + reach_s, bias_gyro_rad_s);
  const auto gyro_at = [&](double time_s) {
    return Eigen::Quaterniond(chain.At(time_s).R_ref_gyro);
  };

  const bool move_camera = options.reference == SlerpReference::kGyro;
  const std::vector<size_t> terms = IntervalsInside(times_s, gyro.times_s, options);
  std::vector<Eigen::Quaterniond> q_gyro_fixed;  // at the stamps themselves
  if (terms.size() < 2) {
    return CannotEstimate("delay search: window or gyro too short for +-" +
                          std::to_string(options.range_s) + " s: no interval stays inside");
  }
  if (move_camera) {
    for (const double t : times_s) q_gyro_fixed.push_back(gyro_at(t));
  }

  SlerpDelay result;
  result.terms = static_cast<int>(terms.size());
  const int half = static_cast<int>(std::floor(options.range_s / options.step_s + 1e-9));
  std::vector<Eigen::Quaterniond> moved(times_s.size());
  for (int step = -half; step <= half; ++step) {
    const double delay_s = step * options.step_s;
    // The one conversion of sign: a frame stamped t' was taken at t' - t_d(paper) = t' + delay.
    const double paper_td_s = -delay_s;
    for (size_t k = terms.front(); k <= terms.back() + 1; ++k) {
      moved[k] = move_camera ? Slerp(times_s, q_first_frame, times_s[k] + paper_td_s)
                             : gyro_at(times_s[k] + delay_s);
    }
    double sum = 0.0;
    for (const size_t k : terms) {
      const std::vector<Eigen::Quaterniond>& q_gyro = move_camera ? q_gyro_fixed : moved;
      const std::vector<Eigen::Quaterniond>& q_cam = move_camera ? moved : q_first_frame;
      sum += SquaredAngle(q_gyro[k].conjugate() * q_gyro[k + 1],
                          q_cam[k].conjugate() * q_cam[k + 1], q_gyro_cam);
    }
    result.curve.push_back({options.centre_s + delay_s, sum / static_cast<double>(terms.size())});
  }

  const std::optional<double> delay_s = MinimumOf(result.curve, options.step_s);
  if (!delay_s) {
    return CannotEstimate("delay search: no minimum inside +-" + std::to_string(options.range_s) +
                          " s, the residual is least at the edge");
  }
  result.delay_s = *delay_s;
  return result;
}

}  // namespace camgyro
