#include "simulation/scene.h"

#include <cmath>
#include <limits>

namespace camgyro::simulation {
namespace {

using Eigen::Vector3d;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class Builder {
 public:
  explicit Builder(std::mt19937_64* random) : random_(random) {}

  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(*random_);
  }

  Surface& Add(Shape shape, const Vector3d& centre, const Vector3d& half, double tile_m) {
    Surface surface;
    surface.shape = shape;
    surface.centre_m = centre;
    surface.half_m = half;
    surface.tile_m = tile_m;
    surface.texture_shift = {Uniform(0.0, 1.0), Uniform(0.0, 1.0)};
    surfaces.push_back(surface);
    return surfaces.back();
  }

  void AddMoving(const Vector3d& centre, const Vector3d& half, double speed_m_s) {
    Surface& box = Add(Shape::kBox, centre, half, 1.5);
    const double direction = Uniform(0.0, 2.0 * M_PI), period_s = Uniform(3.0, 6.0);
    box.swing_rate_rad_s = 2.0 * M_PI / period_s;
    box.swing_phase_rad = Uniform(0.0, 2.0 * M_PI);
    // The rms of the speed is what was asked for.
    box.swing_m = Vector3d(std::cos(direction), 0.0, std::sin(direction)) * std::sqrt(2.0) *
                  speed_m_s / box.swing_rate_rad_s;
  }

  // A wall of the corridor, from `begin` over `length_m` along x (axis 0) or z (2), hung with
  // pictures that occur nowhere else: without them one stretch would look like any other. In front
  // of each, if `furniture_side` is not 0, a box stands on that side.
  void AddPanels(const Vector3d& begin, int axis, double length_m, double height_m,
                 double furniture_side) {
    constexpr double kPanelM = 5.0, kThickM = 0.02;
    const int count = static_cast<int>(std::ceil(length_m / kPanelM));
    const double half_m = 0.5 * length_m / count;
    const int across = 2 - axis;
    for (int i = 0; i < count; ++i) {
      Vector3d centre = begin, half(0.0, 0.5 * height_m, 0.0);
      centre[axis] += (2 * i + 1) * half_m;
      half[axis] = half_m;
      half[across] = kThickM;
      Add(Shape::kBox, centre, half, std::max(2.0 * half_m, height_m)).texture = ++textures_;
      const double tall_m = Uniform(0.2, 0.4) * height_m, wide_m = Uniform(0.2, 0.4);
      const double place = Uniform(-0.7, 0.7), deep_m = Uniform(0.15, 0.3);
      if (furniture_side == 0.0) continue;
      centre[axis] += place * half_m;
      centre[across] += furniture_side * deep_m;
      centre.y() = begin.y() + 0.5 * height_m - tall_m;
      half[axis] = wide_m;
      half[across] = deep_m;
      half.y() = tall_m;
      Add(Shape::kBox, centre, half, 2.0).texture = ++textures_;
    }
  }

  std::vector<Surface> surfaces;

 private:
  int textures_ = 0;
  std::mt19937_64* random_;
};

// A way round a block inside a room. One tile of texture covers the floor: a pattern that repeats
// would show the same at many places.
void AddCorridor(const SceneOptions& options, Builder* build) {
  const Vector3d half = 0.5 * options.room_m;
  const Eigen::Vector2d block = 0.5 * options.block_m;
  const double height_m = options.room_m.y();
  build->Add(Shape::kRoom, Vector3d::Zero(), half, 2.0 * half.maxCoeff());
  for (const double side : {-1.0, 1.0}) {
    build->AddPanels({-half.x(), 0.0, side * half.z()}, 0, 2.0 * half.x(), height_m, -side);
    build->AddPanels({side * half.x(), 0.0, -half.z()}, 2, 2.0 * half.z(), height_m, -side);
    build->AddPanels({-block.x(), 0.0, side * block.y()}, 0, 2.0 * block.x(), height_m, 0.0);
    build->AddPanels({side * block.x(), 0.0, -block.y()}, 2, 2.0 * block.y(), height_m, 0.0);
  }
}

}  // namespace

Scene Scene::Make(const SceneOptions& options, std::mt19937_64* random) {
  Builder build(random);
  const Vector3d none = Vector3d::Zero();
  const double tile_far = options.far_m;  // 1 rad of the dome
  Vector3d moving_low(-6.0, 0.0, 4.0), moving_high(6.0, 0.0, 12.0);
  double floor_y = options.ground_m;
  switch (options.kind) {
    case SceneKind::kPoints:
      return {};
    case SceneKind::kGround:
      build.Add(Shape::kGround, {0.0, options.ground_m, 0.0}, none, 3.0);
      build.Add(Shape::kDome, none, {options.far_m, 0.0, 0.0}, tile_far);
      break;
    case SceneKind::kMountains:
      build.Add(Shape::kGround, {0.0, 0.05 * options.far_m, 0.0}, none, 0.2 * options.far_m);
      build.Add(Shape::kDome, none, {options.far_m, 0.0, 0.0}, tile_far);
      break;
    case SceneKind::kCorridor:
      floor_y = 0.5 * options.room_m.y();
      break;
    case SceneKind::kFacade: {
      const double wall = options.distance_m;
      build.Add(Shape::kGround, {0.0, options.ground_m, 0.0}, none, 3.0);
      build.Add(Shape::kDome, none, {options.far_m, 0.0, 0.0}, tile_far);
      build.Add(Shape::kWall, {0.0, 0.0, wall}, none, 5.0);
      for (double x = -120.0; x < 120.0; x += 5.0) {
        const double depth = build.Uniform(0.3, 0.8), y = build.Uniform(-3.0, -1.0);  // balconies
        build.Add(Shape::kBox, {x + build.Uniform(0.0, 2.0), y, wall - depth},
                  {build.Uniform(0.8, 1.5), 0.5, depth}, 3.0);
        const double height = build.Uniform(0.4, 1.2);  // things in the street
        build.Add(Shape::kBox,
                  {x + build.Uniform(0.0, 4.0), options.ground_m - height,
                   build.Uniform(0.4, 0.8) * wall},
                  {build.Uniform(0.2, 0.6), height, 0.3}, 2.0);
      }
      moving_low.z() = 0.4 * wall;
      moving_high.z() = 0.8 * wall;
      break;
    }
    case SceneKind::kRoom: {
      const Vector3d half = 0.5 * options.room_m;
      floor_y = half.y();
      build.Add(Shape::kRoom, none, half, 3.0);
      for (int i = 0; i < 8; ++i) {  // furniture along the four walls
        const double height = build.Uniform(0.3, 0.9), depth = build.Uniform(0.2, 0.4);
        const double width = build.Uniform(0.3, 0.7), along = build.Uniform(-0.8, 0.8);
        const double side = i % 2 == 0 ? 1.0 : -1.0;
        if (i % 4 < 2) {
          build.Add(Shape::kBox, {side * (half.x() - depth), floor_y - height, along * half.z()},
                    {depth, height, width}, 2.0);
        } else {
          build.Add(Shape::kBox, {along * half.x(), floor_y - height, side * (half.z() - depth)},
                    {width, height, depth}, 2.0);
        }
      }
      moving_high = {0.7 * half.x(), 0.0, 0.8 * half.z()};
      moving_low = {-0.7 * half.x(), 0.0, 0.4 * half.z()};
      break;
    }
  }
  if (options.kind == SceneKind::kCorridor) AddCorridor(options, &build);
  for (int i = 0; i < options.moving_objects; ++i) {
    const double height = build.Uniform(0.4, 0.9);
    build.AddMoving({build.Uniform(moving_low.x(), moving_high.x()), floor_y - height,
                     build.Uniform(moving_low.z(), moving_high.z())},
                    {build.Uniform(0.2, 0.5), height, build.Uniform(0.2, 0.5)},
                    options.moving_speed_m_s);
  }
  Scene scene;
  scene.surfaces_ = std::move(build.surfaces);
  return scene;
}

Vector3d Scene::Offset(int surface, double time_s) const {
  const Surface& s = surfaces_[static_cast<size_t>(surface)];
  if (!s.moving()) return Vector3d::Zero();
  return s.swing_m * std::sin(s.swing_rate_rad_s * time_s + s.swing_phase_rad);
}

std::optional<Hit> Scene::CastSurface(int index, const Vector3d& origin, const Vector3d& direction,
                                      double time_s) const {
  const Surface& s = surfaces_[static_cast<size_t>(index)];
  const auto positive = [&](double distance, int face) -> std::optional<Hit> {
    if (!(distance > 1e-6) || distance == kInfinity) return std::nullopt;
    return Hit{distance, index, face};
  };
  Vector3d from = origin - s.centre_m;
  if (s.moving()) from -= Offset(index, time_s);
  switch (s.shape) {
    case Shape::kGround:
      return positive(-from.y() / direction.y(), 1);
    case Shape::kWall:
      return positive(-from.z() / direction.z(), 2);
    case Shape::kDome: {
      const double a = direction.squaredNorm(), b = from.dot(direction);
      const double c = from.squaredNorm() - s.half_m.x() * s.half_m.x();
      const double root = b * b - a * c;
      if (root < 0.0) return std::nullopt;
      return positive((-b + std::sqrt(root)) / a, 3);
    }
    case Shape::kBox:
    case Shape::kRoom: {
      // Slabs: the ray is inside from `enter` to `leave`.
      double enter = -kInfinity, leave = kInfinity;
      int enter_face = 0, leave_face = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double inverse = 1.0 / direction[axis];
        const double a = (-s.half_m[axis] - from[axis]) * inverse;
        const double b = (s.half_m[axis] - from[axis]) * inverse;
        const double near = a < b ? a : b, far = a < b ? b : a;
        if (near > enter) enter = near, enter_face = axis;
        if (far < leave) leave = far, leave_face = axis;
      }
      if (!(enter < leave)) return std::nullopt;
      return s.shape == Shape::kBox ? positive(enter, enter_face) : positive(leave, leave_face);
    }
  }
  return std::nullopt;
}

std::optional<Hit> Scene::Cast(const Vector3d& origin, const Vector3d& direction,
                               double time_s) const {
  std::optional<Hit> nearest;
  for (int i = 0; i < static_cast<int>(surfaces_.size()); ++i) {
    const std::optional<Hit> hit = CastSurface(i, origin, direction, time_s);
    if (hit && (!nearest || hit->distance < nearest->distance)) nearest = hit;
  }
  return nearest;
}

}  // namespace camgyro::simulation
