#include "estimator/start/find_start.h"

#include <algorithm>
#include <cmath>

#include "core/format.h"
#include "core/time.h"
#include "estimator/start/axis_permutation.h"
#include "estimator/start/clock_rate.h"
#include "estimator/start/lag_search.h"
#include "estimator/start/orientation.h"

namespace camgyro {
namespace {

constexpr int kMaxTemplatePairs = 900;  // of the search over all alignments: bounds its time
// Below, even a fit without any noise would be of no use: 1 px per frame at 30 Hz and 600 px is
// 0.05 rad/s. (Real micro-motion of 0.007 rad/s of a drone at rest is found, to 0.4 ms.)
constexpr double kNoRotationRadS = 0.01;
constexpr double kDegreesPerRadian = 57.29577951308232;
constexpr double kUnitTolerance = 1.2;

std::string Seconds(double value) { return Format("%.3f s", value); }
std::string Percent(double fraction) { return Format("%.0f %%", 100.0 * fraction); }
std::string Rate(double value) { return Format("%.3g rad/s", value); }

enum class Outcome { kTrusted, kNotFound, kDoesNotFollow, kRefused };

struct Verdict {
  Outcome outcome = Outcome::kTrusted;
  std::string reason;
};

bool IsFactor(double ratio, double factor) {
  return ratio > factor / kUnitTolerance && ratio < factor * kUnitTolerance;
}

// Is this search result a start to build on? `delay_offset_s` turns lags into delays.
Verdict Judge(const LagSearch& search, double gyro_noise_rad_s, double delay_offset_s,
              const StartOptions& options) {
  if (!search.found) {
    return {Outcome::kNotFound, "no overlap in time between camera and gyro"};
  }
  const RateAlignment::Fit& fit = search.best;
  if (search.gyro_rms_rad_s < kNoRotationRadS) {
    return {Outcome::kRefused, "no rotation in the recording: the gyro's rate varies by " +
                                   Rate(search.gyro_rms_rad_s) + " rms only"};
  }
  const double explained = fit.explained, mirrored = search.mirrored.explained_mirrored;
  if (mirrored >= options.min_explained &&
      1.0 - mirrored + 0.02 < options.max_runner_up * (1.0 - explained + 0.02)) {
    return {Outcome::kRefused,
            "a gyro axis has the wrong sign, or two are swapped: a mirrored orientation explains " +
                Percent(mirrored) + " of the gyro's motion, a rotation only " + Percent(explained) +
                " (nearest: " +
                DescribePermutation(FindNearestPermutation(search.mirrored.mirrored).P_gyro_cam) +
                ", which is left-handed)"};
  }
  if (explained >= options.min_explained && IsFactor(fit.rate_ratio, kDegreesPerRadian)) {
    return {Outcome::kRefused, "gyro in deg/s? Its rates are " + Format("%.1f", fit.rate_ratio) +
                                   " times the camera's; rad/s are expected"};
  }
  if (explained < options.min_explained || search.on_edge) {
    std::string reason;
    if (search.gyro_rms_rad_s < 3.0 * gyro_noise_rad_s) {
      reason = "no rotation in the recording that stands out: the gyro's rate varies by " +
               Rate(search.gyro_rms_rad_s) + " rms, of which noise " + Rate(gyro_noise_rad_s) +
               "; the camera's by " + Rate(fit.cam_rms_rad_s);
    } else {
      reason = "the picture does not follow the gyro (at the best delay the camera explains " +
               Percent(explained) + " of the gyro's motion" +
               (search.on_edge ? ", at the edge of the search" : "") + "; gyro rms " +
               Rate(fit.gyro_rms_rad_s) + ", camera rms " + Rate(fit.cam_rms_rad_s) +
               "): electronically stabilised, stamps of a slow motion, other columns than the "
               "gyro's, clocks that do not belong together, or camera rotations that are mostly "
               "wrong (camgyro diagnose asks which)";
    }
    return {Outcome::kDoesNotFollow, reason};
  }
  if (fit.rate_ratio > options.max_rate_ratio || fit.rate_ratio < 1.0 / options.max_rate_ratio) {
    return {Outcome::kRefused,
            "the camera turns " + Format("%.2f", 1.0 / fit.rate_ratio) +
                " times as fast as the gyro: wrong focal length, or electronically stabilised"};
  }
  if (search.runner_up_ratio > options.max_runner_up) {
    return {Outcome::kRefused,
            "ambiguous delay: " + Seconds(search.fit.lag_s + delay_offset_s) + " and " +
                Seconds(search.runner_up_lag_s + delay_offset_s) +
                " fit equally (periodic or too slow motion, unexplained fractions differ by a "
                "factor of " +
                Format("%.2f", search.runner_up_ratio) + " only)"};
  }
  if (!search.fit.converged) {
    return {Outcome::kRefused,
            "the delay has no distinct minimum near " + Seconds(search.fit.lag_s + delay_offset_s)};
  }
  return {};
}

StartResult MakeResult(const LagSearch& search, double delay_offset_s,
                       const std::optional<Eigen::Quaterniond>& guess) {
  StartResult result;
  const StartFit& fit = search.fit;
  result.delay_middle_row_s = fit.lag_s + delay_offset_s;
  result.delay_sigma_s = std::sqrt(fit.covariance(0, 0));
  for (const LagPoint& point : search.curve) {
    result.curve.push_back({point.lag_s + delay_offset_s, 1.0 - point.explained});
  }
  result.runner_up_ratio = search.runner_up_ratio;
  result.runner_up_delay_s = search.runner_up_lag_s + delay_offset_s;

  const Orientation orientation =
      CompleteOrientation(fit.q_gyro_cam, fit.covariance.block<3, 3>(1, 1), guess);
  result.q_gyro_cam = orientation.q_gyro_cam;
  result.rotation_sigma_rad = orientation.sigma_rad;
  result.rotation_axes_determined = orientation.axes_determined;
  result.notes = orientation.notes;
  const NearestPermutation nearest = FindNearestPermutation(result.q_gyro_cam.toRotationMatrix());
  result.nearest_permutation = nearest.P_gyro_cam;
  result.permutation_angle_rad = nearest.angle_rad;

  result.bias_gyro_rad_s = fit.bias_gyro_rad_s;
  result.bias_sigma_rad_s = fit.covariance.diagonal().segment<3>(4).cwiseSqrt();
  result.explained = search.best.explained;
  result.rate_ratio = fit.rate_ratio;
  result.rate_ratio_sigma = std::sqrt(fit.covariance(7, 7));
  result.inliers = fit.inliers;
  result.noise_rad_s = fit.noise_rad_s;
  result.gyro_rms_rad_s = search.gyro_rms_rad_s;
  result.pairs = search.best.pairs;
  if (result.explained < kWellExplained) {
    result.notes.push_back(
        "the camera explains " + Percent(result.explained) +
        " of the gyro's motion: noisy camera rotations, or a wrong lens or focal "
        "length");
  }
  return result;
}

// The delay at the first gyro stamp, which is where the effect clock_skew has it, and a note.
void SetClockRate(const ClockRate& rate, double lag_s, double offset_s, StartResult* result) {
  result->clock_skew = rate.skew;
  result->clock_skew_sigma = rate.sigma;
  // t_gyro = t_camera (1 + skew) + lag, both from their first stamps, is t_camera + delay there.
  result->delay_middle_row_s = lag_s / (1.0 + rate.skew) + offset_s;
  result->notes.push_back(
      "the gyro's clock runs " +
      Format("%.3f ± %.3f %%", 100.0 * std::abs(rate.skew), 100.0 * rate.sigma) +
      (rate.skew > 0.0 ? " fast" : " slow") + " by the camera's: the delay moves by " +
      Format("%.1f ms", 1e3 * std::abs(rate.skew)) +
      " per second, and clock_skew is part of the model");
}

// Why there is too little to search with.
std::string TooLittle(const CameraRates& camera, double span_s, const StartOptions& options) {
  const double all_s = camera.frame_times_s.empty() ? 0.0 : camera.frame_times_s.back();
  std::string reason = "too short: ";
  if (all_s > 2.0 * options.min_span_s) {
    reason = "the pictures of " + Seconds(all_s) +
             " could not be followed (dark, blurred, without contrast, in light that flickers, "
             "or of too few points): ";
  }
  return reason + std::to_string(camera.size()) + " camera rotations in " + Seconds(span_s) +
         ", expected at least " + std::to_string(options.min_pairs) + " in " +
         Seconds(options.min_span_s);
}

// The two streams of a recording, ready for a search.
struct Streams {
  RateAlignment alignment;
  double first_s, last_s;  // of the camera's rotations, after the first frame
  double gyro_span_s;
  double offset_s;     // delay = lag + offset
  double guess_lag_s;  // the recording's
  double gyro_noise_rad_s;
};

// Clocks of different origin: every alignment with half of the shorter stream in the other. What is
// better than the search within the range takes its place, with its verdict and a note.
void SearchAllAlignments(const Streams& s, const StartOptions& options, LagSearch* search,
                         Verdict* verdict, std::string* note) {
  const double span_s = s.last_s - s.first_s;
  const double overlap_s = 0.5 * std::min(span_s, s.gyro_span_s);
  const CameraRates liveliest = LiveliestStretch(s.alignment.camera(), kMaxTemplatePairs);
  const RateAlignment reduced(s.alignment.gyro(), liveliest);
  const int min_pairs = std::max(options.min_pairs, liveliest.size() / 4);
  const LagSearch all =
      SearchLag(reduced, overlap_s - s.last_s, s.gyro_span_s - overlap_s - s.first_s, min_pairs);
  if (!all.found) return;
  Verdict all_verdict = Judge(all, s.gyro_noise_rad_s, s.offset_s, options);
  LagSearch near = SearchLag(s.alignment, all.fit.lag_s - options.search_s,
                             all.fit.lag_s + options.search_s, options.min_pairs);
  if (all_verdict.outcome == Outcome::kTrusted) {
    all_verdict = Judge(near, s.gyro_noise_rad_s, s.offset_s, options);
  }
  if (near.runner_up_ratio < all.runner_up_ratio) {
    near.runner_up_ratio = all.runner_up_ratio;
    near.runner_up_lag_s = all.runner_up_lag_s;
  }
  // A refusal that names a cause, other than a bad fit, is better than none.
  const bool not_found = verdict->outcome == Outcome::kNotFound;
  if (all_verdict.outcome != Outcome::kTrusted && !not_found) return;
  *search = std::move(near);
  const std::string delay = Seconds(search->fit.lag_s + s.offset_s);
  if (not_found) {
    *note =
        "camera and gyro stamps do not overlap in time; with clocks of different origin they fit "
        "at a delay of " +
        delay;
  } else if (std::abs(search->fit.lag_s - s.guess_lag_s) > options.search_s) {
    *note = "within " + Seconds(options.search_s) +
            " of the stamps nothing fits; with clocks of different origin they fit at a delay of " +
            delay;
  }
  if (not_found && all_verdict.outcome != Outcome::kTrusted) {
    all_verdict.reason = verdict->reason + " (camera starts " + Seconds(-s.offset_s) +
                         " after the gyro, lasts " + Seconds(span_s) + ", the gyro " +
                         Seconds(s.gyro_span_s) +
                         "), nor with shifted clocks: " + all_verdict.reason;
  }
  *verdict = all_verdict;
}

}  // namespace

double UsualInterval(const Recording& recording) {
  return std::min(1.0 / 30.0, MedianInterval(recording.frames));
}

StartReadout UsualReadout(const Recording& recording) {
  const double interval_s = UsualInterval(recording);
  return {0.5 * interval_s, 0.3 * interval_s, /*determined=*/false};
}

RoughAlignment RoughlyAligned(const StartResult& start, double readout_s) {
  return {start.q_gyro_cam, start.bias_gyro_rad_s, start.delay_middle_row_s, start.clock_skew,
          readout_s};
}

Result<StartResult> FindStart(const Recording& recording,
                              const std::vector<CameraRotation>& rotations,
                              const StartOptions& options) {
  if (recording.gyro.size() < 3) return CannotEstimate("too short: fewer than 3 gyro samples");
  GyroRates gyro(recording.gyro);
  if (!gyro.omega_gyro_rad_s.allFinite()) return BadInput("a gyro rate is not finite");
  auto made = MakeCameraRates(recording, rotations, gyro);
  if (!made) return tl::unexpected<Error>(made.error());
  const CameraRates camera = *std::move(made);

  const double first_s = camera.size() > 0 ? camera.frame_times_s[camera.frame_a.front()] : 0.0;
  double last_s = first_s;
  for (const int b : camera.frame_b) last_s = std::max(last_s, camera.frame_times_s[b]);
  const double span_s = last_s - first_s;
  if (camera.size() < options.min_pairs || span_s < options.min_span_s) {
    return CannotEstimate(TooLittle(camera, span_s, options));
  }
  const double noise = std::sqrt(3.0) * gyro.Noise(span_s / camera.size());
  // A difference of integers, so that large stamps lose nothing.
  const double offset_s =
      SecondsSince(recording.frames.front().stamp_ns, recording.gyro.front().stamp_ns);
  const double guess_lag_s = recording.camera.delay_s.value_or(0.0) +
                             0.5 * recording.camera.readout_s.value_or(0.0) - offset_s;
  const double from_s = guess_lag_s - options.search_s, to_s = guess_lag_s + options.search_s;

  const double gyro_span_s = gyro.times_s.back();
  const auto streams_at = [&](double skew) {
    return Streams{RateAlignment(gyro, OnGyroClock(camera, skew)),
                   first_s * (1.0 + skew),
                   last_s * (1.0 + skew),
                   gyro_span_s,
                   offset_s,
                   guess_lag_s,
                   noise};
  };
  // A line through delays of stretches that explain nothing, since the delay lies out of reach, is
  // a line of noise: the clock's rate is believed where the camera follows the gyro with it.
  ClockRate rate = FindClockRate(gyro, camera, from_s, to_s);
  if (!rate.beyond_doubt) rate.skew = 0.0;
  Streams streams = streams_at(rate.skew);
  LagSearch search = SearchLag(streams.alignment, from_s, to_s, options.min_pairs);
  Verdict verdict = Judge(search, noise, offset_s, options);
  if (rate.beyond_doubt && verdict.outcome != Outcome::kTrusted) {
    rate = ClockRate();
    streams = streams_at(0.0);
    search = SearchLag(streams.alignment, from_s, to_s, options.min_pairs);
    verdict = Judge(search, noise, offset_s, options);
  }
  std::string note;
  if (verdict.outcome == Outcome::kNotFound || verdict.outcome == Outcome::kDoesNotFollow) {
    SearchAllAlignments(streams, options, &search, &verdict, &note);
  }
  if (verdict.outcome != Outcome::kTrusted) return CannotEstimate(verdict.reason);

  StartResult result = MakeResult(search, offset_s, recording.camera.q_gyro_cam);
  if (rate.beyond_doubt) SetClockRate(rate, search.fit.lag_s, offset_s, &result);
  if (!note.empty()) result.notes.insert(result.notes.begin(), note);
  return result;
}

}  // namespace camgyro
