#include "camgyro/odometry.h"

#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include "camgyro/convert.h"
#include "camgyro/stream_checks.h"
#include "estimator/odometry/odometry.h"

namespace camgyro::api {
namespace {

Vec3 ToVec3(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::vector<OdometryPose> Converted(const std::vector<camgyro::OdometryPose>& poses) {
  std::vector<OdometryPose> converted;
  for (const camgyro::OdometryPose& pose : poses) {
    OdometryPose& out = converted.emplace_back();
    const NavigationState& s = pose.state;
    out.frame_stamp_ns = pose.frame_stamp_ns;
    out.time_ns = pose.time_ns;
    out.segment = pose.segment;
    const Eigen::Quaterniond& q = s.q_world_gyro;
    out.q_world_gyro_wxyz = {q.w(), q.x(), q.y(), q.z()};
    out.p_world_m = ToVec3(s.p_world_m);
    out.v_world_m_s = ToVec3(s.v_world_m_s);
    out.bias_gyro_rad_s = ToVec3(s.bias_gyro_rad_s);
    out.bias_accel_m_s2 = ToVec3(s.bias_accel_m_s2);
    static_assert(kNavSize * kNavSize == std::tuple_size<decltype(out.covariance)>::value);
    // Symmetric: the order of rows and columns is the same.
    Eigen::Map<NavigationCovariance>(out.covariance.data()) = pose.covariance;
    out.mapped_tracks = pose.mapped_tracks;
  }
  return converted;
}

}  // namespace

class Odometry::State {
 public:
  State(const camgyro::Calibration& calibration, const OdometryOptions& options)
      : odometry_(calibration, options) {
    camera_.width_px = calibration.width_px;
    camera_.height_px = calibration.height_px;
  }

  // `last` is the stream's last stamp.
  template <typename Add>
  AddResult Accept(std::int64_t stamp_ns, std::optional<std::int64_t>* last, const Add& add) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopped_) return AddResult::kStopped;
    if (const auto wrong = CheckOrder(stamp_ns, *last)) return *wrong;
    *last = stamp_ns;
    try {
      if (!add(&odometry_)) return AddResult::kOutOfRange;
    } catch (const std::exception&) {  // no memory
      stopped_ = true;
      return AddResult::kStopped;
    }
    return AddResult::kAccepted;
  }

  template <typename Use>
  auto With(const Use& use) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return use(&odometry_);
  }

  const camgyro::CameraGuess& camera() const { return camera_; }
  std::optional<std::int64_t> last_gyro, last_accel, last_frame;

 private:
  std::mutex mutex_;
  camgyro::Odometry odometry_;
  camgyro::CameraGuess camera_;
  bool stopped_ = false;
};

Odometry::Odometry(std::unique_ptr<State> state) : state_(std::move(state)) {}
Odometry::~Odometry() = default;

std::unique_ptr<Odometry> Odometry::Create(const Calibration& calibration,
                                           const OdometrySettings& settings,
                                           std::string* error) noexcept {
  try {
    const Result<camgyro::Calibration> inner = FromApi(calibration);
    const Result<OdometryOptions> options = FromApi(settings);
    if (inner && options) {
      return std::unique_ptr<Odometry>(new Odometry(std::make_unique<State>(*inner, *options)));
    }
    if (error != nullptr) *error = !inner ? inner.error().message : options.error().message;
  } catch (const std::exception&) {  // no memory
    if (error != nullptr) error->clear();
  }
  return nullptr;
}

AddResult Odometry::AddGyro(std::int64_t stamp_ns, double x, double y, double z) noexcept {
  const GyroSample sample{stamp_ns, {x, y, z}};
  if (const auto wrong = CheckSample(sample)) return *wrong;
  return state_->Accept(stamp_ns, &state_->last_gyro, [&](camgyro::Odometry* odometry) {
    return odometry->AddGyro(sample).has_value();
  });
}

AddResult Odometry::AddAccel(std::int64_t stamp_ns, double x, double y, double z) noexcept {
  const AccelSample sample{stamp_ns, {x, y, z}};
  if (const auto wrong = CheckSample(sample)) return *wrong;
  return state_->Accept(stamp_ns, &state_->last_accel, [&](camgyro::Odometry* odometry) {
    return odometry->AddAccel(sample).has_value();
  });
}

AddResult Odometry::AddTracks(std::int64_t stamp_ns, const TrackPoint* points,
                              std::size_t count) noexcept {
  try {
    std::vector<TrackedPoint> taken;
    if (const auto wrong = TakePoints(stamp_ns, points, count, state_->camera(), &taken)) {
      return *wrong;
    }
    return state_->Accept(stamp_ns, &state_->last_frame, [&](camgyro::Odometry* odometry) {
      return odometry->AddFrame(stamp_ns, std::move(taken)).has_value();
    });
  } catch (const std::exception&) {  // no memory
    return AddResult::kStopped;
  }
}

OdometryUpdate Odometry::Take() noexcept {
  try {
    return state_->With([](camgyro::Odometry* odometry) {
      OdometryUpdate update;
      update.tracking = odometry->tracking();
      if (!update.tracking) update.message = odometry->start_explanation();
      update.poses = Converted(odometry->TakePoses());
      update.keyframes = Converted(odometry->TakeKeyframes());
      for (const camgyro::OdometryEvent& event : odometry->TakeEvents()) {
        update.events.push_back({event.kind == camgyro::OdometryEvent::Kind::kStarted,
                                 event.time_ns, event.segment, event.explanation});
      }
      return update;
    });
  } catch (const std::exception&) {  // no memory
    return {};
  }
}

void Odometry::Finish() noexcept {
  try {
    state_->With([](camgyro::Odometry* odometry) { odometry->Finish(); });
  } catch (const std::exception&) {  // no memory: the keyframes are not told
  }
}

Calibration Odometry::calibration() const noexcept {
  try {
    return state_->With([](camgyro::Odometry* odometry) {
      Calibration c = ToApi(odometry->calibration());
      c.total_covariance = c.covariance;
      return c;
    });
  } catch (const std::exception&) {  // no memory
    return {};
  }
}

}  // namespace camgyro::api
