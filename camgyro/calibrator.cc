#include "camgyro/calibrator.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "camgyro/convert.h"
#include "camgyro/online_calibration.h"
#include "core/time.h"
#include "estimator/vins/initialise.h"
#include "frontend/stamp_clock.h"
#include "frontend/streaming_clock.h"
#include "frontend/track_cleaner.h"
#include "frontend/tracker.h"

namespace camgyro::api {
namespace {

constexpr std::int64_t kLargestStamp = 4'000'000'000'000'000'000;  // differences fit in int64
constexpr double kMaxRate = 200.0, kMaxForce = 2000.0;
constexpr std::size_t kMaxPoints = 5000;
constexpr std::int64_t kFirstCutId = std::int64_t{1} << 40;  // the tracker counts from 0
constexpr std::size_t kMaxSamplesWaiting = 200'000;
constexpr double kLateS = 10.0;  // a frame this far behind the gyro is of no use any more
// What InitialiseVins may look back on.
constexpr double kRecentFramesS = 12.0, kRecentSamplesS = 20.0;
constexpr std::size_t kMaxRecentFrames = 2000, kMaxRecentSamples = 50'000;

template <typename Sample>
void Trim(std::deque<Sample>* samples, double keep_s, std::size_t keep) {
  while (samples->size() > keep ||
         SecondsSince(samples->front().stamp_ns, samples->back().stamp_ns) > keep_s) {
    samples->pop_front();
  }
}

struct FrameIn {
  std::int64_t stamp_ns = 0;
  cv::Mat image;                     // a copy; empty with tracks
  std::vector<TrackedPoint> points;  // by ascending id
};

}  // namespace

class Calibrator::Worker {
 public:
  Worker(const CalibratorOptions& options, const camgyro::CameraGuess& camera)
      : options_(options),
        camera_(camera),
        cleaner_(camera.width_px, camera.height_px, kFirstCutId) {
    auto first = std::make_shared<Snapshot>();
    first->message = "collecting the first frames";
    std::atomic_store(&snapshot_, std::shared_ptr<const Snapshot>(first));
    thread_ = std::thread([this] { Run(); });
  }

  ~Worker() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }

  AddResult AddGyro(const GyroSample& sample) {
    if (const auto bad = Check(sample.stamp_ns, sample.omega_gyro_rad_s, kMaxRate)) return *bad;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopped_) return AddResult::kStopped;
    if (const auto bad = CheckOrder(sample.stamp_ns, last_gyro_ns_)) return *bad;
    if (gyro_in_.size() >= kMaxSamplesWaiting) return AddResult::kQueueFull;
    last_gyro_ns_ = sample.stamp_ns;
    gyro_in_.push_back(sample);
    wake_.notify_one();
    return AddResult::kAccepted;
  }

  AddResult AddAccel(const AccelSample& sample) {
    if (const auto bad = Check(sample.stamp_ns, sample.accel_gyro_m_s2, kMaxForce)) return *bad;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopped_) return AddResult::kStopped;
    if (const auto bad = CheckOrder(sample.stamp_ns, last_accel_ns_)) return *bad;
    last_accel_ns_ = sample.stamp_ns;
    recent_accel_.push_back(sample);
    Trim(&recent_accel_, kRecentSamplesS, kMaxRecentSamples);
    return AddResult::kAccepted;
  }

  AddResult AddImage(std::int64_t stamp_ns, const ImageView& view) {
    if (std::abs(stamp_ns) >= kLargestStamp) return AddResult::kOutOfRange;
    if (view.pixels == nullptr || view.width_px != camera_.width_px ||
        view.height_px != camera_.height_px ||
        view.stride_bytes < static_cast<std::size_t>(view.width_px)) {
      return AddResult::kWrongSize;
    }
    if (const auto bad = CheckFrame(stamp_ns, MatchNoise::kSecondImage)) return *bad;
    // The view is not written to: cv::Mat has no const form.
    const cv::Mat image(view.height_px, view.width_px, CV_8UC1,
                        const_cast<std::uint8_t*>(view.pixels), view.stride_bytes);
    return Queue({stamp_ns, image.clone(), {}});
  }

  AddResult AddTracks(std::int64_t stamp_ns, const TrackPoint* points, std::size_t count) {
    if (std::abs(stamp_ns) >= kLargestStamp || count > kMaxPoints ||
        (points == nullptr && count > 0)) {
      return AddResult::kOutOfRange;
    }
    FrameIn frame;
    frame.stamp_ns = stamp_ns;
    for (std::size_t i = 0; i < count; ++i) {
      const TrackPoint& p = points[i];
      if (!std::isfinite(p.u_px) || !std::isfinite(p.v_px)) return AddResult::kNotFinite;
      if (std::abs(p.u_px - 0.5 * camera_.width_px) > 1.5 * camera_.width_px ||
          std::abs(p.v_px - 0.5 * camera_.height_px) > 1.5 * camera_.height_px) {
        return AddResult::kOutOfRange;
      }
      frame.points.push_back({p.id, {p.u_px, p.v_px}});
    }
    const auto by_id = [](const TrackedPoint& a, const TrackedPoint& b) {
      return a.track_id < b.track_id;
    };
    std::sort(frame.points.begin(), frame.points.end(), by_id);
    for (std::size_t i = 0; i + 1 < frame.points.size(); ++i) {
      if (frame.points[i].track_id == frame.points[i + 1].track_id) return AddResult::kOutOfRange;
    }
    if (const auto bad = CheckFrame(stamp_ns, MatchNoise::kBothImages)) return *bad;
    return Queue(std::move(frame));
  }

  std::shared_ptr<const Snapshot> snapshot() const { return std::atomic_load(&snapshot_); }

  VinsStart InitialiseVins(const VinsSettings& settings) const {
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
      if (!recent_frames_.empty() && !recent_gyro_.empty()) CopyWindow(settings.window_s, &input);
    }
    return ToApi(camgyro::InitialiseVins(input, *options));
  }

  bool WaitUntilIdle(double timeout_s) const {
    std::unique_lock<std::mutex> lock(mutex_);
    return idle_.wait_for(
        lock, std::chrono::duration<double>(std::clamp(timeout_s, 0.0, 1e6)),
        [&] { return stopped_ || (gyro_in_.empty() && frames_in_.empty() && !busy_); });
  }

 private:
  static std::optional<AddResult> Check(std::int64_t stamp_ns, const Eigen::Vector3d& value,
                                        double limit) {
    if (!value.allFinite()) return AddResult::kNotFinite;
    if (std::abs(stamp_ns) >= kLargestStamp || value.cwiseAbs().maxCoeff() > limit) {
      return AddResult::kOutOfRange;
    }
    return std::nullopt;
  }
  static std::optional<AddResult> CheckOrder(std::int64_t stamp_ns,
                                             const std::optional<std::int64_t>& last_ns) {
    if (!last_ns || stamp_ns > *last_ns) return std::nullopt;
    return stamp_ns == *last_ns ? AddResult::kDuplicate : AddResult::kOutOfOrder;
  }

  // The order of a frame, before its data are copied.
  std::optional<AddResult> CheckFrame(std::int64_t stamp_ns, MatchNoise noise) {
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

  AddResult Queue(FrameIn frame) {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_frame_ns_ = frame.stamp_ns;
    frames_in_.push_back(std::move(frame));
    wake_.notify_one();
    return AddResult::kAccepted;
  }

  // The latest frames that the gyro covers, and the samples around them. Under the lock.
  void CopyWindow(double window_s, VinsInput* input) const {
    const double margin_s = 0.05 + std::abs(latest_->readout_s);
    const std::int64_t newest_ns =
        StampAt(recent_gyro_.back().stamp_ns, -latest_->delay_s - margin_s);
    auto last = std::upper_bound(
        recent_frames_.begin(), recent_frames_.end(), newest_ns,
        [](std::int64_t stamp_ns, const OnlineFrame& f) { return stamp_ns < f.stamp_ns; });
    if (last == recent_frames_.begin()) return;
    const std::int64_t first_ns = StampAt((last - 1)->stamp_ns, -window_s);
    for (auto frame = recent_frames_.begin(); frame != last; ++frame) {
      if (frame->stamp_ns < first_ns) continue;
      input->frame_stamps_ns.push_back(frame->stamp_ns);
      input->tracks.push_back(frame->points);
    }
    const std::int64_t from_ns = StampAt(first_ns, latest_->delay_s - margin_s);
    for (const GyroSample& sample : recent_gyro_) {
      if (sample.stamp_ns >= from_ns) input->gyro.push_back(sample);
    }
    for (const AccelSample& sample : recent_accel_) {
      if (sample.stamp_ns >= from_ns) input->accel.push_back(sample);
    }
  }

  void Run() {
    std::string reason;
    try {
      std::unique_lock<std::mutex> lock(mutex_);
      while (true) {
        wake_.wait(lock, [&] { return stop_ || !gyro_in_.empty() || !frames_in_.empty(); });
        if (stop_) return;
        busy_ = true;
        std::vector<GyroSample> gyro;
        gyro.swap(gyro_in_);
        std::optional<FrameIn> frame;
        if (!frames_in_.empty()) {
          frame = std::move(frames_in_.front());
          frames_in_.pop_front();
        }
        const MatchNoise noise = noise_.value_or(MatchNoise::kBothImages);
        lock.unlock();
        Process(gyro, frame ? &*frame : nullptr, noise);
        lock.lock();
        busy_ = false;
        if (gyro_in_.empty() && frames_in_.empty()) idle_.notify_all();
      }
    } catch (const std::exception& error) {
      reason = error.what();
    } catch (...) {
      reason = "unknown";
    }
    Stop("stopped by an error: " + reason);
  }

  // Puts the samples on their clock, if they are not, and keeps the latest.
  std::vector<GyroSample> TakeGyro(const std::vector<GyroSample>& recorded) {
    std::vector<GyroSample> gyro;
    if (options_.stamps == Stamps::kRecorded) {
      gyro = recorded;
    } else {
      for (const GyroSample& sample : recorded) clock_.Add(sample, &gyro);
    }
    if (gyro.empty()) return gyro;
    const std::lock_guard<std::mutex> lock(mutex_);
    recent_gyro_.insert(recent_gyro_.end(), gyro.begin(), gyro.end());
    Trim(&recent_gyro_, kRecentSamplesS, kMaxRecentSamples);
    return gyro;
  }

  void Process(const std::vector<GyroSample>& recorded, FrameIn* frame, MatchNoise noise) {
    const std::vector<GyroSample> gyro = TakeGyro(recorded);
    if (!online_ && frame != nullptr) {
      online_.emplace(camera_, noise, options_.start_s,
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
    std::vector<TrackedPoint> points = std::move(frame->points);
    if (!frame->image.empty()) points = cleaner_.Add(tracker_.Add(frame->image));
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      recent_frames_.push_back({frame->stamp_ns, points});
      Trim(&recent_frames_, kRecentFramesS, kMaxRecentFrames);
    }
    online_->AddFrame({frame->stamp_ns, std::move(points)});
  }

  void Publish(const OnlineCalibration::Progress& progress) {
    auto next = std::make_shared<Snapshot>();
    next->stage = progress.estimating ? Stage::kEstimating : Stage::kCollecting;
    next->message = progress.message;
    if (clock_.report()) next->gyro_stamps = DescribeStamps(*clock_.report());
    next->frame_stamp_ns = progress.frame_stamp_ns;
    next->noise_px = progress.noise_px;
    next->frames = progress.frames;
    next->pairs_used = progress.pairs_used;
    next->pairs_skipped = progress.pairs_skipped;
    next->starts = progress.starts;
    if (progress.estimate) FillEstimate(progress, next.get());
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      latest_ = progress.estimate;
      next->frames_dropped = dropped_;
    }
    std::atomic_store(&snapshot_, std::shared_ptr<const Snapshot>(std::move(next)));
  }

  void FillEstimate(const OnlineCalibration::Progress& progress, Snapshot* next) const {
    const camgyro::Calibration& c = *progress.estimate;
    next->has_estimate = true;
    next->calibration = ToApi(c);
    const StateVector value = ValuesOf(c, c.q_gyro_cam);
    StateVector wanted;
    const double principal_px = options_.ready_principal * c.width_px;
    wanted << options_.ready_focal * c.lens[camgyro::kFocal], principal_px, principal_px,
        options_.ready_readout_s, options_.ready_delay_s,
        Eigen::Vector3d::Constant(options_.ready_bias_rad_s),
        Eigen::Vector3d::Constant(options_.ready_rotation_rad);
    const StateVector sigma = c.sigma();
    next->ready = true;
    for (int i = 0; i < kStateSize; ++i) {
      ParameterState& p = next->parameters[static_cast<std::size_t>(i)];
      p.value = value[i];
      p.sigma = sigma[i];
      p.wanted_sigma = wanted[i];
      p.readiness = !(sigma[i] < 0.5 * progress.prior_sigma[i])  ? Readiness::kUndetermined
                    : !(sigma[i] <= wanted[i])                   ? Readiness::kImprecise
                    : !(progress.movement[i] <= 2.0 * wanted[i]) ? Readiness::kUnsteady
                                                                 : Readiness::kReady;
      next->ready = next->ready && p.readiness == Readiness::kReady;
    }
  }

  void Stop(const std::string& message) noexcept {
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

  const CalibratorOptions options_;
  const camgyro::CameraGuess camera_;
  std::shared_ptr<const Snapshot> snapshot_;  // through std::atomic_load and _store only

  // Shared by producers, reader and worker.
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  mutable std::condition_variable idle_;
  bool stop_ = false, stopped_ = false, busy_ = false;
  std::vector<GyroSample> gyro_in_;
  std::deque<FrameIn> frames_in_;
  std::optional<MatchNoise> noise_;  // images or tracks, once the first came
  std::optional<std::int64_t> last_gyro_ns_, last_accel_ns_, last_frame_ns_;
  std::uint64_t dropped_ = 0;
  std::optional<camgyro::Calibration> latest_;
  std::deque<GyroSample> recent_gyro_;
  std::deque<AccelSample> recent_accel_;
  std::deque<OnlineFrame> recent_frames_;

  // The worker's own.
  KltTracker tracker_;
  TrackCleaner cleaner_;
  StreamingClock clock_;
  std::optional<OnlineCalibration> online_;
  std::deque<GyroSample> early_gyro_;  // before the first frame
  std::thread thread_;                 // last: starts when all else is there
};

Calibrator::Calibrator(std::unique_ptr<Worker> worker) : worker_(std::move(worker)) {}
Calibrator::~Calibrator() = default;

std::unique_ptr<Calibrator> Calibrator::Create(const CalibratorOptions& options,
                                               std::string* error) noexcept {
  try {
    const auto refuse = [&](const std::string& why) {
      if (error != nullptr) *error = why;
      return nullptr;
    };
    const Result<camgyro::CameraGuess> camera = FromApi(options.camera);
    if (!camera) return refuse(camera.error().message);
    for (const double wanted :
         {options.ready_focal, options.ready_principal, options.ready_readout_s,
          options.ready_delay_s, options.ready_bias_rad_s, options.ready_rotation_rad}) {
      if (!(wanted > 0.0)) return refuse("options: expected positive wanted sigmas");
    }
    if (!(options.start_s >= 2.0 && options.start_s <= 10.0)) {
      return refuse("options: expected start_s from 2 to 10");
    }
    if (options.max_frames_waiting < 2 || options.max_frames_waiting > 10'000) {
      return refuse("options: expected max_frames_waiting from 2 to 10000");
    }
    return std::unique_ptr<Calibrator>(new Calibrator(std::make_unique<Worker>(options, *camera)));
  } catch (...) {
    return nullptr;  // no memory or no thread
  }
}

AddResult Calibrator::AddGyro(std::int64_t stamp_ns, double x, double y, double z) noexcept {
  try {
    return worker_->AddGyro({stamp_ns, {x, y, z}});
  } catch (...) {
    return AddResult::kStopped;
  }
}

AddResult Calibrator::AddAccel(std::int64_t stamp_ns, double x, double y, double z) noexcept {
  try {
    return worker_->AddAccel({stamp_ns, {x, y, z}});
  } catch (...) {
    return AddResult::kStopped;
  }
}

AddResult Calibrator::AddImage(std::int64_t stamp_ns, const ImageView& image) noexcept {
  try {
    return worker_->AddImage(stamp_ns, image);
  } catch (...) {
    return AddResult::kStopped;
  }
}

AddResult Calibrator::AddTracks(std::int64_t stamp_ns, const TrackPoint* points,
                                std::size_t count) noexcept {
  try {
    return worker_->AddTracks(stamp_ns, points, count);
  } catch (...) {
    return AddResult::kStopped;
  }
}

std::shared_ptr<const Snapshot> Calibrator::snapshot() const noexcept {
  return worker_->snapshot();
}

VinsStart Calibrator::InitialiseVins(const VinsSettings& settings) const noexcept {
  try {
    return worker_->InitialiseVins(settings);
  } catch (...) {
    VinsStart failed;
    failed.verdict = VinsVerdict::kNotConverged;
    return failed;
  }
}

bool Calibrator::WaitUntilIdle(double timeout_s) const noexcept {
  try {
    return worker_->WaitUntilIdle(timeout_s);
  } catch (...) {
    return false;
  }
}

}  // namespace camgyro::api
