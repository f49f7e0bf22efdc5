// A pair of rolling-shutter frames with exact matches, for the tests of the coplanarity factors.
#ifndef CAMGYRO_TESTS_FACTORS_PAIR_SCENE_H_
#define CAMGYRO_TESTS_FACTORS_PAIR_SCENE_H_

#include <gmock/gmock.h>

#include <functional>
#include <memory>
#include <random>

#include "core/so3.h"
#include "factors/pair_bearings.h"

namespace camgyro {

struct PairScene {
  std::shared_ptr<PairMeasurement> pair = std::make_shared<PairMeasurement>();
  LensParameters lens;
  ShutterParameters shutter;
  Eigen::Quaterniond q_gyro_cam;
  Eigen::Vector3d tau;  // unit, in the reference (gyro frame at the first rate)
  Eigen::Matrix<double, 6, 1> bend = Eigen::Matrix<double, 6, 1>::Zero();
  std::vector<Eigen::Matrix3Xd> rate_groups;
  Eigen::Vector2d times_s = Eigen::Vector2d::Zero();  // of the frames from their stamps

  // Parameter pointers in the order of CoplanarityPlane, or without tau.
  std::vector<double*> Parameters(bool with_tau = true) {
    std::vector<double*> p = {lens.data(), shutter.data(), q_gyro_cam.coeffs().data()};
    if (with_tau) {
      p.push_back(tau.data());
      p.push_back(bend.data());
    }
    if (pair->own_times) {
      p.push_back(&times_s[0]);
      p.push_back(&times_s[1]);
    }
    for (auto& group : rate_groups) p.push_back(group.data());
    return p;
  }
};

// Camera that turns with random rates and moves along tau at 1 m/s past points at 1.5-20 m, on a
// straight path but for the detour (of the time from the first exposure, in the reference) [m].
// Every parameter is non-zero, so that each term of the derivatives counts. Matches are exact.
inline PairScene MakePairScene(
    uint64_t seed, int num_matches = 12,
    const std::function<Eigen::Vector3d(double)>& detour = [](double) {
      return Eigen::Vector3d(Eigen::Vector3d::Zero());
    }) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  // One draw after the other: in which order arguments are evaluated is the compiler's choice.
  const auto random_vector = [&] {
    const double z = normal(generator), y = normal(generator), x = normal(generator);
    return Eigen::Vector3d(x, y, z);
  };
  PairScene s;
  s.lens = MakePinhole(460.0, {370.0, 245.0}, 1.003);
  s.lens.segment<4>(kK1) << -0.28, 0.07, 0.001, -0.002;
  s.shutter << 0.025, 0.006;
  s.q_gyro_cam = Exp(random_vector());
  s.tau = random_vector().normalized();
  s.pair->frame_a.stamp_s = 1.0;
  s.pair->frame_b.stamp_s = 1.0 + 1.0 / 30;
  s.pair->size_px << 752.0, 480.0;
  s.pair->sigma = 0.5;
  s.pair->readout_over_gap = 0.75;
  s.pair->lens = &GetLens(DistortionModel::kRadTan);
  s.pair->rate_group_sizes = {6, 7, 3};
  Eigen::Matrix3Xd rates(3, 16);
  Eigen::Vector3d rate = random_vector();
  for (int i = 0; i < 16; ++i) {
    s.pair->rate_times_s.push_back(1.0 + 0.005 * i);
    rate += 0.15 * random_vector();
    rates.col(i) = rate;
  }
  int column = 0;
  for (const int size : s.pair->rate_group_sizes) {
    s.rate_groups.emplace_back(rates.middleCols(column, size));
    column += size;
  }
  const RotationChain chain(s.pair->rate_times_s, rates);
  const auto project = [&](const Eigen::Vector3d& point_ref, double stamp_s) {
    double v = 240.0;
    Eigen::Vector2d px(0, 0);
    for (int i = 0; i < 30; ++i) {  // the row decides the time, the time decides the row
      const double t = stamp_s + s.shutter[kDelay] + s.shutter[kReadout] * v / 480.0;
      const Eigen::Matrix3d R_ref_cam = chain.At(t).R_ref_gyro * s.q_gyro_cam.toRotationMatrix();
      const auto projected = s.pair->lens->Project(
          R_ref_cam.transpose() * (point_ref - (t - 1.0) * s.tau - detour(t - 1.0)), s.lens);
      if (!projected) return std::optional<Eigen::Vector2d>();
      px = *projected;
      v = px.y();
    }
    return std::optional<Eigen::Vector2d>(px);
  };
  const Eigen::Matrix3d R_ref_cam_middle =
      chain.At(1.03).R_ref_gyro * s.q_gyro_cam.toRotationMatrix();
  while (static_cast<int>(s.pair->matches.size()) < num_matches) {
    RayJet jet;
    const double down = uniform(generator), right = uniform(generator);
    const Eigen::Vector2d start(40 + 670 * right, 30 + 420 * down);
    if (!s.pair->lens->Unproject(start, s.lens, &jet)) continue;
    const double depth = 1.5 + 18.5 * uniform(generator);
    const Eigen::Vector3d point = R_ref_cam_middle * (depth * jet.ray);
    const auto a = project(point, s.pair->frame_a.stamp_s),
               b = project(point, s.pair->frame_b.stamp_s);
    if (a && b) s.pair->matches.push_back({*a, *b});
  }
  return s;
}

// Moves every parameter and match a little off the truth: derivatives are then probed away from
// zero residual, where approximations would show.
inline void Disturb(uint64_t seed, PairScene* s) {
  std::mt19937_64 generator(seed + 1000);
  std::normal_distribution<double> normal;
  s->lens[kFocal] += 5 * normal(generator);
  s->lens[kCx] += 4 * normal(generator);
  s->lens[kK1] += 0.01 * normal(generator);
  s->shutter[kDelay] += 0.002 * normal(generator);
  s->shutter[kReadout] += 0.003 * normal(generator);
  s->q_gyro_cam = s->q_gyro_cam * Exp(Eigen::Vector3d(0.02, -0.03, 0.01));
  s->tau = (s->tau + 0.1 * Eigen::Vector3d{normal(generator), normal(generator), normal(generator)})
               .normalized();
  s->bend << 0.2, -0.1, 0.15, -0.05, 0.1, 0.03;
  for (Match& match : s->pair->matches) {
    match.px_a += 0.3 * Eigen::Vector2d{normal(generator), normal(generator)};
    match.px_b += 0.3 * Eigen::Vector2d{normal(generator), normal(generator)};
  }
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FACTORS_PAIR_SCENE_H_
