#include "estimator/start/focal_scan.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/robust_statistics.h"
#include "core/time.h"
#include "core/usual_focal.h"
#include "estimator/start/clock_rate.h"
#include "estimator/start/lag_search.h"
#include "estimator/start/rate_alignment.h"
#include "estimator/start/scan_curve.h"
#include "estimator/start/stabiliser_search.h"
#include "estimator/start/start_fit.h"

namespace camgyro {
namespace {

constexpr double kMedianNorm2 = 1.177;  // median norm of 2 normal variables of sigma 1
constexpr double kDistinctLog = 0.22;   // 25 %
constexpr double kMaxRunnerUp = 0.8;    // a wrong lens moves shallow minima far
constexpr double kModelLog = 0.02;      // a lens that nothing declares bends it further
constexpr double kUnknownLog = 0.3;     // what is known of any lens
// Directions of the orientation that a motion determines which tells a focal length: one about a
// single axis of the picture determines two.
constexpr int kLeastAxes = 2;
// Of the frame interval: the largest sigma of what is told.
constexpr double kDeterminedReadout = 0.15;
constexpr double kModelReadout = 0.05;   // the loss is no parabola (docs/lab/start.md)
constexpr double kLeastMatches = 15.0;   // of a pair that has a rotation
constexpr double kLooseRateRatio = 4.5;  // the whole scan may be off by this
constexpr int kScannedOn = 2;            // points at a time, beyond the end of a scan
constexpr double kTeleOverlap = 1.2;     // of the scans: a minimum at the end of one is none

// Residuals of pan and tilt at one point [px/s], with lag, orientation and bias fitted to it. In
// the image (angle times focal length), where the camera's noise does not depend on the focal
// length assumed: in angles, a longer focal length would always shrink it, and win.
void MeasureAngles(const Recording& recording, const StartResult& near, double lag_s,
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
  std::vector<double> norms;
  for (int i = 0; i < cam.size(); ++i) {
    if (!covered[i]) continue;
    const Eigen::Vector3d gyro_rate_cam =
        fit.q_gyro_cam.conjugate() * (rates.col(i) - fit.bias_gyro_rad_s);
    const double scale = point->trial.focal_px * std::sqrt(cam.weight[i]);
    norms.push_back(scale * (cam.omega_cam_rad_s.col(i) - gyro_rate_cam).head<2>().norm());
    point->squares.push_back(norms.back() * norms.back());
    point->blocks.push_back(cam.frame_a[i] * kScanBlocks / frames);
    point->gyro_power += cam.weight[i] * gyro_rate_cam.head<2>().squaredNorm();
  }
  point->noise = MedianInPlace(&norms) / kMedianNorm2;
}

// What the matches of each pair leave at one point [px], whatever its rotation.
void MeasureMatches(const Recording& recording, ScanPoint* point) {
  const int frames = static_cast<int>(recording.frames.size());
  for (const CameraRotation& rotation : point->rotations) {
    point->squares.push_back(rotation.residual_px * rotation.residual_px);
    point->blocks.push_back(rotation.frame_a * kScanBlocks / frames);
  }
  std::vector<double> squares = point->squares;
  if (!squares.empty()) point->noise = std::sqrt(MedianInPlace(&squares));
}

// The scans, step by step.
class FocalScan {
 public:
  FocalScan(const Recording& recording, const CameraRotationsAt& rotations_at,
            const StartOptions& options, const FocalScanOptions& scan_options)
      : recording_(recording),
        rotations_at_(rotations_at),
        options_(options),
        scan_options_(scan_options),
        log_guess_(std::log(FocalToBeginWith(recording.camera))),
        spacing_(std::log(scan_options.max_focal / scan_options.min_focal) /
                 (scan_options.points - 1)),
        interval_s_(UsualInterval(recording)) {}

  // Delay and orientation, to which a wrong focal length is mostly a scale: from the focal lengths
  // nearest to the guess outwards, the first that works.
  Status FindNear() {
    std::vector<double> logs = LogFocals();
    std::stable_sort(logs.begin(), logs.end(), [&](double a, double b) {
      return std::abs(a - log_guess_) < std::abs(b - log_guess_);
    });
    const Status first = FindNearAt({logs.front()});
    return first || FindNearAt({logs.begin() + 1, logs.end()}) ? Status() : first;
  }

  // The same from the focal length that explains most of the gyro's motion, if more than so much.
  Status FindBestNear(double explained) { return FindNearAt(LogFocals(), explained); }

  // How much of the gyro's motion is explained by rotations that know nothing of it; 0 where
  // nothing was found near.
  double explained() const { return near_.explained; }

  // The start, from what was found near it.
  Result<StartResult> Refine() {
    StartReadout readout{recording_.camera.readout_s.value_or(0.0), 0.0, true};
    ScanFocals(/*step=*/2);
    Improve();
    if (!recording_.camera.readout_s) readout = ScanReadouts();
    StartFocal focal = ScanFocals(/*step=*/1);
    auto start = StartAt(focal.value_px);
    // Pan and tilt tell the focal length where the motion tells which of the gyro's they are.
    if (start && focal.determined && start->rotation_axes_determined < kLeastAxes) {
      LeaveOpen(&focal);
      start = StartAt(focal.value_px);
    }
    if (!start) return start;
    start->focal = std::move(focal);
    start->readout = readout;
    return start;
  }

 private:
  // The focal length, by the parabola around the best of all, or of every `step`-th.
  StartFocal ScanFocals(size_t step) {
    std::vector<double> logs;
    for (size_t k = 0; k < LogFocals().size(); k += step) logs.push_back(LogFocals()[k]);
    // The inverse of what FindStart makes of a lag.
    const double lag_s =
        (near_.delay_middle_row_s -
         SecondsSince(recording_.frames.front().stamp_ns, recording_.gyro.front().stamp_ns)) *
        (1.0 + near_.clock_skew);
    const ScanCurve curve = Scan(
        logs, static_cast<double>(step) * spacing_, LogLongest(), /*means_of=*/1.0,
        [this](double x) {
          return RotationTrial{std::exp(x), rough_};
        },
        [&](ScanPoint* point) { MeasureAngles(recording_, near_, lag_s, options_, point); });
    const double best_px = curve.Best().trial.focal_px;
    StartFocal focal;
    for (const ScanPoint& point : curve.points()) {
      focal.curve.push_back(
          {point.trial.focal_px, point.loss.sum() / (curve.gyro_power() * best_px * best_px)});
    }
    focal.runner_up_ratio = curve.RunnerUpRatio(kDistinctLog);
    const auto [log_focal, spread_log] = curve.Minimum();
    const double sigma_log = std::hypot(spread_log, kModelLog);
    focal.determined = sigma_log < StartFocal::kDetermined && focal.runner_up_ratio < kMaxRunnerUp;
    best_focal_px_ = std::exp(log_focal);
    focal.value_px = std::exp(log_focal);
    focal.sigma_px = sigma_log * focal.value_px;
    if (!focal.determined) LeaveOpen(&focal);
    return focal;
  }

  void LeaveOpen(StartFocal* focal) const {
    focal->determined = false;
    focal->value_px = std::exp(log_guess_);
    focal->sigma_px = kUnknownLog * focal->value_px;
  }

  // The alignment anew, from rotations at the best focal length that are made with the last one.
  //
  // These are near the gyro's, and so follow a bias that is wrong: of a camera that steps sideways
  // all the time, past walls of one distance, the step may have been taken for a turn. Most gyros
  // have little bias, and where the matches of two pictures fit each other distinctly better with
  // none, the rotations are made with none.
  void Improve() {
    std::vector<RotationTrial> trials(2, {best_focal_px_, rough_});
    trials[1].rough->bias_gyro_rad_s.setZero();
    std::vector<ScanPoint> points(2);
    std::vector<std::vector<CameraRotation>> rotations = rotations_at_(recording_, trials);
    for (size_t k = 0; k < points.size(); ++k) {
      points[k].x = static_cast<double>(k);
      points[k].rotations = std::move(rotations[k]);
      MeasureMatches(recording_, &points[k]);
    }
    const ScanCurve curve(std::move(points), /*spacing=*/1.0, kLeastMatches);
    const bool distinct = curve.RunnerUpRatio(/*distance=*/0.5) < kMaxRunnerUp;
    StartOptions loose = options_;
    loose.max_rate_ratio = kLooseRateRatio;
    Result<StartResult> better =
        FindStart(recording_, (distinct ? curve.Best() : curve.points().front()).rotations, loose);
    if (!better) return;
    near_ = std::move(*better);
    rough_ = RoughlyAligned(near_, rough_.readout_s);
  }

  // The readout time at the best focal length, likewise: the one with which the matches of two
  // pictures fit each other best. (Their rotations and the gyro's tell less:
  // docs/lab/start.md.) What it finds, the next rotations are made with.
  StartReadout ScanReadouts() {
    const int count = scan_options_.readouts;
    const double spacing = 2.0 * scan_options_.max_readout / (count - 1);
    std::vector<double> parts;
    for (int k = 0; k < count; ++k) parts.push_back(spacing * k - scan_options_.max_readout);
    const ScanCurve curve = Scan(
        parts, spacing, parts.back(), kLeastMatches,
        [this](double part) {
          RotationTrial trial{best_focal_px_, rough_};
          trial.rough->readout_s = part * interval_s_;
          return trial;
        },
        [this](ScanPoint* point) { MeasureMatches(recording_, point); });
    StartReadout readout = UsualReadout(recording_);
    auto [part, sigma] = curve.Minimum();
    sigma = std::hypot(sigma, kModelReadout);
    readout.determined =
        sigma < kDeterminedReadout && curve.RunnerUpRatio(1.5 * spacing) < kMaxRunnerUp;
    if (readout.determined) {
      readout.value_s = part * interval_s_;
      readout.sigma_s = sigma * interval_s_;
    }
    rough_.readout_s = readout.value_s;
    return readout;
  }

  // The start at a focal length.
  Result<StartResult> StartAt(double focal_px) const {
    return FindStart(recording_, rotations_at_(recording_, {{focal_px, rough_}}).front(), options_);
  }

  std::vector<double> LogFocals() const {
    const CameraGuess& camera = recording_.camera;
    const double log_min =
        std::log(scan_options_.min_focal * std::max(camera.width_px, camera.height_px));
    std::vector<double> logs;
    for (int k = 0; k < scan_options_.points; ++k) logs.push_back(log_min + spacing_ * k);
    return logs;
  }

  double LogLongest() const {
    return LogFocals().front() + std::log(scan_options_.longest_focal / scan_options_.min_focal);
  }

  // The first start that works, without knowing anything of the gyro, or the one that explains
  // most, if more than `explained`; else why the first did not work.
  Status FindNearAt(const std::vector<double>& log_focals, std::optional<double> explained = {}) {
    StartOptions loose = options_;
    loose.max_rate_ratio = kLooseRateRatio;
    std::vector<RotationTrial> trials;
    for (const double log_focal : log_focals) trials.push_back({std::exp(log_focal), std::nullopt});
    Status found = CannotEstimate("");
    const auto rotations = rotations_at_(recording_, trials);
    for (size_t k = 0; k < trials.size() && (explained || !found); ++k) {
      Result<StartResult> near = FindStart(recording_, rotations[k], loose);
      if (!near && k == 0) found = tl::unexpected<Error>(near.error());
      if (!near || (explained && near->explained <= *explained)) continue;
      if (explained) explained = near->explained;
      near_ = std::move(*near);
      rough_ = RoughlyAligned(
          near_, recording_.camera.readout_s.value_or(UsualReadout(recording_).value_s));
      found = {};
    }
    return found;
  }

  // The losses at all values, beyond them up to `farthest` while the last is the best, and at two
  // more around the best of all.
  template <typename MakeTrial, typename Measure>
  ScanCurve Scan(const std::vector<double>& values, double spacing, double farthest,
                 double means_of, const MakeTrial& trial_at, const Measure& measure) const {
    const auto measure_all = [&](const std::vector<double>& xs) {
      std::vector<RotationTrial> trials;
      for (const double x : xs) trials.push_back(trial_at(x));
      std::vector<std::vector<CameraRotation>> rotations = rotations_at_(recording_, trials);
      std::vector<ScanPoint> points(xs.size());
      for (size_t k = 0; k < points.size(); ++k) {
        points[k].x = xs[k];
        points[k].trial = trials[k];
        points[k].rotations = std::move(rotations[k]);
        measure(&points[k]);
      }
      return points;
    };
    std::vector<ScanPoint> points;
    const auto add = [&](const std::vector<double>& xs) {
      for (ScanPoint& point : measure_all(xs)) points.push_back(std::move(point));
      return ScanCurve(points, spacing, means_of).Best().x;
    };
    double last = values.back();
    double best = add(values);
    while (best == last && last + kScannedOn * spacing <= farthest) {
      std::vector<double> beyond;
      for (int k = 0; k < kScannedOn; ++k) beyond.push_back(last += spacing);
      best = add(beyond);
    }
    add({best - 0.5 * spacing, best + 0.5 * spacing});
    return ScanCurve(std::move(points), spacing, means_of);
  }

  const Recording& recording_;
  const CameraRotationsAt& rotations_at_;
  const StartOptions& options_;
  const FocalScanOptions& scan_options_;
  const double log_guess_, spacing_, interval_s_;
  StartResult near_;
  RoughAlignment rough_;  // of near_, and the readout time as it is known so far
  double best_focal_px_ = 0.0;
};

// The start through a usual lens, or through a tele lens where that explains more.
Result<StartResult> ScanUsualAndTele(const Recording& recording,
                                     const CameraRotationsAt& rotations_at,
                                     const StartOptions& options,
                                     const FocalScanOptions& scan_options) {
  FocalScan usual(recording, rotations_at, options, scan_options);
  const Status near = usual.FindNear();
  const double near_explained = usual.explained();
  Result<StartResult> start = near ? usual.Refine() : tl::unexpected(near.error());
  if (start && start->explained >= kWellExplained) return start;
  // Through a tele lens, a usual focal length makes pan and tilt several times too large, but not
  // roll. What fits the gyro best then has little to do with how it lies, and rotations that are
  // made near to that fit the gyro's best at the shortest focal lengths. A longer one is tried that
  // explains distinctly more, by rotations that are not made near to anything.
  FocalScanOptions longer = scan_options;
  longer.min_focal = scan_options.max_focal / kTeleOverlap;
  longer.max_focal = scan_options.longest_focal;
  if (!(longer.max_focal > longer.min_focal)) return start;
  FocalScan tele(recording, rotations_at, options, longer);
  if (!tele.FindBestNear(1.0 - kMaxRunnerUp * (1.0 - near_explained))) return start;
  Result<StartResult> better = tele.Refine();
  return better && (!start || better->explained > start->explained) ? better : start;
}

}  // namespace

Result<StartResult> FindStartAndFocal(const Recording& recording,
                                      const CameraRotationsAt& rotations_at,
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
  if (scan_options.readouts < 5 || !(scan_options.max_readout > 0.0)) {
    return BadUsage("readout scan: expected 5 points or more and 0 < max_readout");
  }
  Result<StartResult> start = ScanUsualAndTele(recording, rotations_at, options, scan_options);
  if (!start) return start;
  if (recording.lens_shift.empty()) LookForStabiliser(recording, rotations_at, &*start);
  if (!start->focal->determined) {
    start->notes.push_back(
        "the focal length is not determined (too little pan and tilt, or a distorting lens); " +
        std::string(recording.camera.focal_px ? "the recording's guess" : "a usual one") +
        " is used");
  }
  return start;
}

Result<StartResult> FindStartFromPictures(const Recording& recording,
                                          const CameraRotationsAt& rotations_at,
                                          const StartOptions& options,
                                          const FocalScanOptions& scan) {
  const Result<StartResult> scanned = FindStartAndFocal(recording, rotations_at, options, scan);
  if (scanned || scanned.error().kind != ErrorKind::kCannotEstimate) return scanned;
  Result<StartResult> best = scanned;
  for (const double focal : {0.55, 0.65, 0.8, 1.0}) {  // of the picture's width
    const RotationTrial trial{focal * recording.camera.width_px, std::nullopt};
    const Result<StartResult> start =
        FindStart(recording, rotations_at(recording, {trial}).front(), options);
    if (start && (!best || start->explained > best->explained)) best = start;
  }
  if (best) {
    best->notes.push_back("no focal length could be found for the start: a usual one is used");
  }
  return best;
}

}  // namespace camgyro
