#include "frontend/streaming_clock.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/time.h"

namespace camgyro {
namespace {

std::vector<GyroSample> Arrivals(double latency_s, double duration_s, double period_s) {
  std::mt19937 random(11);
  std::exponential_distribution<double> latency(1.0);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<GyroSample> samples;
  double last_s = 0.0;
  for (int i = 0; i * period_s < duration_s; ++i) {
    const double late_s = latency_s * (uniform(random) < 0.005 ? 20.0 : latency(random));
    last_s = std::max(last_s + 1e-6, i * period_s + late_s);
    samples.push_back({StampAt(5'000'000'000, last_s), {1.0 * i, 0.0, 0.0}});
  }
  return samples;
}

TEST(StreamingClock, LaysArrivalsOnTheirClock) {
  const double period_s = 5.01e-3;
  const std::vector<GyroSample> samples = Arrivals(1e-3, 60.0, period_s);
  StreamingClock clock;
  std::vector<GyroSample> passed;
  for (const GyroSample& sample : samples) {
    const size_t before = passed.size();
    clock.Add(sample, &passed);
    if (before > 0 && passed.size() > before) {  // not held back for long
      ASSERT_LT(SecondsSince(passed.back().stamp_ns, sample.stamp_ns), 0.6);
    }
  }
  ASSERT_TRUE(clock.report());
  EXPECT_TRUE(clock.report()->repaired);
  EXPECT_NEAR(clock.report()->period_s, period_s, 2e-5 * period_s);
  ASSERT_GT(passed.size(), samples.size() - static_cast<size_t>(0.6 / period_s));
  double sum = 0.0, squares = 0.0;
  for (size_t i = 0; i < passed.size(); ++i) {
    ASSERT_EQ(passed[i].omega_gyro_rad_s, samples[i].omega_gyro_rad_s);  // all, in their order
    ASSERT_TRUE(i == 0 || passed[i].stamp_ns > passed[i - 1].stamp_ns);
    const double error_s =
        SecondsSince(5'000'000'000, passed[i].stamp_ns) - static_cast<double>(i) * period_s;
    sum += error_s;
    squares += error_s * error_s;
  }
  const double n = static_cast<double>(passed.size());
  EXPECT_LT(std::sqrt(squares / n - sum * sum / (n * n)), 0.1e-3);
}

TEST(StreamingClock, CleanSamplesPassAtOnceAndUnchanged) {
  std::vector<GyroSample> samples = Arrivals(2e-6, 30.0, 5e-3);
  for (size_t i = 3000; i < samples.size(); ++i) samples[i].stamp_ns += 700'000'000;  // a gap
  StreamingClock clock;
  std::vector<GyroSample> passed;
  for (size_t i = 0; i < samples.size(); ++i) {
    clock.Add(samples[i], &passed);
    const bool known = SecondsSince(samples[0].stamp_ns, samples[i].stamp_ns) >= 2.0;
    ASSERT_EQ(passed.size(), known ? i + 1 : 0);
  }
  for (size_t i = 0; i < samples.size(); ++i) ASSERT_EQ(passed[i].stamp_ns, samples[i].stamp_ns);
  EXPECT_FALSE(clock.report()->repaired);
}

TEST(StreamingClock, BearsAnyStamps) {
  std::mt19937 random(12);
  std::uniform_int_distribution<int> kind(0, 99);
  StreamingClock clock;
  std::vector<GyroSample> passed;
  int64_t stamp_ns = -3'000'000'000;
  for (int i = 0; i < 30'000; ++i) {
    const int k = kind(random);
    stamp_ns += k == 0 ? 1'500'000'000 : k < 30 ? 0 : k * 100'000;
    clock.Add({stamp_ns, {1.0 * i, 0.0, 0.0}}, &passed);
  }
  for (size_t i = 1; i < passed.size(); ++i) {
    ASSERT_GT(passed[i].stamp_ns, passed[i - 1].stamp_ns);
    ASSERT_EQ(passed[i].omega_gyro_rad_s.x(), 1.0 * static_cast<double>(i));
  }
  EXPECT_GT(passed.size(), 29'000u);
}

}  // namespace
}  // namespace camgyro
