// Track level: a recording in memory from a scenario, with everything that is true of it.
#ifndef CAMGYRO_SIMULATION_SIMULATE_H_
#define CAMGYRO_SIMULATION_SIMULATE_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "simulation/camera.h"
#include "simulation/scenario.h"
#include "simulation/scene.h"
#include "simulation/tracker.h"
#include "simulation/trajectory.h"

namespace camgyro::simulation {

struct FrameTruth {
  FrameTiming timing;
  double delay_s = 0.0;             // with all effects
  double focal_px = 0.0;            // at the first row
  Eigen::Vector3d bias_gyro_rad_s;  // at the first row
  CameraState state;                // at the first row
};

struct Simulated {
  Recording recording;
  // Covariance zero. Delay, focal length, bias: as set in the scenario; what effects make of them
  // with time is in `frames`. A Kannala-Brandt lens has no place here: see Scenario::effects.
  Calibration truth;
  std::shared_ptr<const SimulatedCamera> camera;
  Scene scene;
  std::vector<FrameTruth> frames;               // as Recording::frames
  std::vector<std::vector<PointTruth>> points;  // as Recording::tracks
};

// Frames, gyro, accelerometer, the resolution, and attitudes where the scenario has such; no image
// motion.
Result<Simulated> SimulateSensors(const Scenario& scenario);

// The tracks of the frames of SimulateSensors, in turn, without keeping any: for streams of hours.
// visit(frame, tracks, what is true of them) may move them.
void ForEachFrame(
    const Scenario& scenario, const Simulated& sensors,
    const std::function<void(size_t, std::vector<TrackedPoint>*, std::vector<PointTruth>*)>& visit);

// The sensors with tracks, unless the scenario has attitudes. Re-anchored tracks set
// MatchNoise::kSecondImage.
// Errors: the trajectory file; a camera that leaves the room.
Result<Simulated> SimulateTracks(const Scenario& scenario);

// The scenario with another seed.
inline Result<Simulated> SimulateTracks(Scenario scenario, uint64_t seed) {
  scenario.seed = seed;
  return SimulateTracks(scenario);
}

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_SIMULATE_H_
