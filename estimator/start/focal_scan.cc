#include "estimator/start/focal_scan.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/robust_statistics.h"
#include "core/time.h"
#include "core/usual_focal.h"
#include "estimator/start/clock_rate.h"
#include "estimator/start/lag_search.h"
#include "estimator/start/rate_alignment.h"
#include "estimator/start/start_fit.h"

namespace camgyro {
namespace {

constexpr int kBlocks = 20;              // of time, for the honest sigma
constexpr double kTruncateSigmas = 3.0;  // of the norm of two axes
constexpr double kMedianNorm2 = 1.177;   // median norm of 2 normal variables of sigma 1
constexpr double kDeterminedLog = 0.1;   // sigma of log f
constexpr double kDistinctLog = 0.22;    // 25 %
constexpr double kMaxRunnerUp = 0.8;     // a wrong lens moves shallow minima far
constexpr double kModelLog = 0.02;       // rotations of pictures neglect rolling shutter and lens
constexpr double kUnknownLog = 0.3;      // what is known of any lens
constexpr double kLooseRateRatio = 4.5;  // the whole scan may be off by this

struct ScanPoint {
  double log_focal = 0.0;
  std::vector<CameraRotation> rotations;
  // Squared residuals of pan and tilt of each pair [(px/s)^2], and the pair's block.
  std::vector<double> squares;
  std::vector<int> blocks;
  double noise_px_s = 0.0;
  double gyro_power = 0.0;
  // Truncated losses per block, and the total.
  Eigen::VectorXd loss;
};

// Residuals at one focal length, with lag, orientation and bias fitted to it. In the image (angle
// times focal length), where the camera's noise does not depend on the focal length assumed: in
// angles, a longer focal length would always shrink it, and win.
void Measure(const Recording& recording, const StartResult& near, double lag_s,
             const StartOptions& options, ScanPoint* point) {
  GyroRates gyro(recording.gyro);
  auto camera = MakeCameraRates(recording, point->rotations, gyro);
  if (!camera || camera->size() < options.min_pairs) return;
  const RateAlignment alignment(std::move(gyro), OnGyroClock(*std::move(camera), near.clock_skew));
  const StartFit fit = FitStart(alignment, lag_s, near.q_gyro_cam, near.bias_gyro_rad_s, 1.0);
  Eigen::Matrix3Xd rates;
  std::vector<char> covered;
  alignment.MeanGyroRates(fit.lag_s, &rates, &covered);
  const CameraRates& cam = alignment.camera();
  const int frames = static_cast<int>(recording.frames.size());
  const double focal_px = std::exp(point->log_focal);
  std::vector<double> norms;
  for (int i = 0; i < cam.size(); ++i) {
    if (!covered[i]) continue;
    const Eigen::Vector3d gyro_rate_cam =
        fit.q_gyro_cam.conjugate() * (rates.col(i) - fit.bias_gyro_rad_s);
    const double scale = focal_px * std::sqrt(cam.weight[i]);
    norms.push_back(scale * (cam.omega_cam_rad_s.col(i) - gyro_rate_cam).head<2>().norm());
    point->squares.push_back(norms.back() * norms.back());
    point->blocks.push_back(cam.frame_a[i] * kBlocks / frames);
    point->gyro_power += cam.weight[i] * gyro_rate_cam.head<2>().squaredNorm();
  }
  point->noise_px_s = MedianInPlace(&norms) / kMedianNorm2;
}

// Parabola y = c0 + c1 x + c2 x^2 through points (least squares); rows of coefficients per column
// of y.
Eigen::MatrixXd FitParabola(const Eigen::VectorXd& x, const Eigen::MatrixXd& y) {
  Eigen::MatrixXd powers(x.size(), 3);
  powers << Eigen::VectorXd::Ones(x.size()), x, x.cwiseAbs2();
  return powers.colPivHouseholderQr().solve(y);
}

// The scan over focal lengths, step by step.
class FocalScan {
 public:
  FocalScan(const Recording& recording, const CameraRotationsAtFocals& rotations_at,
            const StartOptions& options, const FocalScanOptions& scan_options)
      : recording_(recording),
        rotations_at_(rotations_at),
        options_(options),
        log_guess_(std::log(FocalToBeginWith(recording.camera))),
        spacing_(std::log(scan_options.max_focal / scan_options.min_focal) /
                 (scan_options.points - 1)) {
    const double side_px = std::max(recording.camera.width_px, recording.camera.height_px);
    const double log_min = std::log(scan_options.min_focal * side_px);
    points_.resize(static_cast<size_t>(scan_options.points));
    for (size_t k = 0; k < points_.size(); ++k) {
      points_[k].log_focal = log_min + spacing_ * static_cast<double>(k);
    }
    FindRotations(&points_);
  }

  // Delay and orientation, to which a wrong focal length is mostly a scale: from the points nearest
  // to the guess outwards, the first that works.
  Status FindNear() {
    std::vector<size_t> order(points_.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
      return std::abs(points_[a].log_focal - log_guess_) <
             std::abs(points_[b].log_focal - log_guess_);
    });
    StartOptions loose = options_;
    loose.max_rate_ratio = kLooseRateRatio;
    Status first_error = CannotEstimate("");
    for (const size_t k : order) {
      Result<StartResult> near = FindStart(recording_, points_[k].rotations, loose);
      if (near) {
        near_ = std::move(*near);
        return {};
      }
      if (k == order.front()) first_error = tl::unexpected<Error>(near.error());
    }
    return first_error;
  }

  // The loss at every point, and at two points more around the best.
  void Scan() {
    for (ScanPoint& point : points_) MeasureAt(&point);
    Truncate();
    const double coarse = points_[BestPoint()].log_focal;
    std::vector<ScanPoint> between(2);
    between[0].log_focal = coarse - 0.5 * spacing_;
    between[1].log_focal = coarse + 0.5 * spacing_;
    FindRotations(&between);
    for (ScanPoint& point : between) {
      MeasureAt(&point);
      points_.push_back(std::move(point));
    }
    Truncate();
    std::sort(points_.begin(), points_.end(),
              [](const ScanPoint& x, const ScanPoint& y) { return x.log_focal < y.log_focal; });
  }

  // The focal length, by the parabola around the best point.
  StartFocal Fit() const {
    StartFocal focal;
    const size_t best = BestPoint();
    const double best_log = points_[best].log_focal, best_loss = points_[best].loss.sum();
    double second_loss = -1.0;
    std::vector<size_t> close;
    for (size_t k = 0; k < points_.size(); ++k) {
      const double loss = points_[k].loss.sum();
      const double distance = std::abs(points_[k].log_focal - best_log);
      focal.curve.push_back(
          {std::exp(points_[k].log_focal), loss / (gyro_power_ * std::exp(2.0 * best_log))});
      if (distance < 1.1 * spacing_) close.push_back(k);
      if (distance > kDistinctLog && (second_loss < 0.0 || loss < second_loss)) second_loss = loss;
    }
    focal.runner_up_ratio = second_loss > 0.0 ? best_loss / second_loss : 1.0;
    const bool inside = best > 0 && best + 1 < points_.size();
    auto [log_focal, sigma_log] = Minimum(close, best_log, inside);
    sigma_log = std::hypot(sigma_log, kModelLog);
    focal.determined = sigma_log < kDeterminedLog && focal.runner_up_ratio < kMaxRunnerUp;
    if (!focal.determined) {
      log_focal = log_guess_;
      sigma_log = kUnknownLog;
    }
    focal.value_px = std::exp(log_focal);
    focal.sigma_px = sigma_log * focal.value_px;
    return focal;
  }

 private:
  void FindRotations(std::vector<ScanPoint>* points) const {
    std::vector<double> focals_px;
    for (const ScanPoint& point : *points) focals_px.push_back(std::exp(point.log_focal));
    std::vector<std::vector<CameraRotation>> rotations = rotations_at_(focals_px);
    for (size_t k = 0; k < points->size(); ++k) (*points)[k].rotations = std::move(rotations[k]);
  }

  void MeasureAt(ScanPoint* point) const {
    // The inverse of what FindStart makes of a lag.
    const double lag_s =
        (near_.delay_middle_row_s -
         SecondsSince(recording_.frames.front().stamp_ns, recording_.gyro.front().stamp_ns)) *
        (1.0 + near_.clock_skew);
    Measure(recording_, near_, lag_s, options_, point);
  }

  // Losses, bounded by the least noise of any point.
  void Truncate() {
    for (const ScanPoint& point : points_) {
      if (point.squares.empty()) continue;
      if (noise_px_s_ < 0.0 || point.noise_px_s < noise_px_s_) noise_px_s_ = point.noise_px_s;
      pairs_ = std::max(pairs_, point.squares.size());
      gyro_power_ = std::max(gyro_power_, point.gyro_power);
    }
    const double cap = 2.0 * std::pow(kTruncateSigmas * noise_px_s_, 2);
    for (ScanPoint& point : points_) {
      point.loss = Eigen::VectorXd::Zero(kBlocks);
      for (size_t i = 0; i < point.squares.size(); ++i) {
        point.loss[point.blocks[i]] += std::min(point.squares[i], cap);
      }
      // A pair that found no rotation at this focal length counts as an outlier.
      point.loss.array() += cap * static_cast<double>(pairs_ - point.squares.size()) / kBlocks;
    }
  }

  size_t BestPoint() const {
    return static_cast<size_t>(std::min_element(points_.begin(), points_.end(),
                                                [](const ScanPoint& x, const ScanPoint& y) {
                                                  return x.loss.sum() < y.loss.sum();
                                                }) -
                               points_.begin());
  }

  // Of the parabola through some points: log of the focal length, and its standard deviation.
  std::pair<double, double> Minimum(const std::vector<size_t>& close, double best_log,
                                    bool inside) const {
    Eigen::VectorXd x(static_cast<Eigen::Index>(close.size()));
    Eigen::MatrixXd y(static_cast<Eigen::Index>(close.size()), kBlocks);
    for (size_t k = 0; k < close.size(); ++k) {
      x[static_cast<Eigen::Index>(k)] = points_[close[k]].log_focal - best_log;
      y.row(static_cast<Eigen::Index>(k)) = points_[close[k]].loss.transpose();
    }
    const Eigen::MatrixXd parabolas = FitParabola(x, y);
    const Eigen::Vector3d sum = parabolas.rowwise().sum();
    if (!inside || !(sum[2] > 0.0)) return {best_log, 1.0};
    const double shift = std::clamp(-0.5 * sum[1] / sum[2], -spacing_, spacing_);
    const double classical = noise_px_s_ * noise_px_s_ / sum[2];
    const double scores = (parabolas.row(1) + 2.0 * shift * parabolas.row(2)).squaredNorm() *
                          kBlocks / (kBlocks - 1.0);
    const double sandwich = scores / (4.0 * sum[2] * sum[2]);
    return {best_log + shift, std::min(1.0, std::sqrt(std::max(classical, sandwich)))};
  }

  const Recording& recording_;
  const CameraRotationsAtFocals& rotations_at_;
  const StartOptions& options_;
  const double log_guess_, spacing_;
  std::vector<ScanPoint> points_;
  StartResult near_;
  double noise_px_s_ = -1.0, gyro_power_ = 0.0;
  size_t pairs_ = 1;  // with a rotation, at the point that has most
};

}  // namespace

Result<StartResult> FindStartAndFocal(const Recording& recording,
                                      const CameraRotationsAtFocals& rotations_at,
                                      const StartOptions& options,
                                      const FocalScanOptions& scan_options) {
  if (!(std::max(recording.camera.width_px, recording.camera.height_px) > 0)) {
    return BadInput("focal scan: the size of the picture is not known");
  }
  if (recording.gyro.empty() || recording.frames.empty()) {
    return CannotEstimate("focal scan: no gyro samples or no frames");
  }
  if (scan_options.points < 5 || !(scan_options.min_focal > 0.0) ||
      !(scan_options.max_focal > scan_options.min_focal)) {
    return BadUsage("focal scan: expected 5 points or more and 0 < min_focal < max_focal");
  }
  FocalScan scan(recording, rotations_at, options, scan_options);
  if (const Status near = scan.FindNear(); !near) return tl::unexpected(near.error());
  scan.Scan();
  StartFocal focal = scan.Fit();
  // The start at that focal length.
  auto start = FindStart(recording, rotations_at({focal.value_px}).front(), options);
  if (!start) return start;
  if (!focal.determined) {
    start->notes.push_back(
        "the focal length is not determined (too little pan and tilt, or a distorting lens); " +
        std::string(recording.camera.focal_px ? "the recording's guess" : "a usual one") +
        " is used");
  }
  start->focal = std::move(focal);
  return start;
}

}  // namespace camgyro
