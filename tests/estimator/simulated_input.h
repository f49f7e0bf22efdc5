// Short simulated recordings, a start that is off the truth, and the online pass over them.
#ifndef CAMGYRO_TESTS_ESTIMATOR_SIMULATED_INPUT_H_
#define CAMGYRO_TESTS_ESTIMATOR_SIMULATED_INPUT_H_

#include <gmock/gmock.h>

#include <cmath>
#include <cstdint>

#include "core/so3.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/sliding_window.h"
#include "simulation/simulate.h"

namespace camgyro {

// Handheld, 0.7 px, 50 tracks per frame at 30 frames/s.
inline simulation::Scenario ShortScenario(double duration_s) {
  simulation::Scenario scenario;
  scenario.seed = 1;
  scenario.duration_s = duration_s;
  scenario.tracks.count = 50;
  scenario.tracks.noise_px = 0.7;
  scenario.gyro.accelerometer = false;
  return scenario;
}

// The same past points so far away that 1.2 m/s shows 0.01 px from frame to frame.
inline simulation::Scenario FarScenario(double duration_s) {
  simulation::Scenario scenario = ShortScenario(duration_s);
  scenario.scene.depth_m = {2000.0, 20000.0};
  return scenario;
}

// 10 s of a room with a camera of 752 x 480.
inline simulation::Scenario RoomScenario() {
  simulation::Scenario scenario = ShortScenario(10.0);
  scenario.camera.width_px = 752;
  scenario.camera.focal_px = 458.0;
  scenario.scene.kind = simulation::SceneKind::kRoom;
  scenario.motion.speed_m_s = 0.8;
  scenario.motion.path_radius_m = 1.5;
  scenario.motion.heading_deg = 60.0;
  return scenario;
}

// The same with a lens like that of EuRoC's drone.
inline simulation::Scenario RoomThroughALens() {
  simulation::Scenario scenario = RoomScenario();
  scenario.effects.radial_distortion.k1 = -0.28;
  scenario.effects.radial_distortion.k2 = 0.07;
  return scenario;
}

// The truth with the focal length 5 % and the delay 5 ms off, q_gyro_cam by 20 mrad per axis and
// no bias; the prior is as wide as that of a phone's declaration.
inline Prior StartOffTheTruth(const Calibration& truth) {
  Prior prior{truth};
  Calibration& start = prior.mean;
  start.lens[kFocal] *= 1.05;
  start.delay_s += 0.005;
  start.q_gyro_cam = start.q_gyro_cam * Exp(Eigen::Vector3d(0.02, -0.02, 0.02));
  start.bias_gyro_rad_s.setZero();
  prior.sigma << 0.15 * truth.lens[kFocal], 17.0, 17.0, 0.005, 0.05, Eigen::Vector3d::Constant(0.1),
      Eigen::Vector3d::Constant(0.15);
  return prior;
}

// Errors in sigmas of the estimate.
inline StateVector ErrorInSigmas(const Calibration& estimate, const Calibration& truth) {
  return Difference(estimate, truth).cwiseQuotient(estimate.sigma());
}

// Feeds a recording in the order of real time; everything must be accepted.
inline void FeedAll(const Recording& recording, SlidingWindow* window) {
  size_t next = 0;
  const std::vector<FramePair> pairs = PairsFromTracks(recording.tracks, 1);
  for (const FramePair& pair : pairs) {
    const int64_t stamp_a = recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns;
    const int64_t stamp_b = recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns;
    for (; next < recording.gyro.size() && recording.gyro[next].stamp_ns <= stamp_b; ++next) {
      ASSERT_EQ(window->AddGyroSample(recording.gyro[next]), AddResult::kAccepted);
    }
    ASSERT_EQ(window->AddPair(stamp_a, stamp_b, pair.matches), AddResult::kAccepted);
  }
  for (; next < recording.gyro.size(); ++next) {
    ASSERT_EQ(window->AddGyroSample(recording.gyro[next]), AddResult::kAccepted);
  }
}

inline SlidingWindow MakeWindow(const simulation::Simulated& s,
                                const SlidingWindowOptions& options = {}) {
  const Prior start = StartOffTheTruth(s.truth);
  return SlidingWindow(start.mean, start, s.recording.gyro.front().stamp_ns, options);
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_ESTIMATOR_SIMULATED_INPUT_H_
