#include "simulation/tracker.h"

#include <cmath>
#include <optional>
#include <utility>

namespace camgyro::simulation {

using Eigen::Vector2d;
using Eigen::Vector3d;

SimulatedTracker::SimulatedTracker(const Scenario& scenario, const SimulatedCamera& camera,
                                   const Scene& scene)
    : scenario_(scenario),
      camera_(camera),
      scene_(scene),
      random_(MakeRandom(scenario.seed, kTrackStream)),
      noise_wander_(scenario, TrackOptions::kNoiseMemoryS, kNoiseStream) {}

void SimulatedTracker::Step(const FrameTiming& frame, std::vector<TrackedPoint>* tracks,
                            std::vector<PointTruth>* truths) {
  noise_px_ =
      scenario_.tracks.noise_px * std::exp(scenario_.tracks.noise_scatter * noise_wander_.Next());
  std::vector<Landmark> seen;
  for (Landmark& landmark : alive_) {
    const double mean_life = scenario_.tracks.mean_life_frames;
    if (mean_life > 0.0 && Unit() < 1.0 / mean_life) continue;
    if (Observe(frame, /*is_new=*/false, &landmark, tracks, truths)) seen.push_back(landmark);
  }
  alive_ = std::move(seen);
  for (int tries = 20 * scenario_.tracks.count;
       tries > 0 && static_cast<int>(alive_.size()) < scenario_.tracks.count; --tries) {
    Landmark landmark;
    if (Spawn(frame, &landmark) && Observe(frame, /*is_new=*/true, &landmark, tracks, truths)) {
      alive_.push_back(landmark);
      ++next_id_;
    }
  }
}

Vector2d SimulatedTracker::Noise(double sigma) {
  const double u = normal_(random_), v = normal_(random_);
  return sigma * Vector2d(u, v);
}

Vector3d SimulatedTracker::PointAt(const Landmark& landmark, double time_s) const {
  Vector3d point = landmark.anchor_m + landmark.velocity_m_s * (time_s - landmark.since_s);
  if (landmark.surface >= 0) point += scene_.Offset(landmark.surface, time_s);
  return point;
}

double SimulatedTracker::RandomDepth() {
  const double a = scenario_.scene.depth_m[0], b = scenario_.scene.depth_m[1], u = Unit();
  switch (scenario_.scene.depth_law) {
    case DepthLaw::kUniform:
      return a + (b - a) * u;
    case DepthLaw::kLogarithmic:
      return a * std::pow(b / a, u);
    case DepthLaw::kInverse:
      return 1.0 / (1.0 / a + (1.0 / b - 1.0 / a) * u);
  }
  return a;
}

bool SimulatedTracker::Anchor(const FrameTiming& frame, const Vector2d& picture_px, double depth_m,
                              Landmark* landmark) const {
  const std::optional<Vector2d> sensor_px = camera_.Destabilise(frame, picture_px);
  if (!sensor_px) return false;
  const double time_s = camera_.ExposureTime(frame, *sensor_px);
  const std::optional<Vector3d> ray = camera_.Unproject(*sensor_px, time_s);
  if (!ray) return false;
  const CameraState state = camera_.trajectory().At(time_s);
  const Vector3d direction = state.R_world_cam * *ray;
  if (!scene_.surfaces().empty()) {
    const std::optional<Hit> hit = scene_.Cast(state.p_world_m, direction, time_s);
    if (!hit) return false;
    depth_m = hit->distance;
    landmark->surface = hit->surface;
  }
  landmark->anchor_m = state.p_world_m + depth_m * direction;
  if (landmark->surface >= 0) landmark->anchor_m -= scene_.Offset(landmark->surface, time_s);
  landmark->since_s = time_s;
  return true;
}

bool SimulatedTracker::Spawn(const FrameTiming& frame, Landmark* landmark) {
  const CameraOptions& camera = scenario_.camera;
  const double u = Unit() * (camera.width_px - 1), v = Unit() * (camera.height_px - 1);
  const double depth_m = RandomDepth();
  const bool moves = Unit() < scenario_.scene.moving_fraction;
  const double direction = 2.0 * M_PI * Unit();
  if (moves && scene_.surfaces().empty()) {
    landmark->velocity_m_s =
        scenario_.scene.moving_speed_m_s * Vector3d(std::cos(direction), 0.0, std::sin(direction));
  }
  landmark->id = next_id_;
  return Anchor(frame, {u, v}, depth_m, landmark);
}

bool SimulatedTracker::Hidden(const SimulatedCamera::Observation& seen,
                              const Vector3d& point) const {
  if (scene_.surfaces().empty()) return false;
  const Vector3d origin = camera_.trajectory().At(seen.time_s).p_world_m;
  const std::optional<Hit> hit = scene_.Cast(origin, point - origin, seen.time_s);
  return hit && hit->distance < 0.99;
}

bool SimulatedTracker::Observe(const FrameTiming& frame, bool is_new, Landmark* landmark,
                               std::vector<TrackedPoint>* tracks, std::vector<PointTruth>* truths) {
  constexpr double kMinDepth = 0.2;  // [m]
  const auto seen =
      camera_.Observe(frame, [&](double time_s) { return PointAt(*landmark, time_s); });
  if (!seen || seen->depth_m < kMinDepth) return false;
  PointTruth truth;
  truth.world_m = PointAt(*landmark, seen->time_s);
  truth.time_s = seen->time_s;
  if (Hidden(*seen, truth.world_m)) return false;
  const std::optional<Vector2d> px = camera_.Stabilise(frame, seen->sensor_px);
  if (!px || !camera_.InPicture(*px)) return false;
  truth.px = *px;
  truth.moving = !landmark->velocity_m_s.isZero(0.0) ||
                 (landmark->surface >= 0 &&
                  scene_.surfaces()[static_cast<size_t>(landmark->surface)].moving());

  // A re-anchoring tracker defines its point in the first picture: no noise there.
  const TrackOptions& options = scenario_.tracks;
  const Vector2d noise = Noise(noise_px_), gross = Noise(options.outlier_px);
  const bool defines = options.reanchored && is_new;
  truth.outlier = Unit() < options.outlier_fraction && !defines;
  Vector2d measured = truth.px;
  if (!defines) measured += noise;
  if (truth.outlier) measured += gross;
  if (!camera_.InPicture(measured)) return false;
  // The new point is one that is seen there, averaged over the exposure as the old one was.
  if (options.reanchored && !defines &&
      !Anchor(frame, measured - seen->averaging_px, seen->depth_m, landmark)) {
    return false;
  }
  tracks->push_back({landmark->id, measured});
  truths->push_back(truth);
  return true;
}

}  // namespace camgyro::simulation
