#include "estimator/window/sliding_window.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "core/time.h"
#include "estimator/window/estimation_input.h"

namespace camgyro {

namespace {

// Pairs keep the noise that they were given while it is within this share of the present one: what
// they have computed with it stays valid, and no sigma changes by more.
constexpr double kSameNoise = 0.01;

// Once the estimate has settled, pairs keep their linearisation while their residuals change by
// less than this. Before, steps are large, and where little is determined their end depends on
// each.
constexpr double kKeptWithinSigmas = 0.1;

PairGraphOptions Keeping(PairGraphOptions options) {
  options.keep_within_sigmas = 0.0;
  return options;
}

}  // namespace

SlidingWindowOptions WindowOptionsFor(const PairSelection& selection,
                                      SlidingWindowOptions options) {
  if (!selection.far) return options;
  options.window_pairs = options.unsettled_pairs;
  options.unsettled_stride = options.undetermined_stride = 2;
  return options;
}

SlidingWindow::SlidingWindow(const Calibration& start, const Prior& prior, int64_t origin_ns,
                             const SlidingWindowOptions& options)
    : options_(options),
      origin_ns_(origin_ns),
      graph_(start, prior, Keeping(options.graph)),
      noise_scale_(options.graph.residual->facts()),
      noise_px_(options.graph.first_sigma()),
      noise_of_pairs_px_(noise_px_) {
  latest_.estimate = start;
  latest_.noise_px = noise_px_;
}

AddResult SlidingWindow::AddGyroSample(const GyroSample& sample, bool saturated) {
  if (!sample.omega_gyro_rad_s.allFinite()) return AddResult::kNotFinite;
  const double time_s = SecondsSince(origin_ns_, sample.stamp_ns);
  if (!(time_s > last_gyro_time_s_)) return AddResult::kNotIncreasing;
  last_gyro_time_s_ = time_s;
  graph_.AddRate({time_s, sample.omega_gyro_rad_s, saturated});
  ProcessPending();
  return AddResult::kAccepted;
}

AddResult SlidingWindow::AddPair(int64_t stamp_a_ns, int64_t stamp_b_ns, std::vector<Match> matches,
                                 double exposure_a_s, double exposure_b_s) {
  for (const Match& match : matches) {
    if (!match.px_a.allFinite() || !match.px_b.allFinite()) return AddResult::kNotFinite;
  }
  const double time_a_s = SecondsSince(origin_ns_, stamp_a_ns);
  if (stamp_b_ns <= stamp_a_ns || time_a_s < last_pair_time_s_) return AddResult::kNotIncreasing;
  last_pair_time_s_ = time_a_s;
  Pending& next = pending_.emplace_back();
  next.stamp_b_ns = stamp_b_ns;
  next.pair.time_a_s = time_a_s;
  next.pair.time_b_s = SecondsSince(origin_ns_, stamp_b_ns);
  next.pair.exposure_a_s = exposure_a_s;
  next.pair.exposure_b_s = exposure_b_s;
  next.pair.matches = std::move(matches);
  ProcessPending();
  if (pending_.size() > kMaxPending) {  // the gyro is silent
    pending_.pop_front();
    ++num_skipped_;
  }
  return AddResult::kAccepted;
}

void SlidingWindow::ProcessPending() {
  while (!pending_.empty()) {
    Pending& next = pending_.front();
    next.pair.id = next_pair_id_;
    LeaveOutMoving(&next.pair);
    const AddPairResult added = graph_.AddPair(next.pair);
    if (added == AddPairResult::kGyroTooLate) return;
    if (added == AddPairResult::kAdded) {
      ++next_pair_id_;
      ++num_used_;
      Process(next);
    } else {
      ++num_skipped_;
    }
    // A pair to come starts after this one; its delay may still move, but not by a second.
    graph_.ForgetOldRates(next.pair.time_a_s + DelayOf(latest_.estimate, next.pair.first()) - 1.0);
    pending_.pop_front();
  }
}

void SlidingWindow::LeaveOutMoving(TimedPair* pair) {
  if (moving_.empty()) return;
  std::vector<int64_t> here;
  for (const Match& match : pair->matches) {
    const auto track = moving_.find(match.track_id);
    if (track == moving_.end()) continue;
    track->second = pair->id;
    here.push_back(match.track_id);
  }
  std::sort(here.begin(), here.end());
  EraseMatchesOf(here, &pair->matches);
  // Tracks that are gone do not come back.
  for (auto track = moving_.begin(); track != moving_.end();) {
    const bool gone = pair->id - track->second > options_.unsettled_pairs;
    track = gone ? moving_.erase(track) : std::next(track);
  }
}

void SlidingWindow::FindMoving() {
  TrackLeans here;
  for (const auto& entry : leans_) here.Add(entry.second);
  leans_before_.KeepOnly(here);
  TrackLeans all = leans_before_;
  all.Add(here);
  const std::vector<int64_t> moving = MovingTracks(all.All());
  if (moving.empty()) return;
  graph_.LeaveOutTracks(moving);
  for (const int64_t track_id : moving) {
    num_moving_ += moving_.insert_or_assign(track_id, next_pair_id_).second;
  }
}

void SlidingWindow::Process(const Pending& pair) {
  const int stride = num_used_ < options_.unsettled_pairs ? options_.unsettled_stride
                                                          : options_.undetermined_stride;
  if (!settled_ && num_used_ % stride != 0) return;
  if (!settled_) {
    // The estimate still moves: the directions with it.
    graph_.AllResiduals(/*search=*/true);
    UpdateNoise();
  }
  WindowUpdate update;
  if (const Status solved = SolveWindow(pair.pair, &update); !solved) {
    ++num_failed_solves_;
    failure_ = solved.error().message;
    return;
  }
  failure_.clear();
  if (!settled_ && Settled(update.estimate)) {
    settled_ = true;
    graph_.options()->keep_within_sigmas = kKeptWithinSigmas;  // of the pairs to come
  }
  update.frame_stamp_ns = pair.stamp_b_ns;
  update.noise_px = noise_px_;
  update.settled = settled_;
  if (graph_.has_frame_times()) {
    update.frame_offset_s = newest_frame_.offset_s;
    update.frame_offset_sigma_s = newest_frame_.sigma_s;
    update.frame_spread_s = graph_.frame_time_spread_s();
  }
  latest_ = std::move(update);
  if (listener_) listener_(latest_);
  if (options_.graph.robust_threshold > 0.0) FindMoving();

  const int keep =
      settled_ ? options_.window_pairs : options_.unsettled_pairs - options_.undetermined_stride;
  while (graph_.num_pairs() > keep) {
    if (const Status left = graph_.MarginalizeOldest(options_.skew_walk_rtHz); !left) {
      ++num_failed_solves_;
      failure_ = left.error().message;
      return;  // the next window tries again
    }
    leans_before_.Add(leans_.begin()->second);
    leans_.erase(leans_.begin());
  }
}

int SlidingWindow::WalkingSkew() const {
  return options_.skew_walk_rtHz > 0.0 ? graph_.skew_column() : -1;
}

Status SlidingWindow::SolveWindow(const TimedPair& newest, WindowUpdate* update) {
  const int skew = WalkingSkew();
  SolveOptions solve;
  solve.max_iterations = settled_ ? 4 : 10;
  solve.function_tolerance = 1e-4;
  // Hours after the origin, the delay there and the skew are told apart by seconds.
  if (skew >= 0 && settled_) solve.trust_region_radius = 1e14;
  const SolveReport report = graph_.Solve(solve);
  if (!report.usable) return CannotEstimate("the solver failed: " + report.message);
  UpdateNoise();
  Calibration* const estimate = &update->estimate;
  *estimate = graph_.Estimate();
  // Of the last 100 pairs or so.
  cross_fit_ = cross_fit_ * 0.99;
  cross_fit_ += graph_.CrossFitOf(graph_.pair_ids().back());
  const std::optional<FrameTime> at =
      skew >= 0 ? std::optional<FrameTime>(newest.second()) : std::nullopt;
  const Status covariance =
      graph_.EstimateCovariance(/*cluster_s=*/2.0, cross_fit_.inflation(), estimate, at);
  if (!covariance || skew < 0) return covariance;
  estimate->delay_s = FirstDelayOf(*estimate, newest.second());
  update->clock_skew = 1e-6 * estimate->effect_values[skew];
  estimate->effect_values[skew] = 0.0;
  return {};
}

void SlidingWindow::UpdateNoise() {
  std::vector<std::vector<double>> residuals;
  const std::vector<int64_t> ids = graph_.pair_ids();
  for (const int64_t id : ids) {
    leans_[id] = {};
    residuals.push_back(graph_.ResidualsWithLeans(id, &leans_[id]));
  }
  const double here_px = noise_of_pairs_px_ * noise_scale_.Growth(residuals, noise_of_pairs_px_);
  // A settled window holds few pairs: its scale is averaged over time.
  noise_px_ *= settled_ ? std::pow(here_px / noise_px_, 0.1) : here_px / noise_px_;
  if (!settled_ || std::abs(noise_px_ / noise_of_pairs_px_ - 1.0) > kSameNoise) {
    noise_of_pairs_px_ = noise_px_;
    graph_.options()->sigma = noise_px_;
    for (const int64_t id : ids) graph_.SetSigma(id, noise_px_);
  }
  if (graph_.has_frame_times()) UpdateFrameTimes();
}

void SlidingWindow::UpdateFrameTimes() {
  const std::vector<PairTimes> times = graph_.FrameTimes();
  newest_frame_ = OffsetsOf(times, graph_.frame_time_spread_s()).back();
  const Spread here = MostLikelySpread(times);
  const double before_s = graph_.frame_time_spread_s();
  // A window in which the camera rests says nothing of it.
  constexpr double kWithinNoise = 1.0;
  if (TwoLogLikelihood(times, here.value_s) - TwoLogLikelihood(times, before_s) < kWithinNoise) {
    graph_.SetFrameTimeLaw({{before_s, here.sigma_s}, {}});
    return;
  }
  const double change = std::clamp(std::log(here.value_s / before_s), -1.0, 1.0);
  const double share = settled_ ? 0.1 : 1.0;  // as of the noise
  graph_.SetFrameTimeLaw({{before_s * std::exp(share * change), here.sigma_s}, {}});
}

bool SlidingWindow::Settled(const Calibration& estimate) const {
  const StateVector sigma = estimate.sigma();
  return sigma[kStateFocal] < options_.settled_focal * estimate.lens[kFocal] &&
         sigma[kStateReadout] < options_.settled_readout_s &&
         sigma[kStateDelay] < options_.settled_delay_s &&
         sigma.segment<3>(kStateRotation).maxCoeff() < options_.settled_rotation_rad;
}

}  // namespace camgyro
