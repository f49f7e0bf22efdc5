// The reference that stands in for the truth where only the calibration is known.
#include "tools/vins_tables/motion_truth.h"

#include <gmock/gmock.h>

#include "core/time.h"
#include "tools/vins_tables/vins_tables.h"

namespace camgyro {
namespace {

// From -> to as seen from the gyro frame at `from`: independent of the world.
struct Seen {
  Eigen::Vector3d velocity, moved, gravity;
};
Seen Between(const MotionTruth::Stretch& at, int64_t from_ns, int64_t to_ns) {
  const MotionState from = at(from_ns), to = at(to_ns);
  const Eigen::Quaterniond q = from.state.q_world_gyro.conjugate();
  return {q * from.state.v_world_m_s, q * (to.state.p_world_m - from.state.p_world_m),
          q * from.gravity_m_s2};
}

TEST(FittedTruth, AgreesWithTheSimulation) {
  const auto r = SimulateWithTruth(
      "walk", {"motion.kind=walking", "duration_s=12.5", "tracks.noise_px=0.3", "tracks.count=60"});
  ASSERT_TRUE(r) << r.error().message;
  double sigma_m_s = 0.0;
  const auto fitted = FittedTruth(r->recording, r->truth, r->options, 12.0, 2.0, &sigma_m_s);
  EXPECT_GT(sigma_m_s, 0.0);
  EXPECT_LT(sigma_m_s, 0.02);
  const int64_t begin_ns = r->recording.frames.front().stamp_ns;
  const int64_t from_ns = StampAt(begin_ns, 1.03), to_ns = StampAt(begin_ns, 11.51);
  const auto a = r->motion->Over(from_ns, to_ns), b = fitted->Over(from_ns, to_ns);
  ASSERT_TRUE(a && b);
  const Seen truth = Between(*a, from_ns, to_ns), fit = Between(*b, from_ns, to_ns);
  EXPECT_LT((truth.velocity - fit.velocity).norm(), 0.02);
  EXPECT_LT((truth.moved - fit.moved).norm(), 0.15);  // over 14 m
  EXPECT_LT((truth.gravity - fit.gravity).norm(), 0.03);
  EXPECT_FALSE(fitted->Over(from_ns, StampAt(to_ns, 5.0)));  // does not reach
}

}  // namespace
}  // namespace camgyro
