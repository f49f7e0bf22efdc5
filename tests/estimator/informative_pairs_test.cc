#include "estimator/informative_pairs.h"

#include <gmock/gmock.h>

#include <cmath>

namespace camgyro {
namespace {

// 100 s of a camera at 10 pairs/s that rests, but for 10 s of turns about one axis, x, and 2 s
// about y.
EstimationInput Turns() {
  EstimationInput input;
  for (int i = 0; i <= 20000; ++i) {
    TimedRate rate;
    rate.time_s = 0.005 * i;
    const double sine = std::sin(6.0 * rate.time_s);
    if (rate.time_s > 30.0 && rate.time_s < 40.0) rate.omega_gyro_rad_s.x() = sine;
    if (rate.time_s > 70.0 && rate.time_s < 72.0) rate.omega_gyro_rad_s.y() = sine;
    input.rates.push_back(rate);
  }
  for (int i = 0; i < 990; ++i) {
    TimedPair pair;
    pair.id = i;
    pair.time_a_s = 0.1 * i;
    pair.time_b_s = 0.1 * (i + 1);
    pair.num_matches = 50;
    input.pairs.push_back(pair);
  }
  return input;
}

int CountWithin(const std::vector<TimedPair>& pairs, double from_s, double to_s) {
  int count = 0;
  for (const TimedPair& pair : pairs) count += pair.time_a_s >= from_s && pair.time_b_s <= to_s;
  return count;
}

TEST(InformativePairs, AreAllOfAShortRecording) {
  EXPECT_EQ(InformativePairs(Turns(), 0.0, {990}).size(), 990u);
}

// Both seconds about y, though there are few of them, and nothing of the rest.
TEST(InformativePairs, AreWhereTheCameraTurnsAboutEveryAxis) {
  const std::vector<TimedPair> kept = InformativePairs(Turns(), 0.0, {80});
  EXPECT_LE(kept.size(), 80u);
  EXPECT_GE(kept.size(), 60u);
  EXPECT_GE(CountWithin(kept, 70.0, 72.0), 15);
  EXPECT_GE(CountWithin(kept, 29.0, 41.0), 40);
  for (size_t i = 1; i < kept.size(); ++i) EXPECT_GT(kept[i].id, kept[i - 1].id);
}

// Of memory, too: a tenth of what all take leaves a tenth of the pairs, as they are alike, in whole
// stretches of ten.
TEST(InformativePairs, StayWithinTheirMemory) {
  const EstimationInput input = Turns();
  double all = 0.0;
  for (const TimedPair& pair : input.pairs) all += RefinementBytes(pair, {});
  // Of a match: twice its 20 + 3 (4 + 0.1 s / 0.025 s) derivatives, and four times itself. Of a
  // pair: half of their products, twice.
  EXPECT_NEAR(all, 990.0 * (50.0 * (2.0 * 44.0 * 8.0 + 4.0 * sizeof(Match)) + 44.0 * 44.0 * 8.0),
              1e-6 * all);
  PairLimits limits;
  limits.bytes = all;
  EXPECT_EQ(InformativePairs(input, 0.0, limits).size(), 990u);
  limits.bytes = 0.1 * all;
  const std::vector<TimedPair> kept = InformativePairs(input, 0.0, limits);
  EXPECT_LE(kept.size(), 99u);
  EXPECT_GE(kept.size(), 80u);
  double taken = 0.0;
  for (const TimedPair& pair : kept) taken += RefinementBytes(pair, {});
  EXPECT_LE(taken, limits.bytes);
}

TEST(BytesOfRecording, CountsPointsAndSamples) {
  Recording recording;
  recording.tracks.assign(1000, std::vector<TrackedPoint>(150));
  EXPECT_EQ(BytesOf(recording), 32.0 * 150000.0);
  recording.gyro.resize(100);
  EXPECT_GT(BytesOf(recording), 32.0 * 150000.0 + 100.0 * sizeof(GyroSample));
}

// The frames' stamps are 5 s early.
TEST(InformativePairs, KnowTheDelay) {
  const std::vector<TimedPair> kept = InformativePairs(Turns(), 5.0, {80});
  EXPECT_GE(CountWithin(kept, 65.0, 67.0), 15);
  EXPECT_GE(CountWithin(kept, 24.0, 36.0), 40);
}

}  // namespace
}  // namespace camgyro
