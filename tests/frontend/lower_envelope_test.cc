#include "frontend/lower_envelope.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

namespace camgyro {
namespace {

using testing::ElementsAre;

TEST(LowerEnvelope, IsTheLeastOfSomeValues) {
  const std::vector<double> values = {3.0, 1.0, 4.0, 1.5, 9.0};
  EXPECT_THAT(ForwardMinimum(values, 1), ElementsAre(1.0, 1.0, 1.5, 1.5, 9.0));
  EXPECT_THAT(BackwardMinimum(values, 1), ElementsAre(3.0, 1.0, 1.0, 1.5, 1.5));
  EXPECT_THAT(ForwardMinimum(values, 9), ElementsAre(1.0, 1.0, 1.5, 1.5, 9.0));
  EXPECT_EQ(Quantile(values, 0.0), 1.0);
  EXPECT_EQ(Quantile(values, 0.5), 3.0);
  EXPECT_EQ(Quantile(values, 1.0), 9.0);
}

// Latencies that are small beside the period: a rise by a little more than half of it is a missing
// sample, however fast the clock. Larger ones are looked at for longer, and need more.
TEST(LowerEnvelope, RisesByChanceAreNoMissingSample) {
  constexpr double kPeriodS = 5e-3;
  const auto envelope = [&](double latency_s, double rate) {
    std::mt19937 random(1);
    std::exponential_distribution<double> latency(1.0 / latency_s);
    std::vector<double> late;
    double last_s = 0.0;
    for (int i = 0; i < 12000; ++i) {
      last_s = std::max(last_s, i * kPeriodS + latency(random));  // in order
      late.push_back(last_s - i * kPeriodS * (1.0 - rate));
    }
    return EnvelopeToCome(late, kPeriodS);
  };
  const Envelope small = envelope(1e-3, 0.0);
  EXPECT_EQ(small.ahead, 50u);
  EXPECT_DOUBLE_EQ(small.rise, 0.6 * kPeriodS);
  EXPECT_DOUBLE_EQ(envelope(1e-3, 2e-3).rise, 0.6 * kPeriodS);
  const Envelope large = envelope(10e-3, 0.0);
  EXPECT_GT(large.ahead, 50u);
  const Envelope larger = envelope(30e-3, 0.0);
  EXPECT_GT(larger.rise, 2.0 * kPeriodS);
  for (const Envelope& one : {large, larger}) {
    double most = 0.0;
    for (size_t i = one.ahead + 1; i < one.least.size(); ++i) {
      most = std::max(most, one.least[i] - one.least[i - one.ahead - 1]);
    }
    EXPECT_LT(most, one.rise);
  }
}

}  // namespace
}  // namespace camgyro
