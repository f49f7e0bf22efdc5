#include "camgyro/online_calibration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/format.h"
#include "core/pair_model.h"
#include "core/time.h"
#include "estimator/astray.h"
#include "estimator/calibrate.h"
#include "estimator/start/focal_scan.h"
#include "estimator/window/estimation_input.h"
#include "frontend/lens_from_matches.h"
#include "frontend/stamp_clock.h"
#include "frontend/track_cleaner.h"
#include "pipeline/run.h"

namespace camgyro {
namespace {

constexpr double kCollectS = 12.0;    // of frames at most, for the start
constexpr double kGyroS = 60.0;       // of samples that may wait for frames
constexpr size_t kMaxGyro = 100'000;  // and their number
constexpr double kBetweenStartsS = 2.0;
constexpr double kSearchS = 2.0;       // half range of delays
constexpr size_t kMaxScanPairs = 120;  // per trial focal length
constexpr size_t kMaxWaiting = 300;    // frames whose gyro samples have not come
constexpr double kGyroMarginS = 0.06;  // of samples beyond a pair, so that the delay can move
constexpr double kSteadyS = 2.0;
constexpr double kStaleS = 5.0;  // frames without a solved window
// Clocks of cameras that warm up change their rate by some 1 ppm in a second, those of flight
// controllers, whose delay grows by 20 to 30 ms in a minute, by some 10 ppm.
constexpr double kSkewWalk_rtHz = 20e-6;
constexpr char kEffects[] = "clock_skew";

// The window would have to know the lens at every sample to come.
tl::unexpected<Error> StabilisedLens() {
  return CannotEstimate("the lens moves as the camera turns: switch its stabilisation off");
}

// For people; empty where what was declared will do.
std::string WhatMatchesShowOfLens(const Recording& recording) {
  if (!recording.faults.empty()) return recording.faults.front().finding;
  if (recording.camera.division_lambda == 0.0) return "";
  return Format(
      "nothing declares the lens' distortion: it moves corners of the picture by %+.0f %%",
      100.0 * recording.camera.division_lambda);
}

// A fit of all that was collected, with the distortion of a lens that nothing declares where it
// leads fits astray: a window without it runs to any focal length. Nothing where the fit leads
// nowhere. Errors: a stabilised lens.
Result<std::optional<Calibration>> FitCollected(const Recording& recording,
                                                const CameraRotationsAt& rotations_at,
                                                const StartResult& start, const Calibration& from) {
  CalibrateOptions options;
  options.effects = kEffects;
  options.given_start = start;
  options.times_between = false;
  Result<CalibrationReport> fit = CalibrateRecording(recording, rotations_at, options);
  if (!fit || !fit->converged) return std::nullopt;
  if (LensFollowsTurns(fit->calibration)) return StabilisedLens();
  const double focal_px = fit->calibration.lens[kFocal];
  if (RanAway(focal_px, from.lens[kFocal]) || IsFarFromRotations(focal_px, fit->start.focal)) {
    return std::nullopt;
  }
  return std::move(fit->calibration);
}

}  // namespace

OnlineCalibration::OnlineCalibration(const CameraGuess& camera, MatchNoise noise, double start_s,
                                     bool repair_stamps,
                                     std::function<void(const Progress&)> listener)
    : camera_(camera),
      noise_(noise),
      start_s_(start_s),
      repair_stamps_(repair_stamps),
      listener_(std::move(listener)) {
  progress_.message = "collecting the first frames";
}

void OnlineCalibration::AddGyro(const GyroSample& sample) {
  gyro_.push_back(sample);
  const double keep_s = window_ ? kGyroS : kCollectS + 2.0 * kSearchS;
  while (gyro_.size() > kMaxGyro ||
         SecondsSince(gyro_.front().stamp_ns, sample.stamp_ns) > keep_s) {
    gyro_.pop_front();
  }
  if (window_) {
    ProcessWaiting();
  } else if (lacks_gyro_ && GyroSpan() >= FrameSpan()) {  // it came after the frames
    Collect();
    listener_(progress_);
  }
}

double OnlineCalibration::GyroSpan() const {
  return gyro_.empty() ? 0.0 : SecondsSince(gyro_.front().stamp_ns, gyro_.back().stamp_ns);
}

double OnlineCalibration::FrameSpan() const {
  return SecondsSince(frames_.front().stamp_ns, frames_.back().stamp_ns);
}

void OnlineCalibration::AddFrame(OnlineFrame frame) {
  ++progress_.frames;
  frames_.push_back(std::move(frame));
  window_ ? ProcessWaiting() : Collect();
  if (window_ && SecondsSince(last_solved_ns_, frames_.back().stamp_ns) > kStaleS) GiveUp();
  listener_(progress_);
}

void OnlineCalibration::Collect() {
  const int64_t newest_ns = frames_.back().stamp_ns;
  while (SecondsSince(frames_.front().stamp_ns, newest_ns) > kCollectS ||
         frames_.size() > 10 * kMaxWaiting) {
    frames_.pop_front();
  }
  lacks_gyro_ = false;
  if (FrameSpan() < start_s_) {
    if (progress_.starts == 0) {
      progress_.message =
          Format("collecting the first frames: %.1f of %.1f s", FrameSpan(), start_s_);
    }
    return;
  }
  if (newest_ns < next_start_ns_) return;
  lacks_gyro_ = GyroSpan() < 0.5 * FrameSpan();
  if (lacks_gyro_) {
    progress_.message = "there are frames, but hardly any gyro samples";
    return;
  }
  ++progress_.starts;
  next_start_ns_ = StampAt(newest_ns, kBetweenStartsS);
  if (const Status started = TryStart(); !started) {
    progress_.message = started.error().message;
    return;
  }
  progress_.message = "estimating";
  progress_.estimating = true;
  last_solved_ns_ = frames_.back().stamp_ns;
  ProcessWaiting();
}

Status OnlineCalibration::TryStart() {
  Recording recording;
  recording.camera = camera_;
  recording.match_noise = noise_;
  recording.gyro.assign(gyro_.begin(), gyro_.end());
  std::vector<int64_t> stamps_ns;
  for (const OnlineFrame& frame : frames_) {
    recording.frames.emplace_back().stamp_ns = frame.stamp_ns;
    recording.tracks.push_back(frame.points);
    stamps_ns.push_back(frame.stamp_ns);
  }
  recording.camera_stamps = FindStampClock(stamps_ns).report;
  StampReport& stamps = *recording.camera_stamps;
  stamps.repaired = repair_stamps_ && stamps.kind == StampKind::kArrival;
  progress_.frame_stamps = stamps;
  TakeLensFromMatches(&recording);
  progress_.lens = WhatMatchesShowOfLens(recording);
  StartOptions options;
  options.search_s = kSearchS;
  const CameraRotationsAt rotations_at = RotationsFrom(recording, kMaxScanPairs);
  const Result<StartResult> start = FindStartAndFocal(recording, rotations_at, options, {});
  if (!start) return tl::unexpected(start.error());
  if (start->stabiliser && start->stabiliser->follows_turns) return StabilisedLens();

  GapLimits limits = kGapLimitsOnline;
  limits.least_pairs = 10;
  const PairSelection selection = SelectPairs(recording, limits);
  gap_ = selection.gap;

  Result<StartingPoint> point = MakeStartingPoint(recording, *start, kEffects, ByPlane());
  if (!point) return tl::unexpected(point.error());
  auto fit = FitCollected(recording, rotations_at, *start, point->estimate);
  if (!fit) return tl::unexpected(fit.error());
  if (*fit) point->estimate = **std::move(fit);
  progress_.prior_sigma = point->prior.sigma;
  SlidingWindowOptions window_options = WindowOptionsFor(selection);
  window_options.graph = GraphOptionsFor(recording, *start, window_options.graph);
  window_options.skew_walk_rtHz = kSkewWalk_rtHz;
  window_.emplace(point->estimate, point->prior, gyro_.front().stamp_ns, window_options);
  window_->SetListener([this](const WindowUpdate& update) { Remember(update); });
  history_.clear();
  return {};
}

void OnlineCalibration::ProcessWaiting() {
  // Side by side, and without a common observation; see SelectPairs and kPairsInStep.
  for (;;) {
    const bool loses_step =
        PairsLoseTheirStep(progress_.frame_stamps) && (pairs_begun_ + 1) % kPairsInStep == 0;
    const size_t between = gap_ == 1 ? 0 : loses_step ? 2 : 1;
    if (frames_.size() <= static_cast<size_t>(gap_) + between) break;
    const size_t gap = NextGap();
    if (!AddPair(frames_[0], frames_[gap])) {
      if (frames_.size() <= kMaxWaiting) break;
      ++skipped_here_;
    }
    ++pairs_begun_;
    frames_.erase(frames_.begin(), frames_.begin() + static_cast<std::ptrdiff_t>(gap + between));
  }
  progress_.message = window_->failure().empty() ? "estimating" : window_->failure();
  progress_.pairs_used = used_before_ + static_cast<uint64_t>(window_->num_used_pairs());
  progress_.pairs_skipped =
      skipped_before_ + skipped_here_ + static_cast<uint64_t>(window_->num_skipped_pairs());
}

// The longest gap that keeps its matches: the motion may be faster than when the gap was chosen.
size_t OnlineCalibration::NextGap() const {
  const auto gap = static_cast<size_t>(gap_);
  const auto matches = [&](size_t to) {
    return static_cast<double>(MatchesBetween(frames_[0].points, frames_[to].points).size());
  };
  for (size_t shorter = gap; shorter > 1; --shorter) {
    if (matches(shorter) >= kLeastMatchesOfGap * matches(1)) return shorter;
  }
  return 1;
}

// False if the gyro has not come so far.
bool OnlineCalibration::AddPair(const OnlineFrame& a, const OnlineFrame& b) {
  const Calibration& estimate = window_->latest().estimate;
  const int64_t needed_ns =
      StampAt(b.stamp_ns, estimate.delay_s + std::max(0.0, estimate.readout_s) +
                              std::max(0.0, ColumnReadoutOf(estimate)) + kGyroMarginS);
  if (gyro_.empty() || gyro_.back().stamp_ns < needed_ns) return false;
  while (!gyro_.empty() && gyro_.front().stamp_ns <= needed_ns) {
    // Refused is what differs from its neighbour by less than a double tells: nothing is lost.
    (void)window_->AddGyroSample(gyro_.front());
    gyro_.pop_front();
  }
  if (window_->AddPair(a.stamp_ns, b.stamp_ns, MatchesBetween(a.points, b.points)) !=
      camgyro::AddResult::kAccepted) {
    ++skipped_here_;
  }
  return true;
}

void OnlineCalibration::Remember(const WindowUpdate& update) {
  last_solved_ns_ = std::max(last_solved_ns_, update.frame_stamp_ns);
  progress_.estimate = update.estimate;
  progress_.frame_stamp_ns = update.frame_stamp_ns;
  progress_.noise_px = update.noise_px;
  progress_.clock_skew = update.clock_skew;
  progress_.frame_offset_s = update.frame_offset_s;
  progress_.frame_offset_sigma_s = update.frame_offset_sigma_s;
  progress_.frame_spread_s = update.frame_spread_s;
  history_.emplace_back(update.frame_stamp_ns, update.estimate);
  while (history_.size() > 2 &&
         SecondsSince(history_[1].first, update.frame_stamp_ns) >= kSteadyS) {
    history_.pop_front();
  }
  progress_.movement.setConstant(std::numeric_limits<double>::infinity());
  if (SecondsSince(history_.front().first, update.frame_stamp_ns) >= kSteadyS) {
    progress_.movement.setZero();
    for (const auto& [stamp_ns, then] : history_) {
      progress_.movement =
          progress_.movement.cwiseMax(Difference(update.estimate, then).cwiseAbs());
    }
  }
  listener_(progress_);
}

// The window has lost its way, or the gyro is gone: back to the search for a start.
void OnlineCalibration::GiveUp() {
  used_before_ += static_cast<uint64_t>(window_->num_used_pairs());
  skipped_before_ += static_cast<uint64_t>(window_->num_skipped_pairs());
  window_.reset();
  progress_.estimating = false;
  progress_.estimate.reset();
  progress_.movement.setConstant(std::numeric_limits<double>::infinity());
  progress_.message = "the estimate was given up: no frame could be used for 5 s";
  // What was fed to the window is gone; a start needs gyro and frames of the same time.
  const OnlineFrame newest = std::move(frames_.back());
  frames_.clear();
  frames_.push_back(newest);
}

}  // namespace camgyro
