#include "simulation/simulate.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/so3.h"
#include "core/time.h"
#include "simulation/gyro.h"
#include "simulation/random_streams.h"
#include "simulation/tracker.h"

namespace camgyro::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::string Seconds(double seconds) { return std::to_string(seconds) + " s"; }

// A structured scene must stay around the camera.
Status CheckInside(const Simulated& simulated, const SceneOptions& scene) {
  constexpr double kMargin = 0.2;  // [m]
  for (const FrameTruth& frame : simulated.frames) {
    const Vector3d& p = frame.state.p_world_m;
    const std::string when = " at " + Seconds(frame.timing.stamp_s) +
                             ": slow the motion, or send it round with motion.path_radius_m";
    if ((scene.kind == SceneKind::kRoom || scene.kind == SceneKind::kCorridor) &&
        ((0.5 * scene.room_m - p.cwiseAbs()).array() < kMargin).any()) {
      return BadInput("the camera leaves the room" + when);
    }
    if (scene.kind == SceneKind::kCorridor && std::abs(p.x()) < 0.5 * scene.block_m[0] + kMargin &&
        std::abs(p.z()) < 0.5 * scene.block_m[1] + kMargin) {
      return BadInput("the camera runs into the block" + when);
    }
    if (scene.kind == SceneKind::kFacade && p.z() > scene.distance_m - kMargin) {
      return BadInput("the camera runs into the wall" + when);
    }
    if ((scene.kind == SceneKind::kFacade || scene.kind == SceneKind::kGround) &&
        p.y() > scene.ground_m - kMargin) {
      return BadInput("the camera sinks into the ground" + when);
    }
  }
  return {};
}

struct PlannedFrame {
  int64_t stamp_ns;  // without jitter
  double exposure_s;
};

// The frames of a scenario, or those of its log that the gyro covers with the scenario's margin.
std::vector<PlannedFrame> PlanFrames(const Scenario& scenario) {
  const CameraOptions& options = scenario.camera;
  std::vector<PlannedFrame> plan;
  const auto add = [&](double time_s, int64_t stamp_ns) {
    const double swing = options.exposure_swing * std::sin(2.0 * M_PI * time_s / 5.0);
    const int64_t exposure_ns = std::llround(1e9 * options.exposure_s * (1.0 + swing));
    plan.push_back({stamp_ns, 1e-9 * static_cast<double>(exposure_ns)});
  };
  if (scenario.log != nullptr && !scenario.log->frame_ns.empty()) {
    const DeviceLog& log = *scenario.log;
    for (size_t i = 0; i < log.frame_ns.size(); ++i) {
      const double time_s = 1e-9 * static_cast<double>(log.frame_ns[i]) + options.delay_s;
      const double last_s = scenario.margin_s + scenario.duration_s;
      if (time_s < scenario.margin_s || time_s > last_s) continue;
      add(time_s, scenario.start_ns + log.frame_ns[i]);
      if (!log.exposure_s.empty()) plan.back().exposure_s = log.exposure_s[i];
    }
    return plan;
  }
  const int count = static_cast<int>(std::floor(scenario.duration_s * options.rate_hz)) + 1;
  for (int i = 0; i < count; ++i) {
    const double time_s = scenario.margin_s + i / options.rate_hz;  // first row, clean clock
    add(time_s, StampAt(scenario.start_ns, time_s - options.delay_s));
  }
  return plan;
}

void AddFrames(const Scenario& scenario, const SimulatedGyro& sensors, Simulated* result) {
  const CameraOptions& options = scenario.camera;
  std::mt19937_64 random = MakeRandom(scenario.seed, kFrameStream);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> normal;
  std::exponential_distribution<double> latency;
  const FrameStampJitter& jitter = scenario.effects.frame_stamp_jitter;
  Wander wander(scenario, jitter.wander_time_s, kWanderStream);
  const std::vector<PlannedFrame> plan = PlanFrames(scenario);
  const size_t count = plan.size();
  for (size_t i = 0; i < count; ++i) {
    const auto [stamp_ns, exposure_s] = plan[i];
    const double late_s = jitter.latency_s > 0.0 ? jitter.latency_s * latency(random) : 0.0;
    const int64_t jitter_ns = std::llround(
        1e9 * (jitter.spread_s * normal(random) + late_s + jitter.wander_s * wander.Next()));
    if (unit(random) < options.drop_fraction && i > 0 && i + 1 < count) continue;

    Frame frame;
    frame.stamp_ns = stamp_ns + jitter_ns;
    frame.exposure_s = exposure_s;
    if (!result->recording.frames.empty()) {
      frame.stamp_ns = std::max(frame.stamp_ns, result->recording.frames.back().stamp_ns + 1000);
    }
    FrameTruth truth;
    truth.timing = result->camera->MakeFrame(SecondsSince(scenario.start_ns, stamp_ns), exposure_s);
    truth.delay_s =
        result->camera->Delay(truth.timing) - 1e-9 * static_cast<double>(frame.stamp_ns - stamp_ns);
    const double first_row_s = result->camera->ExposureTime(truth.timing, {0.0, 0.0});
    truth.focal_px = result->camera->Focal(first_row_s);
    const auto later =
        std::upper_bound(sensors.times_s.begin() + 1, sensors.times_s.end(), first_row_s);
    truth.bias_gyro_rad_s =
        sensors.bias_rad_s[static_cast<size_t>(later - sensors.times_s.begin()) - 1];
    truth.state = result->camera->trajectory().At(first_row_s);
    result->recording.frames.push_back(frame);
    result->frames.push_back(truth);
  }
}

Calibration Truth(const Scenario& scenario) {
  const CameraOptions& camera = scenario.camera;
  const Effects& effects = scenario.effects;
  Calibration truth;
  truth.width_px = camera.width_px;
  truth.height_px = camera.height_px;
  const Vector2d centre(0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1));
  truth.lens = MakePinhole(camera.focal_px, camera.principal_px.value_or(centre),
                           effects.aspect_ratio.ratio);
  if (effects.radial_distortion.kannala_brandt) {
    const RadialDistortion& k = effects.radial_distortion;
    truth.lens.segment<4>(kKb1) << k.k1, k.k2, k.k3, k.k4;
    truth.distortion_model = DistortionModel::kKannalaBrandt;
  } else {
    truth.lens.segment<4>(kK1) << effects.radial_distortion.k1, effects.radial_distortion.k2,
        effects.tangential_distortion.p1, effects.tangential_distortion.p2;
    const bool distorted = !truth.lens.segment<4>(kK1).isZero(0.0);
    truth.distortion_model = distorted ? DistortionModel::kRadTan : DistortionModel::kNone;
  }
  truth.readout_s = effects.readout_direction.reversed ? -camera.readout_s : camera.readout_s;
  if (scenario.attitudes.wanted()) truth.readout_s = 0.0;
  truth.delay_s = camera.delay_s;
  truth.bias_gyro_rad_s = scenario.gyro.bias_rad_s;
  truth.q_gyro_cam = scenario.mount.q_gyro_cam;
  return truth;
}

// As a phone has it in the results of its frames: on the camera's clock, from before the first one
// until after the last.
void AddLensShift(const Scenario& scenario, Simulated* result) {
  const OpticalStabilisation& lens = scenario.effects.optical_stabilisation;
  if (!lens.active() || lens.log_hz == 0.0) return;
  constexpr double kAround_s = 0.1;
  const double from_s = result->frames.front().timing.stamp_s - kAround_s;
  const double to_s = result->frames.back().timing.stamp_s + kAround_s;
  for (int k = 0; from_s + k / lens.log_hz < to_s; ++k) {
    const double stamp_s = from_s + k / lens.log_hz;
    result->recording.lens_shift.push_back(
        {StampAt(scenario.start_ns, stamp_s),
         result->camera->StabiliserShift(stamp_s + scenario.camera.delay_s)});
  }
}

// Of each frame's first row, with an error of its own about the camera's axes, and one that adds up
// about the world's.
void AddAttitudes(const Scenario& scenario, Simulated* result) {
  std::mt19937_64 random = MakeRandom(scenario.seed, kAttitudeStream);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Vector3d(sigma * Vector3d(x, y, z));
  };
  Eigen::Quaterniond walk = Eigen::Quaterniond::Identity();
  for (const FrameTruth& frame : result->frames) {
    const Vector3d error =
        draw(scenario.attitudes.noise_rad) +
        scenario.effects.attitude_rolling_shutter.Error(frame.state.omega_cam_rad_s);
    const Eigen::Quaterniond q_world_cam(frame.state.R_world_cam);
    result->recording.q_cam_world.push_back((walk * q_world_cam * Exp(error)).conjugate());
    walk = walk * Exp(draw(scenario.attitudes.walk_rad));
  }
}

}  // namespace

Result<Simulated> SimulateSensors(const Scenario& scenario) {
  Simulated result;
  std::mt19937_64 random = MakeRandom(scenario.seed, kMotionStream);
  Result<std::shared_ptr<const Trajectory>> trajectory = MakeTrajectory(scenario, &random);
  if (!trajectory) return tl::unexpected(trajectory.error());
  result.camera = std::make_shared<SimulatedCamera>(scenario, *trajectory);
  random = MakeRandom(scenario.seed, kSceneStream);
  result.scene = Scene::Make(scenario.scene, &random);
  random = MakeRandom(scenario.seed, kGyroStream);
  SimulatedGyro sensors = SimulateGyro(scenario, **trajectory, &random);
  AddFrames(scenario, sensors, &result);
  AddLensShift(scenario, &result);
  if (scenario.attitudes.wanted()) AddAttitudes(scenario, &result);
  if (Status inside = CheckInside(result, scenario.scene); !inside) {
    return tl::unexpected(inside.error());
  }
  Recording& recording = result.recording;
  recording.gyro = std::move(sensors.gyro);
  recording.accel = std::move(sensors.accel);
  recording.gyro_info.noise_density_rad_s_rtHz = scenario.gyro.noise_density_rad_s_rtHz;
  recording.gyro_info.random_walk_rad_s2_rtHz = scenario.gyro.bias_walk_rad_s2_rtHz;
  result.truth = Truth(scenario);
  recording.camera.width_px = scenario.camera.width_px;
  recording.camera.height_px = scenario.camera.height_px;
  if (scenario.camera.declare_intrinsics) {
    recording.camera.focal_px = result.truth.lens[kFocal];
    recording.camera.aspect_ratio = result.truth.lens[kAspect];
    recording.camera.principal_px = result.truth.lens.segment<2>(kCx);
  }
  return result;
}

void ForEachFrame(const Scenario& scenario, const Simulated& sensors,
                  const std::function<void(size_t, std::vector<TrackedPoint>*,
                                           std::vector<PointTruth>*)>& visit) {
  SimulatedTracker tracker(scenario, *sensors.camera, sensors.scene);
  for (size_t i = 0; i < sensors.frames.size(); ++i) {
    std::vector<TrackedPoint> tracks;
    std::vector<PointTruth> truths;
    tracker.Step(sensors.frames[i].timing, &tracks, &truths);
    visit(i, &tracks, &truths);
  }
}

Result<Simulated> SimulateTracks(const Scenario& scenario) {
  Result<Simulated> result = SimulateSensors(scenario);
  if (!result) return result;
  if (scenario.attitudes.wanted()) return result;
  ForEachFrame(
      scenario, *result,
      [&](size_t /*frame*/, std::vector<TrackedPoint>* tracks, std::vector<PointTruth>* truths) {
        result->recording.tracks.push_back(std::move(*tracks));
        result->points.push_back(std::move(*truths));
      });
  if (scenario.tracks.reanchored) result->recording.match_noise = MatchNoise::kSecondImage;
  return result;
}

}  // namespace camgyro::simulation
