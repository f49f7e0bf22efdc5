#include "frontend/stamp_clock.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/stamp_rate.h"
#include "core/time.h"

namespace camgyro {
namespace {

// True sampling times of a sensor: its period drifts, some samples are missing.
struct Sensor {
  double rate_hz = 200.0, duration_s = 60.0;
  double drift_ppm = 50.0;       // change of the period from begin to end
  double missing_ratio = 0.002;  // of the samples
};

std::vector<double> SamplingTimes(const Sensor& sensor, std::mt19937* random) {
  std::bernoulli_distribution missing(sensor.missing_ratio);
  std::vector<double> times;
  const double period_s = 1.0 / sensor.rate_hz;
  for (double n = 0; n * period_s < sensor.duration_s; ++n) {
    const double t = n * period_s;
    const double drifted = t * (1.0 + 0.5e-6 * sensor.drift_ppm * t / sensor.duration_s);
    if (!missing(*random)) times.push_back(drifted);
  }
  return times;
}

// Arrivals of these samples, in order: a latency for each, some long ones that hold up what
// follows.
std::vector<int64_t> Arrivals(const std::vector<double>& times, double latency_s, double longest_s,
                              std::mt19937* random) {
  std::exponential_distribution<double> usual(1.0 / latency_s);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<int64_t> stamps;
  double last_s = 0.0;
  for (size_t i = 0; i < times.size(); ++i) {
    double late_s = usual(*random);
    if (uniform(*random) < 0.005) late_s = longest_s * uniform(*random);
    last_s = std::max(last_s + 2e-6, times[i] + late_s);
    stamps.push_back(StampAt(1'000'000'000'000, last_s));
  }
  return stamps;
}

// Deviation of found times from the true ones, about its mean, which is a delay [s].
double RmsError(const std::vector<int64_t>& found_ns, const std::vector<double>& times) {
  double sum = 0.0, squares = 0.0;
  for (size_t i = 0; i < times.size(); ++i) {
    const double error = SecondsSince(1'000'000'000'000, found_ns[i]) - times[i];
    sum += error;
    squares += error * error;
  }
  const double n = static_cast<double>(times.size());
  return std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)));
}

// The error is that of the lower envelope, and of missing samples that are found some samples too
// early or late: below a fifth of the recorded jitter, or 0.02 ms; at 1000 Hz with latencies of
// several periods, where missing samples cannot be told, six tenths of it.
TEST(StampClock, FindsTheClockBehindArrivals) {
  for (const double rate_hz : {25.0, 50.0, 100.0, 200.0, 400.0, 1000.0}) {
    for (const double latency_s : {1e-3, 3e-3}) {
      for (const double longest_s : {1e-3, 30e-3}) {
        SCOPED_TRACE(testing::Message() << rate_hz << " Hz, latency " << latency_s << " s, longest "
                                        << longest_s << " s");
        std::mt19937 random(7);
        Sensor sensor;
        sensor.rate_hz = rate_hz;
        const std::vector<double> times = SamplingTimes(sensor, &random);
        const std::vector<int64_t> stamps = Arrivals(times, latency_s, longest_s, &random);
        const StampClock clock = FindStampClock(stamps);
        ASSERT_EQ(clock.report.kind, StampKind::kArrival);
        ASSERT_EQ(clock.sampled_ns.size(), stamps.size());
        EXPECT_TRUE(std::is_sorted(clock.sampled_ns.begin(), clock.sampled_ns.end()));
        const double recorded_s = RmsError(stamps, times);
        const double allowed = rate_hz * latency_s < 1.0 || rate_hz < 400.0 ? 0.2 : 0.6;
        EXPECT_LT(RmsError(clock.sampled_ns, times), std::max(0.02e-3, allowed * recorded_s));
        EXPECT_NEAR(clock.report.jitter_s, recorded_s, 0.2 * recorded_s + 0.02e-3);
        if (allowed < 0.5) {
          const double mean_period_s = (1.0 + 0.5e-6 * sensor.drift_ppm) / rate_hz;
          EXPECT_NEAR(clock.report.period_s, mean_period_s, 1e-5 * mean_period_s);
          const double all = std::floor(sensor.duration_s * rate_hz);
          EXPECT_EQ(clock.report.missing, static_cast<int>(all) - static_cast<int>(times.size()));
        }
      }
    }
  }
}

// The clock's offset is the stamps' median latency, whatever their tail.
TEST(StampClock, MedianStampIsOnTime) {
  for (const double longest_s : {1e-3, 10e-3, 30e-3}) {
    SCOPED_TRACE(longest_s);
    std::mt19937 random(11);
    const std::vector<double> times = SamplingTimes({}, &random);
    const StampClock clock = FindStampClock(Arrivals(times, 1e-3, longest_s, &random));
    ASSERT_EQ(clock.sampled_ns.size(), times.size());
    double level_s = 0.0;
    for (size_t i = 0; i < times.size(); ++i) {
      level_s += SecondsSince(1'000'000'000'000, clock.sampled_ns[i]) - times[i];
    }
    level_s /= static_cast<double>(times.size());
    EXPECT_NEAR(level_s, std::log(2.0) * 1e-3, 0.1e-3);
    EXPECT_LT(clock.report.level_sigma_s, 0.05e-3);
    EXPECT_GT(clock.report.level_sigma_s, 2e-6);
  }
}

// The lower envelope of large latencies rises and falls by periods.
TEST(StampClock, FindsNoMissingSampleWhereNoneIs) {
  Sensor sensor;
  sensor.missing_ratio = 0.0;
  for (const double rate_hz : {100.0, 200.0, 400.0}) {
    for (const double latency_s : {3e-3, 10e-3, 30e-3}) {
      SCOPED_TRACE(testing::Message() << rate_hz << " Hz, latency " << latency_s << " s");
      sensor.rate_hz = rate_hz;
      int found = 0;
      for (unsigned seed = 0; seed < 10; ++seed) {
        std::mt19937 random(seed);
        const std::vector<double> times = SamplingTimes(sensor, &random);
        found += FindStampClock(Arrivals(times, latency_s, 30e-3, &random)).report.missing;
      }
      EXPECT_EQ(found, 0);
    }
  }
}

// The rate of a clock behind stamps of arrival is known as its sigma says, whatever the latencies;
// the squared error of 24 draws has a mean of 1 within 0.3, and the quantile lines of these are
// better known than those of Gaussian scatter, for which the sigma is made.
TEST(StampClock, RateIsKnownAsItsSigmaSays) {
  Sensor sensor;
  sensor.drift_ppm = 0.0;
  sensor.missing_ratio = 0.0;
  for (const double duration_s : {10.0, 20.0, 40.0}) {
    for (const double latency_s : {3e-3, 10e-3, 30e-3}) {
      SCOPED_TRACE(testing::Message() << duration_s << " s, latency " << latency_s << " s");
      sensor.duration_s = duration_s;
      double sum_sq = 0.0;
      constexpr int kDraws = 24;
      for (unsigned seed = 0; seed < kDraws; ++seed) {
        std::mt19937 random(seed);
        const std::vector<double> times = SamplingTimes(sensor, &random);
        const StampClock clock = FindStampClock(Arrivals(times, latency_s, 30e-3, &random));
        ASSERT_EQ(clock.report.kind, StampKind::kArrival);
        const double span_s = SecondsSince(clock.sampled_ns.front(), clock.sampled_ns.back());
        const double rate = span_s / (times.back() - times.front()) - 1.0;
        sum_sq += std::pow(rate / StampRateSigma(clock.report.residual_s, span_s), 2);
      }
      EXPECT_GT(sum_sq / kDraws, 0.25);
      EXPECT_LT(sum_sq / kDraws, 1.4);
    }
  }
}

// Latencies of 30 ms tell lines over 20 s to some milliseconds at their ends: the clock of a minute
// is one line, and not bent; small ones leave the clock free to drift.
TEST(StampClock, LinesAreLongWhereLatenciesAreLarge) {
  Sensor sensor;
  sensor.drift_ppm = 0.0;
  sensor.missing_ratio = 0.0;
  const auto bend_s = [&](double latency_s, double drift_ppm) {
    sensor.drift_ppm = drift_ppm;
    std::mt19937 random(3);
    const std::vector<double> times = SamplingTimes(sensor, &random);
    const StampClock clock = FindStampClock(Arrivals(times, latency_s, 30e-3, &random));
    if (clock.sampled_ns.size() != times.size()) return -1.0;
    const auto error_s = [&](size_t i) {
      return SecondsSince(1'000'000'000'000, clock.sampled_ns[i]) -
             static_cast<double>(i) / sensor.rate_hz;
    };
    const size_t last = 2 * ((times.size() - 1) / 2);
    return 0.5 * (error_s(0) + error_s(last)) - error_s(last / 2);
  };
  EXPECT_LT(std::abs(bend_s(30e-3, 0.0)), 1e-6);
  // A period that grows by 50 ppm in a minute bends by 50e-6 * 60 s / 8.
  EXPECT_NEAR(bend_s(1e-3, 50.0), 0.375e-3, 0.1e-3);
}

// Attitudes that a program has written when it came around to it: every 13th interval or so is a
// multiple of the period, up to 166 ms.
TEST(StampClock, KnowsACleanClockOfWhichManySamplesAreMissing) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<int64_t> stamps{0};
  int64_t number = 0;
  for (int i = 0; i < 6500; ++i) {
    number += uniform(random) < 0.08 ? 2 + static_cast<int64_t>(2.5 * uniform(random)) : 1;
    if (i == 3000) number += 32;
    const double quantised_s =
        30.5e-6 * std::round(5.0269e-3 * static_cast<double>(number) / 30.5e-6);
    stamps.push_back(StampAt(0, quantised_s));
  }
  const StampReport report = FindStampClock(stamps).report;
  EXPECT_EQ(report.kind, StampKind::kMeasured);
  EXPECT_NEAR(report.period_s, 5.0269e-3, 1e-7);
  EXPECT_EQ(report.missing, static_cast<int>(number) - 6500);
}

// The last samples of a stream may all be late, and nothing earlier follows: no sample is missing.
TEST(StampClock, LateSamplesAtTheEndAreNotMissingOnes) {
  Sensor sensor;
  sensor.duration_s = 20.0;
  sensor.drift_ppm = 0.0;
  sensor.missing_ratio = 0.0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const std::vector<double> times = SamplingTimes(sensor, &random);
    const StampClock clock = FindStampClock(Arrivals(times, 3e-3, 30e-3, &random));
    ASSERT_EQ(clock.sampled_ns.size(), times.size());
    EXPECT_EQ(clock.report.missing, 0);
    const size_t last = times.size() - 1;
    EXPECT_NEAR(SecondsSince(clock.sampled_ns[last - 100], clock.sampled_ns[last]),
                times[last] - times[last - 100], 0.1e-3);
  }
}

// A driver empties the sensor's buffer of eight samples now and then: all get the time of the last.
TEST(StampClock, LaysPacketsOnTheClock) {
  std::mt19937 random(3);
  Sensor sensor;
  const std::vector<double> times = SamplingTimes(sensor, &random);
  std::vector<int64_t> stamps = Arrivals(times, 0.2e-3, 1e-3, &random);
  for (size_t i = 0; i + 8 <= stamps.size(); i += 8) {
    std::fill_n(stamps.begin() + static_cast<std::ptrdiff_t>(i), 7, stamps[i + 7]);
  }
  const StampClock clock = FindStampClock(stamps);
  ASSERT_EQ(clock.report.kind, StampKind::kArrival);
  EXPECT_LT(RmsError(clock.sampled_ns, times), 0.5e-3);
  EXPECT_GT(clock.report.latest_s, 0.9 * 7 / sensor.rate_hz);
}

// Packets of eight, whose samples are stamped a microsecond after each other as they are read out:
// no clock of 1 MHz that has lost nearly all of its samples.
TEST(StampClock, KnowsPacketsThatAreStampedInMicroseconds) {
  std::vector<int64_t> stamps;
  for (int64_t i = 0; i < 4000; ++i)
    stamps.push_back(5'000'000 * (8 * (i / 8) + 7) + 1000 * (i % 8));
  const StampClock clock = FindStampClock(stamps);
  EXPECT_EQ(clock.report.kind, StampKind::kArrival);
  EXPECT_NEAR(clock.report.period_s, 5e-3, 1e-8);
  ASSERT_EQ(clock.sampled_ns.size(), stamps.size());
  for (size_t i = 1; i < stamps.size(); ++i) {
    EXPECT_NEAR(SecondsSince(clock.sampled_ns[i - 1], clock.sampled_ns[i]), 5e-3, 1e-6);
  }
}

// A pause is no such packet, however long it is.
TEST(StampClock, LeavesAPauseAlone) {
  std::vector<int64_t> stamps;
  for (int64_t i = 0; i < 800; ++i)
    stamps.push_back(33'333'333LL * i + (i < 400 ? 0 : 1'000'000'000'000));
  const StampReport report = FindStampClock(stamps).report;
  EXPECT_EQ(report.kind, StampKind::kMeasured);
  EXPECT_NEAR(report.period_s, 33.333333e-3, 0.01e-3);
}

TEST(StampClock, LeavesCleanClocksAlone) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> rounding(-0.5, 0.5);
  for (const double rate_hz : {25.0, 200.0, 1000.0}) {
    SCOPED_TRACE(rate_hz);
    Sensor sensor;
    sensor.rate_hz = rate_hz;
    sensor.drift_ppm = 300.0;
    std::vector<double> times = SamplingTimes(sensor, &random);
    for (double& t : times) t += 0.003 / rate_hz * rounding(random);  // rounded
    for (size_t i = times.size() / 3; i < times.size(); ++i) {
      times[i] += 0.33 + 1.4 / rate_hz;  // a gap
    }
    for (size_t i = times.size() / 2; i < times.size(); ++i) times[i] += 0.3 / rate_hz;  // a step
    std::vector<int64_t> stamps;
    for (const double t : times) stamps.push_back(StampAt(0, t));
    const StampClock clock = FindStampClock(stamps);
    EXPECT_EQ(clock.report.kind, StampKind::kMeasured);
    EXPECT_TRUE(clock.sampled_ns.empty());
    EXPECT_NEAR(clock.report.period_s, 1.0 / rate_hz, 1e-3 / rate_hz);
  }
}

// A program that asks the sensor, works for a while and asks again: the stamps are right, and there
// is no clock.
TEST(StampClock, MakesNoClockOfIrregularSampling) {
  std::mt19937 random(6);
  std::exponential_distribution<double> work(1.0 / 2e-3);
  std::vector<int64_t> stamps{0};
  for (int i = 0; i < 6000; ++i) stamps.push_back(StampAt(stamps.back(), 3e-3 + work(random)));
  const StampClock clock = FindStampClock(stamps);
  EXPECT_EQ(clock.report.kind, StampKind::kIrregular);
  EXPECT_TRUE(clock.sampled_ns.empty());
}

TEST(StampClock, BearsAnyStamps) {
  std::mt19937 random(8);
  std::uniform_int_distribution<int64_t> step(0, 3'000'000'000);
  for (const size_t count : {0, 1, 2, 39, 40, 41, 500}) {
    std::vector<int64_t> stamps(count, 17);  // all the same
    EXPECT_EQ(FindStampClock(stamps).report.kind, StampKind::kMeasured);
    for (size_t i = 1; i < count; ++i)
      stamps[i] = stamps[i - 1] + step(random) % (1 + step(random));
    const StampClock clock = FindStampClock(stamps);
    EXPECT_TRUE(std::isfinite(clock.report.period_s));
    EXPECT_TRUE(std::is_sorted(clock.sampled_ns.begin(), clock.sampled_ns.end()));
  }
}

// Rates foretell each other best at the times at which they were taken.
TEST(StampClock, RightStampsForetellRatesBetter) {
  std::mt19937 random(9);
  Sensor sensor;
  const std::vector<double> times = SamplingTimes(sensor, &random);
  std::vector<GyroSample> samples;
  std::vector<int64_t> right;
  for (const double t : times) {
    samples.push_back({0, Eigen::Vector3d(std::sin(9.0 * t), std::cos(7.0 * t), 0.0)});
    right.push_back(StampAt(1'000'000'000'000, t));
  }
  const std::vector<int64_t> late = Arrivals(times, 1e-3, 30e-3, &random);
  EXPECT_LT(InterpolationError(samples, right), 0.1 * InterpolationError(samples, late));
}

}  // namespace
}  // namespace camgyro
