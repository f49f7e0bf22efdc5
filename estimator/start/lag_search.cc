#include "estimator/start/lag_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "core/robust_statistics.h"
#include "core/so3.h"
#include "core/time.h"

namespace camgyro {
namespace {

constexpr double kMinStepS = 0.002, kMaxStepS = 0.02;
constexpr double kStepIntervals = 1.0 / 3.0;  // of the camera's: several points in any lobe
constexpr int kMaxRounds = 3;
// Unexplained fractions are compared above this floor: model errors that grow with the signal.
constexpr double kFloor = 0.02;
constexpr double kMaxRateRatio = 2.5;     // beyond, a fit of scale one has no meaning
constexpr double kMaxWeightRatio = 10.0;  // of one pair against the median pair

size_t BestIndex(const std::vector<LagPoint>& curve) {
  return static_cast<size_t>(std::max_element(curve.begin(), curve.end(),
                                              [](const LagPoint& x, const LagPoint& y) {
                                                return x.explained < y.explained;
                                              }) -
                             curve.begin());
}

std::vector<LagPoint> EvaluateGrid(const RateAlignment& alignment, double first_lag_s,
                                   double last_lag_s, double step_s, int min_pairs,
                                   const Eigen::VectorXd& pair_weight) {
  std::vector<LagPoint> curve;
  const int steps = std::max(1, static_cast<int>(std::ceil((last_lag_s - first_lag_s) / step_s)));
  for (int k = 0; k <= steps; ++k) {
    LagPoint point;
    point.lag_s = first_lag_s + (last_lag_s - first_lag_s) * k / steps;
    const RateAlignment::Fit fit = alignment.At(point.lag_s, pair_weight);
    if (fit.pairs < min_pairs) continue;
    point.explained = fit.explained;
    point.explained_mirrored = fit.explained_mirrored;
    curve.push_back(point);
  }
  return curve;
}

void FindRunnerUp(size_t best, LagSearch* search) {
  const std::vector<LagPoint>& curve = search->curve;
  std::vector<double> all;
  for (const LagPoint& point : curve) all.push_back(point.explained);
  const double half_way = 0.5 * (curve[best].explained + MedianOr(all, 0.0));
  size_t low = best, high = best;
  while (low > 0 && curve[low].explained > half_way) --low;
  while (high + 1 < curve.size() && curve[high].explained > half_way) ++high;
  double runner_up = -1.0;
  for (size_t k = 0; k < curve.size(); ++k) {
    if ((k > low && k < high) || k == best) continue;
    if (curve[k].explained > runner_up) {
      runner_up = curve[k].explained;
      search->runner_up_lag_s = curve[k].lag_s;
    }
  }
  search->runner_up_ratio =
      runner_up < 0.0 ? 1.0 : (1.0 - curve[best].explained + kFloor) / (1.0 - runner_up + kFloor);
}

}  // namespace

LagSearch SearchLag(const RateAlignment& alignment, double first_lag_s, double last_lag_s,
                    int min_pairs) {
  LagSearch search;
  std::vector<double> intervals;
  for (int i = 0; i < alignment.camera().size(); ++i) {
    intervals.push_back(alignment.camera().interval_s(i));
  }
  const double step_s = std::clamp(kStepIntervals * MedianOr(intervals, 0.0), kMinStepS, kMaxStepS);

  Eigen::VectorXd weight;  // none at first
  double previous_lag_s = 0.0;
  for (int round = 0; round < kMaxRounds; ++round) {
    search.curve = EvaluateGrid(alignment, first_lag_s, last_lag_s, step_s, min_pairs, weight);
    if (search.curve.size() < 3) return search;
    search.found = true;
    const size_t best = BestIndex(search.curve);
    search.on_edge = best == 0 || best + 1 == search.curve.size();
    FindRunnerUp(best, &search);
    const double lag_s = search.curve[best].lag_s;
    search.best = alignment.At(lag_s, weight);
    if (round == 0) search.gyro_rms_rad_s = search.best.gyro_rms_rad_s;
    search.fit.lag_s = lag_s;
    search.fit.q_gyro_cam = Eigen::Quaterniond(search.best.R_gyro_cam);
    search.fit.bias_gyro_rad_s = search.best.bias_gyro_rad_s;
    const double ratio = search.best.rate_ratio;
    if (!(ratio < kMaxRateRatio && ratio > 1.0 / kMaxRateRatio)) break;
    search.fit =
        FitStart(alignment, lag_s, search.fit.q_gyro_cam, search.fit.bias_gyro_rad_s, ratio);
    if (!search.fit.converged || std::abs(search.fit.lag_s - lag_s) > 3.0 * step_s) {
      // No minimum near the grid's best point.
      search.fit.converged = false;
      break;
    }
    search.best = alignment.At(search.fit.lag_s, search.fit.robust_weight);
    if (round > 0 && std::abs(lag_s - previous_lag_s) <= step_s) break;
    previous_lag_s = lag_s;
    weight = search.fit.robust_weight;
    // A pair outside the gyro's time at this lag must still count at others.
    for (Eigen::Index i = 0; i < weight.size(); ++i) {
      if (weight[i] == 0.0) weight[i] = 1.0;
    }
  }
  const auto mirrored = std::max_element(search.curve.begin(), search.curve.end(),
                                         [](const LagPoint& x, const LagPoint& y) {
                                           return x.explained_mirrored < y.explained_mirrored;
                                         });
  search.mirrored = alignment.At(mirrored->lag_s, weight);
  return search;
}

Result<CameraRates> MakeCameraRates(const Recording& recording,
                                    const std::vector<CameraRotation>& rotations,
                                    const GyroRates& gyro) {
  CameraRates camera;
  for (const Frame& frame : recording.frames) {
    camera.frame_times_s.push_back(SecondsSince(recording.frames.front().stamp_ns, frame.stamp_ns));
  }
  const Eigen::Vector3d mean = gyro.omega_gyro_rad_s.rowwise().mean();
  const double fastest = 2.0 * (gyro.omega_gyro_rad_s.colwise() - mean).colwise().norm().maxCoeff();

  std::vector<Eigen::Vector3d> rates;
  std::vector<double> sigmas;
  int too_fast = 0;
  for (const CameraRotation& rotation : rotations) {
    const int a = rotation.frame_a, b = rotation.frame_b;
    const std::string name = "camera rotation " + std::to_string(rates.size());
    if (a < 0 || b <= a || b >= static_cast<int>(recording.frames.size())) {
      return BadInput(name + " joins frames " + std::to_string(a) + " and " + std::to_string(b) +
                      ", expected ascending frames below " +
                      std::to_string(recording.frames.size()));
    }
    if (!rotation.q_a_b.coeffs().allFinite() || std::abs(rotation.q_a_b.norm() - 1.0) > 1e-3 ||
        !std::isfinite(rotation.sigma_rad)) {
      return BadInput(name + " is not a finite unit quaternion with a finite sigma");
    }
    rates.push_back(Log(rotation.q_a_b.normalized()) /
                    (camera.frame_times_s[b] - camera.frame_times_s[a]));
    if (rotation.sigma_rad > 0.0) sigmas.push_back(rotation.sigma_rad);
    too_fast += rates.back().norm() > fastest ? 1 : 0;
  }
  const bool drop = 2 * too_fast < static_cast<int>(rates.size());
  const double usual_sigma = MedianOr(sigmas, 1.0);

  std::vector<size_t> order(rates.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t x, size_t y) { return rotations[x].frame_a < rotations[y].frame_a; });
  std::vector<double> weights;
  std::vector<Eigen::Vector3d> kept;
  for (const size_t i : order) {
    if (drop && rates[i].norm() > fastest) continue;
    const CameraRotation& rotation = rotations[i];
    camera.frame_a.push_back(rotation.frame_a);
    camera.frame_b.push_back(rotation.frame_b);
    kept.push_back(rates[i]);
    const double interval_s =
        camera.frame_times_s[rotation.frame_b] - camera.frame_times_s[rotation.frame_a];
    const double sigma = rotation.sigma_rad > 0.0 ? rotation.sigma_rad : usual_sigma;
    const double sqrt_weight = interval_s / std::hypot(sigma, gyro.Noise(interval_s) * interval_s);
    weights.push_back(sqrt_weight * sqrt_weight);
  }
  const double usual_weight = MedianOr(weights, 0.0);
  camera.omega_cam_rad_s.resize(3, static_cast<Eigen::Index>(kept.size()));
  camera.weight.resize(static_cast<Eigen::Index>(kept.size()));
  for (size_t i = 0; i < kept.size(); ++i) {
    const auto col = static_cast<Eigen::Index>(i);
    camera.omega_cam_rad_s.col(col) = kept[i];
    // Relative to the median, so that the power of the gyro has a meaning in (rad/s)^2.
    camera.weight[col] = std::min(weights[i] / usual_weight, kMaxWeightRatio);
  }
  return camera;
}

CameraRates LiveliestStretch(const CameraRates& camera, int max_pairs) {
  if (camera.size() <= max_pairs) return camera;
  const Eigen::Vector3d mean = camera.omega_cam_rad_s.rowwise().mean();
  const Eigen::VectorXd power =
      (camera.omega_cam_rad_s.colwise() - mean).colwise().squaredNorm().transpose();
  double sum = power.head(max_pairs).sum(), best = sum;
  int first = 0;
  for (int i = 1; i + max_pairs <= camera.size(); ++i) {
    sum += power[i + max_pairs - 1] - power[i - 1];
    if (sum > best) {
      best = sum;
      first = i;
    }
  }
  CameraRates part;
  part.frame_times_s = camera.frame_times_s;
  part.frame_a.assign(camera.frame_a.begin() + first, camera.frame_a.begin() + first + max_pairs);
  part.frame_b.assign(camera.frame_b.begin() + first, camera.frame_b.begin() + first + max_pairs);
  part.omega_cam_rad_s = camera.omega_cam_rad_s.middleCols(first, max_pairs);
  part.weight = camera.weight.segment(first, max_pairs);
  return part;
}

}  // namespace camgyro
