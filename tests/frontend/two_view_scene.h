// Two pictures of random points, made without any of the code under test but the lens.
#ifndef CAMGYRO_TESTS_FRONTEND_TWO_VIEW_SCENE_H_
#define CAMGYRO_TESTS_FRONTEND_TWO_VIEW_SCENE_H_

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "core/lens.h"
#include "core/recording.h"

namespace camgyro {

struct TwoViewScene {
  static constexpr int kWidth = 640, kHeight = 480;
  LensParameters lens = MakePinhole(500.0, {322.0, 237.0}, 1.01);
  Eigen::Quaterniond q_a_b = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_a = Eigen::Vector3d::Zero();  // centre of camera b [m]
  double noise_px = 0.0;                          // of both images
  double near_m = 2.0, far_m = 20.0;

  FramePair Make(int num_matches, unsigned seed) const {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::normal_distribution<double> normal;
    const Lens& model = GetLens(DistortionModel::kNone);
    FramePair pair;
    pair.frame_b = 1;
    while (static_cast<int>(pair.matches.size()) < num_matches) {
      const Eigen::Vector2d px_a(unit(generator) * kWidth, unit(generator) * kHeight);
      const double depth = 1.0 / (1.0 / far_m + unit(generator) * (1.0 / near_m - 1.0 / far_m));
      RayJet jet;
      if (!model.Unproject(px_a, lens, &jet)) continue;
      const auto px_b = model.Project(q_a_b.conjugate() * (depth * jet.ray - p_a), lens);
      if (!px_b || px_b->x() < 0 || px_b->y() < 0 || px_b->x() > kWidth || px_b->y() > kHeight) {
        continue;
      }
      const auto noise = [&] {
        return Eigen::Vector2d(noise_px * Eigen::Vector2d{normal(generator), normal(generator)});
      };
      pair.matches.push_back({px_a + noise(), *px_b + noise()});
    }
    return pair;
  }
};

// Moves every `stride`-th match's second position by 15 to 40 px; returns which.
inline std::vector<bool> SpoilMatches(size_t stride, unsigned seed, FramePair* pair) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> angle(0.0, 2.0 * M_PI), length(15.0, 40.0);
  std::vector<bool> spoiled(pair->matches.size(), false);
  for (size_t i = 0; i < pair->matches.size(); i += stride) {
    const double direction = angle(generator);
    pair->matches[i].px_b +=
        length(generator) * Eigen::Vector2d(std::cos(direction), std::sin(direction));
    spoiled[i] = true;
  }
  return spoiled;
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FRONTEND_TWO_VIEW_SCENE_H_
