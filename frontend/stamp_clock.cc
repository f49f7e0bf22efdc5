#include "frontend/stamp_clock.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "core/format.h"
#include "core/robust_statistics.h"
#include "core/stamp_rate.h"
#include "core/time.h"
#include "frontend/lower_envelope.h"
#include "frontend/quantile_line.h"

namespace camgyro {
namespace {

constexpr size_t kFewestStamps = 40;
constexpr size_t kSlopeLag = 32;  // samples; bridges bunches, mostly without a missing sample
constexpr double kLongGapPeriods = 100.0;  // in a stream with missing samples, a rarity
constexpr double kMostLongGaps = 0.01;     // of the intervals
constexpr double kScatterPeriods = 0.01;   // clean measured recordings: 0.003 and less
constexpr double kScatterS = 50e-6;        // less turns no camera by a visible angle
constexpr double kLatePeriods = 0.5;
constexpr double kLateS = 5e-3;
constexpr int kFewestLate = 3;            // samples
constexpr double kWanderOfScatter = 4.0;  // a random walk over 20 s wanders by more
constexpr double kWindowS = 20.0;
constexpr double kDriftPerS = 5e-6;  // of a phone's oscillator
// Less is not worth it: what stretches are off lines is a clock's own wander, too, which longer
// ones follow less (phone-edge-hand: 0.74 ms off lines of 21 s, 0.81 ms off lines of 26 s).
constexpr double kMuchLonger = 1.5;
constexpr size_t kFewestInBlock = 16;
constexpr double kBreakS = 0.25;
constexpr double kEarlyInBlock = 0.05;  // quantile of a block's stamps that stands for it
constexpr double kEarlyBlocks = 0.2;    // quantile of blocks through which the lines go

// Half the width of the middle 68 %.
double Scatter(const std::vector<double>& values) {
  return 0.5 * (Quantile(values, 0.84) - Quantile(values, 0.16));
}

// Of a clean stream, also with many missing samples, nearly all intervals are multiples of the
// median: that one, without what stamps scatter by. 0 for others. Samples that come in packets,
// stamped in whole microseconds one after the other, are others: microseconds divide everything.
double PeriodOfMultiples(const std::vector<double>& t) {
  std::vector<double> steps;
  for (size_t i = 1; i < t.size(); ++i) steps.push_back(t[i] - t[i - 1]);
  const double median = Quantile(steps, 0.5);
  if (!(median > 0.0)) return 0.0;
  size_t multiples = 0, long_gaps = 0;
  double sum_s = 0.0, sum_periods = 0.0;
  for (const double step : steps) {
    const double periods = std::round(step / median);
    if (periods < 1.0 || std::abs(step - periods * median) > 0.03 * median) continue;
    ++multiples;
    if (periods > kLongGapPeriods) ++long_gaps;
    sum_s += step;
    sum_periods += periods;
  }
  const auto all = static_cast<double>(steps.size());
  const bool clean = static_cast<double>(multiples) > 0.95 * all &&
                     static_cast<double>(long_gaps) < kMostLongGaps * all;
  return clean ? sum_s / sum_periods : 0.0;
}

// Numbers by intervals that are multiples of the period.
std::vector<int64_t> NumberByIntervals(const std::vector<double>& t, double period_s) {
  std::vector<int64_t> number(t.size(), 0);
  for (size_t i = 1; i < t.size(); ++i) {
    number[i] = number[i - 1] + std::llround((t[i] - t[i - 1]) / period_s);
  }
  return number;
}

// Period from the stamps' differences over some samples, in the middle of their distribution.
double RoughPeriod(const std::vector<double>& t) {
  const size_t lag = std::min(kSlopeLag, t.size() / 4);
  std::vector<double> slopes;
  for (size_t i = lag; i < t.size(); ++i) {
    slopes.push_back((t[i] - t[i - lag]) / static_cast<double>(lag));
  }
  const double rough = Quantile(std::move(slopes), 0.5);
  const size_t longer = 8 * kSlopeLag;
  if (!(rough > 0.0) || t.size() < 4 * longer) return rough;
  slopes = {};  // over a longer time, with the missing samples that it shows
  for (size_t i = longer; i < t.size(); ++i) {
    const double periods =
        std::max(static_cast<double>(longer), std::round((t[i] - t[i - longer]) / rough));
    slopes.push_back((t[i] - t[i - longer]) / periods);
  }
  return Quantile(std::move(slopes), 0.5);
}

// Stamps without the mean clock: t - period * number.
std::vector<double> Lateness(const std::vector<double>& t, const std::vector<int64_t>& number,
                             double period_s) {
  std::vector<double> late(t.size());
  for (size_t i = 0; i < t.size(); ++i) late[i] = t[i] - period_s * static_cast<double>(number[i]);
  return late;
}

// Numbers the samples; skips one where the envelope of the stamps to come stays above that of the
// stamps before.
std::vector<int64_t> NumberSamples(const std::vector<double>& t, double period_s) {
  std::vector<int64_t> number(t.size());
  for (size_t i = 0; i < t.size(); ++i) number[i] = static_cast<int64_t>(i);
  const std::vector<double> late = Lateness(t, number, period_s);
  const Envelope envelope = EnvelopeToCome(late, period_s);
  const size_t ahead = envelope.ahead;
  const std::vector<double>& to_come = envelope.least;
  const double rise = envelope.rise;
  // Near the end, the envelope to come is that of a few samples, which may all be late: what rises
  // there by no more than samples ever were late is no missing one.
  const std::vector<double> earlier = BackwardMinimum(late, ahead);
  double latest = rise;
  for (size_t i = 0; i < t.size(); ++i) latest = std::max(latest, late[i] - earlier[i]);

  int64_t skipped = 0;
  std::vector<std::pair<size_t, int64_t>> skips;  // where, how many
  std::deque<std::pair<size_t, double>> before;   // candidates of the minimum, numbers skipped
  for (size_t i = 0; i < t.size(); ++i) {
    const double offset = period_s * static_cast<double>(skipped);
    const double change = before.empty() ? 0.0 : to_come[i] - offset - before.front().second;
    if (std::abs(change) > (i + ahead < t.size() ? rise : latest)) {
      int64_t periods = std::llround(change / period_s);
      if (periods < 0) {  // what was taken for missing was a long latency
        while (periods < 0 && !skips.empty()) {
          const int64_t undone = std::min(skips.back().second, -periods);
          for (size_t j = skips.back().first; j < i; ++j) number[j] -= undone;
          skipped -= undone;
          periods += undone;
          if ((skips.back().second -= undone) == 0) skips.pop_back();
        }
        before.clear();
      } else if (periods > 0) {
        skips.emplace_back(i, periods);
        skipped += periods;
      }
    }
    number[i] += skipped;
    const double value = late[i] - period_s * static_cast<double>(skipped);
    while (!before.empty() && before.back().second >= value) before.pop_back();
    before.emplace_back(i, value);
    if (before.front().first + ahead < i) before.pop_front();
  }
  return number;
}

// The earliest stamps of stretches of samples, in [begin, end).
std::vector<LinePoint> EarliestOfBlocks(const std::vector<int64_t>& number,
                                        const std::vector<double>& late, size_t begin, size_t end,
                                        size_t block) {
  std::vector<LinePoint> points;
  std::vector<std::pair<double, size_t>> sorted;
  for (size_t from = begin; from < end; from += block) {
    const size_t to = from + 2 * block > end ? end : from + block;  // no short one at the end
    sorted.clear();
    for (size_t i = from; i < to; ++i) sorted.emplace_back(late[i], i);
    const auto at = sorted.begin() +
                    static_cast<std::ptrdiff_t>(kEarlyInBlock * static_cast<double>(sorted.size()));
    std::nth_element(sorted.begin(), at, sorted.end());
    points.push_back({static_cast<double>(number[at->second]), at->first});
    if (to == end) break;
  }
  return points;
}

// How long the clock's lines are to be where stretches are off them by residual_s: as long as makes
// them known as badly at their ends, for lack of stamps (StampRateSigma), as the clock's drift
// bends away from them there, by a twelfth of drift * length^2.
double WindowFor(double residual_s) {
  const double of_a_second_s = 0.5 * StampRateSigma(residual_s, 1.0);  // falls with the root
  return std::max(kWindowS, std::pow(12.0 * of_a_second_s / kDriftPerS, 0.4));
}

// The clock of one stretch without breaks, as a correction to period * number: lines over window_s.
void FitClock(const std::vector<int64_t>& number, const std::vector<double>& late, double period_s,
              double window_s, size_t begin, size_t end, std::vector<double>* clock,
              std::vector<double>* residuals) {
  const size_t block = SamplesIn(kStampStretchS, period_s, kFewestInBlock);
  const std::vector<LinePoint> points = EarliestOfBlocks(number, late, begin, end, block);
  const double first = static_cast<double>(number[begin]);
  const double span = static_cast<double>(number[end - 1]) - first;
  // Windows overlap by half; each line holds at its window's centre and fades out to the next ones.
  const double halves = std::max(2.0, std::floor(2.0 * span * period_s / window_s));
  const double half = span / halves;
  std::vector<StraightLine> lines;
  for (int w = 0; w + 2 <= static_cast<int>(halves); ++w) {
    std::vector<LinePoint> inside;
    for (const LinePoint& p : points) {
      if (p.x >= first + w * half && p.x <= first + (w + 2) * half) inside.push_back(p);
    }
    if (inside.size() < 4) inside = points;  // most of this window is missing
    lines.push_back(inside.size() < 2 ? StraightLine{points[0].x, points[0].y, 0.0}
                                      : QuantileLine(inside, kEarlyBlocks));
  }
  const auto at = [&](double x) {
    const double place =  // half is 0 for a stretch of one sample
        half > 0.0
            ? std::clamp((x - first) / half - 1.0, 0.0, static_cast<double>(lines.size() - 1))
            : 0.0;
    const size_t w = std::min(static_cast<size_t>(place), lines.size() - 1);
    const double fade = place - static_cast<double>(w);
    if (w + 1 == lines.size()) return lines[w].At(x);
    return (1.0 - fade) * lines[w].At(x) + fade * lines[w + 1].At(x);
  };
  for (size_t i = begin; i < end; ++i) (*clock)[i] = at(static_cast<double>(number[i]));
  for (const LinePoint& p : points) residuals->push_back(p.y - at(p.x));
}

// The whole clock, which starts anew after gaps, and how far stretches are off it.
std::vector<double> ClockBehind(const std::vector<int64_t>& number, const std::vector<double>& late,
                                double period_s, std::vector<double>* residuals) {
  const size_t n = number.size();
  std::vector<double> clock(n, 0.0);
  const auto fit = [&](double window_s) {
    size_t begin = 0;
    residuals->clear();
    for (size_t i = 1; i <= n; ++i) {
      if (i < n && static_cast<double>(number[i] - number[i - 1]) * period_s < kBreakS) continue;
      FitClock(number, late, period_s, window_s, begin, i, &clock, residuals);
      begin = i;
    }
  };
  fit(kWindowS);
  const double longer_s = WindowFor(Scatter(*residuals));
  if (longer_s > kMuchLonger * kWindowS) fit(longer_s);
  return clock;
}

// Distances of stamps from their clock, in a report.
void ReportDistances(const std::vector<double>& late, const std::vector<double>& clock,
                     StampReport* report) {
  double sum = 0.0, sum_squares = 0.0;
  for (size_t i = 0; i < late.size(); ++i) {
    const double distance = late[i] - clock[i];
    sum += distance;
    sum_squares += distance * distance;
    report->latest_s = std::max(report->latest_s, distance);
  }
  const auto count = static_cast<double>(late.size());
  report->jitter_s = std::sqrt(std::max(0.0, sum_squares / count - sum * sum / (count * count)));
}

// Clear evidence that stamps are not the clock: see FindStampClock.
bool IsLate(const std::vector<double>& late, double period_s, double scatter_s) {
  if (scatter_s > std::max(kScatterPeriods * period_s, kScatterS)) return true;
  const size_t ahead = SamplesIn(kLookaheadS, period_s, kFewestAhead);
  const std::vector<double> after = ForwardMinimum(late, ahead);
  const std::vector<double> before = BackwardMinimum(late, ahead);
  int count = 0;
  for (size_t i = 0; i < late.size(); ++i) {
    const double behind = late[i] - std::max(before[i], after[i]);
    count += behind > std::min(kLatePeriods * period_s, kLateS) ? 1 : 0;
  }
  return count >= kFewestLate;
}

// By how much the median stamp is behind the clock, and how well that is known from its scatter
// over stretches of the recording.
double MedianLateness(const std::vector<double>& late, const std::vector<double>& clock,
                      double* sigma_s) {
  constexpr size_t kStretches = 16;
  std::vector<double> distances(late.size());
  for (size_t i = 0; i < late.size(); ++i) distances[i] = late[i] - clock[i];
  const size_t stretches = std::min(kStretches, distances.size() / kFewestInBlock);
  double sum = 0.0, squares = 0.0;
  for (size_t k = 0; k < stretches; ++k) {
    const auto at = [&](size_t part) {
      return distances.begin() + static_cast<std::ptrdiff_t>(part * distances.size() / stretches);
    };
    const double median = Quantile({at(k), at(k + 1)}, 0.5);
    sum += median;
    squares += median * median;
  }
  const auto count = static_cast<double>(stretches);
  if (stretches > 1) {
    const double variance = std::max(0.0, squares - sum * sum / count) / (count - 1.0);
    *sigma_s = std::sqrt(variance / count);
  }
  return Quantile(std::move(distances), 0.5);
}

}  // namespace

StampClock FindStampClock(const std::vector<int64_t>& stamps_ns, bool even_if_clean) {
  StampClock found;
  StampReport& report = found.report;
  const size_t n = stamps_ns.size();
  if (n < 2) return found;
  std::vector<double> t(n);
  for (size_t i = 0; i < n; ++i) t[i] = SecondsSince(stamps_ns.front(), stamps_ns[i]);
  if (n < kFewestStamps) {  // a gap among a few is no part of the period
    std::vector<double> steps;
    for (size_t i = 1; i < n; ++i) steps.push_back(t[i] - t[i - 1]);
    report.period_s = Quantile(std::move(steps), 0.5);
    return found;
  }
  report.period_s = t.back() / static_cast<double>(n - 1);
  double period_s = PeriodOfMultiples(t);
  const auto number_samples = period_s > 0.0 ? NumberByIntervals : NumberSamples;
  if (!(period_s > 0.0)) period_s = RoughPeriod(t);
  if (!(period_s > 0.0)) return found;

  std::vector<int64_t> number = number_samples(t, period_s);
  for (int round = 0; round < 2; ++round) {  // with a better period, better numbers
    const std::vector<LinePoint> points = EarliestOfBlocks(number, Lateness(t, number, period_s), 0,
                                                           n, std::max(kFewestInBlock, n / 80));
    if (points.size() < 2) break;
    const double better_s = period_s + QuantileLine(points, kEarlyBlocks).slope;
    if (!(better_s > 0.5 * period_s && better_s < 2.0 * period_s)) break;
    period_s = better_s;
    number = number_samples(t, period_s);
  }
  const std::vector<double> late = Lateness(t, number, period_s);
  report.period_s = period_s;
  report.missing = static_cast<int>(number.back() + 1 - static_cast<int64_t>(n));

  std::vector<double> changes;
  for (size_t i = 1; i < n; ++i) changes.push_back(late[i] - late[i - 1]);
  const double scatter_s = Scatter(changes) / std::sqrt(2.0);
  report.jitter_s = scatter_s;
  const bool is_late = IsLate(late, period_s, scatter_s);
  if (!is_late && !even_if_clean) return found;

  std::vector<double> residuals;
  const std::vector<double> clock = ClockBehind(number, late, period_s, &residuals);
  ReportDistances(late, clock, &report);
  double changes_squares = 0.0;
  for (const double change : changes) changes_squares += change * change;
  report.residual_s = Scatter(residuals);
  if (is_late) {
    report.kind =
        report.jitter_s > kWanderOfScatter * std::sqrt(changes_squares / static_cast<double>(n))
            ? StampKind::kIrregular
            : StampKind::kArrival;
  }
  if (report.kind == StampKind::kIrregular) return found;
  const double level_s = MedianLateness(late, clock, &report.level_sigma_s);
  found.sampled_ns.resize(n);
  for (size_t i = 0; i < n; ++i) {
    const double sampled_s = period_s * static_cast<double>(number[i]) + clock[i] + level_s;
    found.sampled_ns[i] = StampAt(stamps_ns.front(), sampled_s);
    if (i > 0 && found.sampled_ns[i] <= found.sampled_ns[i - 1]) {  // clocks of two stretches
      found.sampled_ns[i] = found.sampled_ns[i - 1] + 1;
    }
  }
  return found;
}

double InterpolationError(const std::vector<GyroSample>& samples,
                          const std::vector<int64_t>& stamps_ns) {
  std::vector<double> errors;
  for (size_t i = 1; i + 1 < samples.size(); ++i) {
    const double before = SecondsSince(stamps_ns[i - 1], stamps_ns[i]);
    const double both = SecondsSince(stamps_ns[i - 1], stamps_ns[i + 1]);
    if (!(both > 0.0)) continue;
    const double part = before / both;
    errors.push_back((samples[i].omega_gyro_rad_s - (1.0 - part) * samples[i - 1].omega_gyro_rad_s -
                      part * samples[i + 1].omega_gyro_rad_s)
                         .squaredNorm());
  }
  return errors.empty() ? 0.0 : MedianInPlace(&errors);
}

std::string DescribeStamps(const StampReport& report) {
  const double period_ms = 1e3 * report.period_s;
  switch (report.kind) {
    case StampKind::kMeasured:
      return Format("a steady clock's, %.6g ms, jitter %.2g ms", period_ms, 1e3 * report.jitter_s);
    case StampKind::kArrival:
      return Format("arrival times: up to %.2g ms late; %s a clock of %.6g ms, residual %.2g ms",
                    1e3 * report.latest_s, report.repaired ? "laid on" : "behind them is",
                    period_ms, 1e3 * report.residual_s);
    case StampKind::kIrregular:
      return Format(
          "irregular: no steady clock explains intervals of %.6g ms in the mean; left as "
          "recorded",
          period_ms);
  }
  return "";
}

}  // namespace camgyro
