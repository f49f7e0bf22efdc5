// Simulated windows for the VINS initialisation, with the truth in the window's world frame.
#ifndef CAMGYRO_TESTS_ESTIMATOR_VINS_VINS_SCENE_H_
#define CAMGYRO_TESTS_ESTIMATOR_VINS_VINS_SCENE_H_

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/time.h"
#include "estimator/vins/initialise.h"
#include "simulation/simulate.h"

namespace camgyro {

inline simulation::Scenario WalkingScenario(double duration_s) {
  simulation::Scenario scenario;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.duration_s = duration_s;
  scenario.tracks.count = 60;
  scenario.tracks.noise_px = 0.5;
  return scenario;
}

// The truth, with the covariance that a good calibration has.
inline Calibration GoodCalibration(const simulation::Simulated& s) {
  Calibration c = s.truth;
  StateVector sigma;
  sigma << 0.3, 0.5, 0.5, 1e-4, 1e-4, Eigen::Vector3d::Constant(5e-4),
      Eigen::Vector3d::Constant(1e-3);
  c.covariance = sigma.cwiseAbs2().asDiagonal();
  return c;
}

inline VinsOptions SimulatorsNoise(const simulation::Scenario& scenario) {
  VinsOptions options;
  options.noise = {scenario.gyro.noise_density_rad_s_rtHz,
                   scenario.gyro.accel_noise_density_m_s2_rtHz};
  return options;
}

// The gyro frame of the simulator at a time of the gyro's clock, in a world with y down.
inline VinsState TrueState(const simulation::Simulated& s, const simulation::Scenario& scenario,
                           int64_t time_ns) {
  const simulation::CameraState camera =
      s.camera->trajectory().At(SecondsSince(scenario.start_ns, time_ns));
  const Eigen::Quaterniond q_world_cam(camera.R_world_cam);
  VinsState state;
  state.time_ns = time_ns;
  state.q_world_gyro = q_world_cam * scenario.mount.q_gyro_cam.conjugate();
  const Eigen::Vector3d& arm = scenario.mount.p_gyro_cam_m;
  const Eigen::Vector3d omega_gyro = scenario.mount.q_gyro_cam * camera.omega_cam_rad_s;
  state.p_world_m = camera.p_world_m - state.q_world_gyro * arm;
  state.v_world_m_s = camera.v_world_m_s - state.q_world_gyro * omega_gyro.cross(arm);
  return state;
}

// The truth of all states in the frame of the first.
struct VinsTruth {
  std::vector<VinsState> states;
  Eigen::Vector3d gravity_world_m_s2;
};
inline VinsTruth TruthOf(const VinsStart& start, const simulation::Simulated& s,
                         const simulation::Scenario& scenario) {
  VinsTruth truth;
  const VinsState first = TrueState(s, scenario, start.states.front().time_ns);
  const Eigen::Quaterniond q_first = first.q_world_gyro.conjugate();
  for (const VinsState& state : start.states) {
    VinsState t = TrueState(s, scenario, state.time_ns);
    t.p_world_m = q_first * (t.p_world_m - first.p_world_m);
    t.v_world_m_s = q_first * t.v_world_m_s;
    t.q_world_gyro = q_first * t.q_world_gyro;
    truth.states.push_back(t);
  }
  truth.gravity_world_m_s2 = q_first * Eigen::Vector3d(0.0, 9.80665, 0.0);
  return truth;
}

// Estimated scale over the true one, minus one.
inline double ScaleError(const VinsStart& start, const VinsTruth& truth) {
  double along = 0.0, size = 0.0;
  for (size_t k = 0; k < start.states.size(); ++k) {
    along += start.states[k].p_world_m.dot(truth.states[k].p_world_m);
    size += truth.states[k].p_world_m.squaredNorm();
  }
  return along / size - 1.0;
}

inline double GravityErrorRad(const VinsStart& start, const VinsTruth& truth) {
  return std::acos(std::min(
      1.0, start.gravity_world_m_s2.normalized().dot(truth.gravity_world_m_s2.normalized())));
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_ESTIMATOR_VINS_VINS_SCENE_H_
