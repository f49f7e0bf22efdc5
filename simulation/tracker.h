// What a tracker of points makes of a scene that a camera sees.
#ifndef CAMGYRO_SIMULATION_TRACKER_H_
#define CAMGYRO_SIMULATION_TRACKER_H_

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include "core/recording.h"
#include "simulation/camera.h"
#include "simulation/random_streams.h"
#include "simulation/scenario.h"
#include "simulation/scene.h"

namespace camgyro::simulation {

// What is true of one entry of Recording::tracks.
struct PointTruth {
  Eigen::Vector2d px;       // without noise
  Eigen::Vector3d world_m;  // where the point was at its exposure
  double time_s = 0.0;      // of its exposure, after the first gyro stamp
  bool outlier = false;     // got a gross error
  bool moving = false;      // not part of the static scene
};

// Follows points of the scene from frame to frame, as TrackOptions has it. What it is made of has
// to outlive it.
class SimulatedTracker {
 public:
  SimulatedTracker(const Scenario& scenario, const SimulatedCamera& camera, const Scene& scene);

  // The next frame: its tracks, and what is true of each, at the end of both vectors.
  void Step(const FrameTiming& frame, std::vector<TrackedPoint>* tracks,
            std::vector<PointTruth>* truths);

 private:
  struct Landmark {
    int64_t id = 0;
    Eigen::Vector3d anchor_m;  // at `since_s`, less the surface's offset
    Eigen::Vector3d velocity_m_s =
        Eigen::Vector3d::Zero();  // of a moving point of the scene without surfaces
    double since_s = 0.0;
    int surface = -1;  // of the scene; -1: none
  };

  double Unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
  Eigen::Vector2d Noise(double sigma);
  Eigen::Vector3d PointAt(const Landmark& landmark, double time_s) const;
  double RandomDepth();
  // Pins a landmark to what the picture shows at a pixel: the scene's surface there, or the given
  // depth along the optical axis in a scene without surfaces.
  bool Anchor(const FrameTiming& frame, const Eigen::Vector2d& picture_px, double depth_m,
              Landmark* landmark) const;
  bool Spawn(const FrameTiming& frame, Landmark* landmark);
  bool Hidden(const SimulatedCamera::Observation& seen, const Eigen::Vector3d& point) const;
  bool Observe(const FrameTiming& frame, bool is_new, Landmark* landmark,
               std::vector<TrackedPoint>* tracks, std::vector<PointTruth>* truths);

  const Scenario& scenario_;
  const SimulatedCamera& camera_;
  const Scene& scene_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  Wander noise_wander_;
  double noise_px_ = 0.0;        // of this frame
  std::vector<Landmark> alive_;  // by ascending id
  int64_t next_id_ = 0;
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_TRACKER_H_
