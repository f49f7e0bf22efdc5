#include "camgyro/worker.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <utility>

#include "camgyro/convert.h"
#include "camgyro/snapshot.h"
#include "camgyro/stream_checks.h"
#include "core/time.h"
#include "estimator/vins/initialise.h"
#include "frontend/stamp_clock.h"

namespace camgyro::api {
namespace {

constexpr std::int64_t kFirstCutId = std::int64_t{1} << 40;  // the tracker counts from 0
constexpr std::size_t kMaxSamplesWaiting = 200'000;
constexpr double kLateS = 10.0;  // a frame this far behind the gyro is of no use any more

}  // namespace

Calibrator::Worker::Worker(const CalibratorOptions& options, const camgyro::CameraGuess& camera)
    : options_(options),
      camera_(camera),
      cleaner_(camera.width_px, camera.height_px, kFirstCutId),
      total_(camera, FromApi(options.device)) {
  auto first = std::make_shared<Snapshot>();
  first->message = "collecting the first frames";
  std::atomic_store(&snapshot_, std::shared_ptr<const Snapshot>(first));
  thread_ = std::thread([this] { Run(); });
}

Calibrator::Worker::~Worker() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

AddResult Calibrator::Worker::AddGyro(const GyroSample& sample) {
  if (const auto bad = CheckSample(sample)) return *bad;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (stopped_) return AddResult::kStopped;
  if (const auto bad = CheckOrder(sample.stamp_ns, last_gyro_ns_)) return *bad;
  if (gyro_in_.size() >= kMaxSamplesWaiting) return AddResult::kQueueFull;
  last_gyro_ns_ = sample.stamp_ns;
  gyro_in_.push_back(sample);
  wake_.notify_one();
  return AddResult::kAccepted;
}

AddResult Calibrator::Worker::AddAccel(const AccelSample& sample) {
  if (const auto bad = CheckSample(sample)) return *bad;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (stopped_) return AddResult::kStopped;
  if (const auto bad = CheckOrder(sample.stamp_ns, last_accel_ns_)) return *bad;
  last_accel_ns_ = sample.stamp_ns;
  recent_.Add(sample);
  return AddResult::kAccepted;
}

AddResult Calibrator::Worker::AddImage(std::int64_t stamp_ns, const ImageView& view) {
  if (const auto bad = CheckImage(stamp_ns, view, camera_)) return *bad;
  if (const auto bad = CheckFrame(stamp_ns, MatchNoise::kSecondImage)) return *bad;
  // The view is not written to: cv::Mat has no const form.
  const cv::Mat image(view.height_px, view.width_px, CV_8UC1,
                      const_cast<std::uint8_t*>(view.pixels), view.stride_bytes);
  return Queue({stamp_ns, image.clone(), {}});
}

AddResult Calibrator::Worker::AddTracks(std::int64_t stamp_ns, const TrackPoint* points,
                                        std::size_t count) {
  FrameIn frame;
  frame.stamp_ns = stamp_ns;
  if (const auto bad = TakePoints(stamp_ns, points, count, camera_, &frame.points)) return *bad;
  if (const auto bad = CheckFrame(stamp_ns, MatchNoise::kBothImages)) return *bad;
  return Queue(std::move(frame));
}

VinsStart Calibrator::Worker::InitialiseVins(const VinsSettings& settings) const {
  const Result<VinsOptions> options = FromApi(settings);
  if (!options) return ToApi(Result<camgyro::VinsStart>(tl::unexpected(options.error())));
  VinsInput input;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!latest_) {
      VinsStart none;
      none.explanation = "there is no calibration yet";
      return none;
    }
    input.calibration = *latest_;
    recent_.CopyTo(settings.window_s, &input);
  }
  return ToApi(camgyro::InitialiseVins(input, *options));
}

bool Calibrator::Worker::WaitUntilIdle(double timeout_s) const {
  std::unique_lock<std::mutex> lock(mutex_);
  return idle_.wait_for(lock, std::chrono::duration<double>(std::clamp(timeout_s, 0.0, 1e6)), [&] {
    return stopped_ || (gyro_in_.empty() && frames_in_.empty() && !busy_);
  });
}

std::optional<AddResult> Calibrator::Worker::CheckFrame(std::int64_t stamp_ns, MatchNoise noise) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (stopped_) return AddResult::kStopped;
  if (noise_ && *noise_ != noise) return AddResult::kOutOfRange;
  if (const auto bad = CheckOrder(stamp_ns, last_frame_ns_)) return *bad;
  if (latest_ && last_gyro_ns_ &&
      SecondsSince(stamp_ns, *last_gyro_ns_) - latest_->delay_s > kLateS) {
    return AddResult::kTooLate;
  }
  noise_ = noise;
  if (frames_in_.size() >= options_.max_frames_waiting) {
    last_frame_ns_ = stamp_ns;
    ++dropped_;
    return AddResult::kQueueFull;
  }
  return std::nullopt;
}

AddResult Calibrator::Worker::Queue(FrameIn frame) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_frame_ns_ = frame.stamp_ns;
  frames_in_.push_back(std::move(frame));
  wake_.notify_one();
  return AddResult::kAccepted;
}

void Calibrator::Worker::Run() {
  std::string reason;
  try {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      wake_.wait(lock, [&] { return stop_ || !gyro_in_.empty() || !frames_in_.empty(); });
      if (stop_) return;
      TakeAndProcess(&lock);
    }
  } catch (const std::exception& error) {
    reason = error.what();
  } catch (...) {
    reason = "unknown";
  }
  Stop("stopped by an error: " + reason);
}

// All samples that wait and one frame; without the lock while they are processed.
void Calibrator::Worker::TakeAndProcess(std::unique_lock<std::mutex>* lock) {
  busy_ = true;
  std::vector<GyroSample> gyro;
  gyro.swap(gyro_in_);
  std::optional<FrameIn> frame;
  if (!frames_in_.empty()) {
    frame = std::move(frames_in_.front());
    frames_in_.pop_front();
  }
  const MatchNoise noise = noise_.value_or(MatchNoise::kBothImages);
  lock->unlock();
  Process(gyro, frame ? &*frame : nullptr, noise);
  lock->lock();
  busy_ = false;
  if (gyro_in_.empty() && frames_in_.empty()) idle_.notify_all();
}

// Puts the samples on their clock, if they are not, and keeps the latest.
std::vector<GyroSample> Calibrator::Worker::TakeGyro(const std::vector<GyroSample>& recorded) {
  std::vector<GyroSample> gyro;
  if (options_.stamps == Stamps::kRecorded) {
    gyro = recorded;
  } else {
    for (const GyroSample& sample : recorded) clock_.Add(sample, &gyro);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  recent_.Add(gyro);
  return gyro;
}

void Calibrator::Worker::Process(const std::vector<GyroSample>& recorded, FrameIn* frame,
                                 MatchNoise noise) {
  const std::vector<GyroSample> gyro = TakeGyro(recorded);
  if (!online_ && frame != nullptr) {
    online_.emplace(camera_, noise, options_.start_s, options_.stamps == Stamps::kAuto,
                    [this](const OnlineCalibration::Progress& progress) { Publish(progress); });
    for (const GyroSample& sample : early_gyro_) online_->AddGyro(sample);
    early_gyro_.clear();
  }
  for (const GyroSample& sample : gyro) {
    if (online_) {
      online_->AddGyro(sample);
    } else {
      early_gyro_.push_back(sample);
      Trim(&early_gyro_, kRecentSamplesS, kMaxRecentSamples);
    }
  }
  if (frame == nullptr) return;
  std::optional<OnlineFrame> known = WithoutWrongPoints(frame);
  if (!known) return Publish(online_->progress());
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    recent_.Add(*known);
  }
  online_->AddFrame(*std::move(known));
}

std::optional<OnlineFrame> Calibrator::Worker::WithoutWrongPoints(FrameIn* frame) {
  if (!frame->image.empty()) {
    return OnlineFrame{frame->stamp_ns, cleaner_.Add(tracker_.Add(frame->image))};
  }
  held_stamps_ns_.push_back(frame->stamp_ns);
  std::optional<std::vector<TrackedPoint>> points = jumps_.Add(std::move(frame->points));
  if (!points) return std::nullopt;
  const std::int64_t stamp_ns = held_stamps_ns_.front();
  held_stamps_ns_.pop_front();
  return OnlineFrame{stamp_ns, *std::move(points)};
}

// Not before it can make the estimate ready: at a poor estimate, derivatives say little.
void Calibrator::Worker::RenewTotal(const OnlineCalibration::Progress& progress) {
  if (!progress.estimate) return total_.Forget();
  if (!total_.Due(progress.frame_stamp_ns) || !ReadyButForTotal(progress, options_)) return;
  VinsInput latest;
  latest.calibration = *progress.estimate;
  MatchNoise noise;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    recent_.CopyTo(kRecentFramesS, &latest);
    noise = noise_.value_or(MatchNoise::kBothImages);
  }
  total_.Renew(latest, noise, progress);
}

void Calibrator::Worker::Publish(const OnlineCalibration::Progress& of_noise) {
  RenewTotal(of_noise);
  OnlineCalibration::Progress progress = of_noise;
  total_.AddTo(&progress);
  auto next = std::make_shared<Snapshot>(MakeSnapshot(progress, options_));
  next->doubt = total_.doubt();
  next->frames += held_stamps_ns_.size();
  next->wrong_ratio = jumps_.jumps().wrong_ratio();
  if (clock_.report()) next->gyro_stamps = DescribeStamps(*clock_.report());
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    latest_ = progress.estimate;
    next->frames_dropped = dropped_;
  }
  std::atomic_store(&snapshot_, std::shared_ptr<const Snapshot>(std::move(next)));
}

void Calibrator::Worker::Stop(const std::string& message) noexcept {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
    busy_ = false;
  }
  try {
    auto next = std::make_shared<Snapshot>(*snapshot());
    next->stage = Stage::kStopped;
    next->message = message;
    std::atomic_store(&snapshot_, std::shared_ptr<const Snapshot>(std::move(next)));
  } catch (...) {  // out of memory: the last snapshot stays, and adding answers kStopped
  }
  idle_.notify_all();
}

}  // namespace camgyro::api
