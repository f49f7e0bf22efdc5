// What the camera looks at: surfaces that a ray can meet.
#ifndef CAMGYRO_SIMULATION_SCENE_H_
#define CAMGYRO_SIMULATION_SCENE_H_

#include <Eigen/Core>
#include <optional>
#include <random>
#include <vector>

#include "simulation/scenario.h"

namespace camgyro::simulation {

enum class Shape { kGround, kWall, kBox, kRoom, kDome };

struct Surface {
  Shape shape = Shape::kBox;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  // ground: its y; wall: its z
  Eigen::Vector3d half_m = Eigen::Vector3d::Zero();    // box, room: half sizes; dome: radius in x
  // Moving boxes: offset(t) = swing sin(rate t + phase).
  Eigen::Vector3d swing_m = Eigen::Vector3d::Zero();
  double swing_rate_rad_s = 0.0, swing_phase_rad = 0.0;
  double tile_m = 4.0;  // size of one tile of the texture
  int texture = 0;      // surfaces of one number share a texture
  Eigen::Vector2d texture_shift = Eigen::Vector2d::Zero();
  bool moving() const { return !swing_m.isZero(0.0); }
};

struct Hit {
  double distance = 0.0;  // in units of the ray's direction
  int surface = 0;
  int face = 0;  // axis of the normal, 0..2; 3: dome
};

class Scene {
 public:
  // Without surfaces for SceneKind::kPoints.
  static Scene Make(const SceneOptions& options, std::mt19937_64* random);

  const std::vector<Surface>& surfaces() const { return surfaces_; }

  // Displacement of a surface at a time [m]; zero unless it moves.
  Eigen::Vector3d Offset(int surface, double time_s) const;

  // Nearest surface that origin + distance * direction meets, distance > 0.
  std::optional<Hit> Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                          double time_s) const;

  // Distance to one surface; nothing if the ray misses it.
  std::optional<Hit> CastSurface(int surface, const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction, double time_s) const;

 private:
  std::vector<Surface> surfaces_;
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_SCENE_H_
