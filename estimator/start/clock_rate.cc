#include "estimator/start/clock_rate.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/robust_statistics.h"

namespace camgyro {
namespace {

// 2 % move the delay by 80 ms within a stretch, 20 ms rms: hands turn at up to some 2.5 Hz. Fewer
// stretches tell no line from a step; more cost time and add little.
constexpr double kStretchS = 4.0;
constexpr int kLeastStretches = 5, kMostStretches = 30;
constexpr int kLeastPairs = 20;       // of a stretch
constexpr double kLagStepS = 0.01;    // of the search over delays
constexpr double kSkewStepS = 0.02;   // of the search over skews, as drift over the recording
constexpr double kSlopeStepS = 2e-3;  // of the derivative by the lag
constexpr int kRefinements = 4;
constexpr double kReachS = 0.05;  // a stretch's own delay is within so much of the line
// A drift below is left to the model (effect clock_skew), which finds it from the frames; a step of
// the delay, or one that wanders, leaves residuals of more than a tenth of such a line.
constexpr double kLeastDriftS = 0.02;
constexpr double kLeastSigmas = 10.0;
constexpr double kMostScatter = 0.05;  // of the residuals, over the drift
constexpr double kLeastOnLine = 0.7;   // of the stretches, within kOnLine of the drift
constexpr double kOnLine = 0.1;
// A stretch that turns by less than this share of the liveliest one is at rest: its delay would be
// that of noise, and stays wherever the line is tried.
constexpr double kLeastTurning = 0.1;

struct Stretch {
  RateAlignment alignment;
  double middle_s;                // after the first frame
  std::vector<double> explained;  // by lag on the grid; -1: not covered
};

// Pairs first..last-1, with times of their own frames only, which count from the same origin.
CameraRates Part(const CameraRates& camera, int first, int last) {
  CameraRates part;
  std::vector<int> frames(camera.frame_a.begin() + first, camera.frame_a.begin() + last);
  frames.insert(frames.end(), camera.frame_b.begin() + first, camera.frame_b.begin() + last);
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  const auto index = [&](int frame) {
    return static_cast<int>(std::lower_bound(frames.begin(), frames.end(), frame) - frames.begin());
  };
  for (const int frame : frames) {
    part.frame_times_s.push_back(camera.frame_times_s[static_cast<size_t>(frame)]);
  }
  for (int i = first; i < last; ++i) {
    part.frame_a.push_back(index(camera.frame_a[static_cast<size_t>(i)]));
    part.frame_b.push_back(index(camera.frame_b[static_cast<size_t>(i)]));
  }
  part.omega_cam_rad_s = camera.omega_cam_rad_s.middleCols(first, last - first);
  part.weight = camera.weight.segment(first, last - first);
  return part;
}

double TimeOf(const CameraRates& camera, int pair) {
  const auto i = static_cast<size_t>(pair);
  return 0.5 * (camera.frame_times_s[static_cast<size_t>(camera.frame_a[i])] +
                camera.frame_times_s[static_cast<size_t>(camera.frame_b[i])]);
}

// The gyro's samples between two times.
GyroRates Between(const GyroRates& gyro, double from_s, double to_s) {
  const auto begin = std::lower_bound(gyro.times_s.begin(), gyro.times_s.end(), from_s);
  const auto end = std::upper_bound(begin, gyro.times_s.end(), to_s);
  GyroRates part({});
  part.times_s.assign(begin, end);
  part.omega_gyro_rad_s =
      gyro.omega_gyro_rad_s.middleCols(begin - gyro.times_s.begin(), end - begin);
  return part;
}

std::vector<Stretch> Cut(const GyroRates& gyro, const CameraRates& camera, double first_lag_s,
                         double last_lag_s) {
  std::vector<Stretch> stretches;
  if (camera.size() == 0) return stretches;
  const double begin_s = TimeOf(camera, 0), end_s = TimeOf(camera, camera.size() - 1);
  const double stretch_s =
      std::max(kStretchS, kLeastPairs * (end_s - begin_s) / static_cast<double>(camera.size()));
  const int slots = std::max(1, static_cast<int>((end_s - begin_s) / stretch_s));
  const int stride = (slots + kMostStretches - 1) / kMostStretches;
  int first = 0;
  for (int slot = 0; slot < slots; ++slot) {
    const double until_s = begin_s + (end_s - begin_s) * (slot + 1) / slots;
    int last = first;
    while (last < camera.size() && (slot + 1 == slots || TimeOf(camera, last) < until_s)) ++last;
    if (slot % stride == 0 && 2 * (last - first) >= kLeastPairs) {
      const double from_s = TimeOf(camera, first), to_s = TimeOf(camera, last - 1);
      const double reach_s = 1.0 + kLargestSkew * to_s;
      GyroRates near = Between(gyro, from_s + first_lag_s - reach_s, to_s + last_lag_s + reach_s);
      if (near.times_s.size() >= static_cast<size_t>(kLeastPairs)) {
        stretches.push_back(
            {RateAlignment(std::move(near), Part(camera, first, last)), 0.5 * (from_s + to_s), {}});
      }
    }
    first = last;
  }
  return stretches;
}

// Leaves out the stretches at rest, by what the gyro has about its mean there.
void LeaveOutRest(double lag_s, std::vector<Stretch>* stretches) {
  std::vector<double> rms;
  for (const Stretch& stretch : *stretches) {
    rms.push_back(stretch.alignment.At(lag_s, {}).gyro_rms_rad_s);
  }
  const double most = rms.empty() ? 0.0 : *std::max_element(rms.begin(), rms.end());
  size_t next = 0;
  stretches->erase(
      std::remove_if(stretches->begin(), stretches->end(),
                     [&](const Stretch&) { return rms[next++] < kLeastTurning * most; }),
      stretches->end());
}

struct Line {
  double lag_s = 0.0, skew = 0.0;
  double At(double time_s) const { return lag_s + skew * time_s; }
};

// The best mean of what the stretches explain along a line, over lags and skews.
Line SearchLine(double first_lag_s, double last_lag_s, std::vector<Stretch>* stretches) {
  const double span_s = stretches->back().middle_s;
  const double first_s = first_lag_s - kLargestSkew * span_s;
  const int lags =
      1 + static_cast<int>(std::ceil((last_lag_s + kLargestSkew * span_s - first_s) / kLagStepS));
  for (Stretch& stretch : *stretches) {
    const double drift_s = kLargestSkew * stretch.middle_s;
    stretch.explained.assign(static_cast<size_t>(lags), -1.0);
    for (int k = 0; k < lags; ++k) {
      const double lag_s = first_s + k * kLagStepS;
      if (lag_s < first_lag_s - drift_s || lag_s > last_lag_s + drift_s) continue;
      const RateAlignment::Fit fit = stretch.alignment.At(lag_s, {});
      if (2 * fit.pairs < stretch.alignment.camera().size()) continue;
      // What is explained of the power that is there: a stretch at rest has no say.
      stretch.explained[static_cast<size_t>(k)] = fit.explained * fit.gyro_rms_rad_s;
    }
  }
  Line best;
  double most = -1.0;
  const int skews = static_cast<int>(std::ceil(kLargestSkew * span_s / kSkewStepS));
  for (int j = -skews; j <= skews; ++j) {
    const double skew = kLargestSkew * j / skews;
    for (double lag_s = first_lag_s; lag_s <= last_lag_s; lag_s += kLagStepS) {
      double sum = 0.0;
      for (const Stretch& stretch : *stretches) {
        const double at = (lag_s + skew * stretch.middle_s - first_s) / kLagStepS;
        const auto k = static_cast<size_t>(std::clamp(std::llround(at), 0LL, lags - 1LL));
        sum += stretch.explained[k];
      }
      if (sum > most) {
        most = sum;
        best = {lag_s, skew};
      }
    }
  }
  return best;
}

// The lag at which a stretch fits best near one, by Gauss-Newton with the rotation, the bias and
// the ratio that fit there. Sigma from the residuals. False without a minimum.
bool OwnLag(const RateAlignment& alignment, double near_s, double* lag_s, double* sigma_s) {
  const CameraRates& camera = alignment.camera();
  const Eigen::Vector3d mean_c = camera.omega_cam_rad_s * camera.weight / camera.weight.sum();
  *lag_s = near_s;
  for (int iteration = 0; iteration < kRefinements; ++iteration) {
    const RateAlignment::Fit fit = alignment.At(*lag_s, {});
    if (2 * fit.pairs < camera.size() || !(fit.rate_ratio > 0.0)) return false;
    Eigen::Matrix3Xd before, at, after;
    std::vector<char> covered_before, covered, covered_after;
    alignment.MeanGyroRates(*lag_s - kSlopeStepS, &before, &covered_before);
    alignment.MeanGyroRates(*lag_s, &at, &covered);
    alignment.MeanGyroRates(*lag_s + kSlopeStepS, &after, &covered_after);
    // The fit's bias is for rates of a ratio of one.
    const Eigen::Vector3d bias =
        fit.bias_gyro_rad_s + (1.0 - fit.rate_ratio) * (fit.R_gyro_cam * mean_c);
    double information = 0.0, score = 0.0, squares = 0.0, count = 0.0;
    for (int i = 0; i < camera.size(); ++i) {
      const auto k = static_cast<size_t>(i);
      if (!covered_before[k] || !covered[k] || !covered_after[k]) continue;
      const Eigen::Vector3d slope = (after.col(i) - before.col(i)) / (2.0 * kSlopeStepS);
      const Eigen::Vector3d residual =
          at.col(i) - bias - fit.rate_ratio * (fit.R_gyro_cam * camera.omega_cam_rad_s.col(i));
      const double w = camera.weight[i];
      information += w * slope.squaredNorm();
      score += w * slope.dot(residual);
      squares += w * residual.squaredNorm();
      count += 3.0;
    }
    if (!(information > 0.0)) return false;
    *lag_s -= score / information;
    *sigma_s = std::sqrt(squares / count / information);
    if (std::abs(*lag_s - near_s) > kReachS) return false;
  }
  return std::isfinite(*lag_s) && *sigma_s > 0.0;
}

}  // namespace

ClockRate FindClockRate(const GyroRates& gyro, const CameraRates& camera, double first_lag_s,
                        double last_lag_s) {
  ClockRate rate;
  std::vector<Stretch> stretches = Cut(gyro, camera, first_lag_s, last_lag_s);
  LeaveOutRest(0.5 * (first_lag_s + last_lag_s), &stretches);
  if (static_cast<int>(stretches.size()) < kLeastStretches) return rate;
  Line line = SearchLine(first_lag_s, last_lag_s, &stretches);
  std::vector<double> times_s, lags_s;
  for (const Stretch& stretch : stretches) {
    // On the clock of the line found so far: the delay of a stretch is that of when it turned most,
    // which is not its middle, and 0.8 % of half a second are 4 ms.
    const RateAlignment on_line(stretch.alignment.gyro(),
                                OnGyroClock(stretch.alignment.camera(), line.skew));
    double lag_s = 0.0, sigma_s = 0.0;
    if (!OwnLag(on_line, line.lag_s, &lag_s, &sigma_s)) continue;
    times_s.push_back(stretch.middle_s);
    lags_s.push_back(lag_s + line.skew * stretch.middle_s);
  }
  const size_t n = times_s.size();
  if (static_cast<int>(n) < kLeastStretches) return rate;
  // Theil and Sen: the median of the slopes between any two.
  std::vector<double> slopes, offsets, residuals;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i + 1; j < n; ++j) {
      slopes.push_back((lags_s[j] - lags_s[i]) / (times_s[j] - times_s[i]));
    }
  }
  line.skew = MedianInPlace(&slopes);
  for (size_t i = 0; i < n; ++i) offsets.push_back(lags_s[i] - line.skew * times_s[i]);
  line.lag_s = MedianInPlace(&offsets);
  const double span_s = times_s.back() - times_s.front();
  rate.skew = line.skew;
  rate.drift_s = std::abs(line.skew) * span_s;
  double variance = 0.0, mean_s = 0.0;
  for (const double t : times_s) mean_s += t / static_cast<double>(n);
  for (size_t i = 0; i < n; ++i) {
    residuals.push_back(std::abs(lags_s[i] - line.At(times_s[i])));
    rate.stretches += residuals.back() < kOnLine * rate.drift_s ? 1 : 0;
    variance += (times_s[i] - mean_s) * (times_s[i] - mean_s);
  }
  const double scatter_s = kSigmaOfMedian * MedianInPlace(&residuals);
  rate.sigma = scatter_s / std::sqrt(variance);
  rate.beyond_doubt = rate.drift_s > kLeastDriftS && std::abs(rate.skew) < kLargestSkew &&
                      std::abs(rate.skew) > kLeastSigmas * rate.sigma &&
                      scatter_s < kMostScatter * rate.drift_s &&
                      rate.stretches >= kLeastOnLine * static_cast<double>(stretches.size());
  return rate;
}

CameraRates OnGyroClock(CameraRates camera, double skew) {
  for (double& time_s : camera.frame_times_s) time_s *= 1.0 + skew;
  camera.omega_cam_rad_s /= 1.0 + skew;
  return camera;
}

}  // namespace camgyro
