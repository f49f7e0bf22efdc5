#include "frontend/lower_envelope.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

namespace camgyro {
namespace {

constexpr double kLongestLookaheadS = 2.0;
constexpr size_t kFewestLookaheads = 8;  // in a stream
constexpr double kMissingPeriods = 0.6;  // rise that is a missing sample
// Changes that are no chance, in falls of which a twentieth is larger: in a minute of samples,
// exponential latencies make none (StampClock.FindsNoMissingSampleWhereNoneIs; with 4 they do).
constexpr double kRareChange = 6.0;

Envelope EnvelopeAhead(const std::vector<double>& late, double period_s, size_t ahead) {
  Envelope envelope{ahead, ForwardMinimum(late, ahead), 0.0};
  std::vector<double> changes{0.0};  // from one stretch to the next
  for (size_t i = ahead + 1; i < late.size(); ++i) {
    changes.push_back(envelope.least[i] - envelope.least[i - ahead - 1]);
  }
  // A wrong rate is in the median; a missing sample makes no fall.
  const double fall = Quantile(changes, 0.5) - Quantile(changes, 0.05);
  envelope.rise = std::max(kMissingPeriods * period_s, kRareChange * fall);
  return envelope;
}

}  // namespace

size_t SamplesIn(double seconds, double period_s, size_t least) {
  return std::max(least, static_cast<size_t>(std::lround(seconds / period_s)));
}

double Quantile(std::vector<double> values, double q) {
  const auto at = values.begin() +
                  static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::vector<double> ForwardMinimum(const std::vector<double>& values, size_t ahead) {
  std::vector<double> minimum(values.size());
  std::deque<size_t> candidates;
  for (size_t i = values.size(); i-- > 0;) {
    while (!candidates.empty() && values[candidates.back()] >= values[i]) candidates.pop_back();
    candidates.push_back(i);
    if (candidates.front() > i + ahead) candidates.pop_front();
    minimum[i] = values[candidates.front()];
  }
  return minimum;
}

std::vector<double> BackwardMinimum(std::vector<double> values, size_t behind) {
  std::reverse(values.begin(), values.end());
  std::vector<double> minimum = ForwardMinimum(values, behind);
  std::reverse(minimum.begin(), minimum.end());
  return minimum;
}

Envelope EnvelopeToCome(const std::vector<double>& late, double period_s) {
  const size_t longest = std::min(SamplesIn(kLongestLookaheadS, period_s, kFewestAhead),
                                  late.size() / kFewestLookaheads);
  Envelope best = EnvelopeAhead(late, period_s, SamplesIn(kLookaheadS, period_s, kFewestAhead));
  while (best.rise > kMissingPeriods * period_s && 2 * best.ahead <= longest) {
    Envelope longer = EnvelopeAhead(late, period_s, 2 * best.ahead);
    if (!(longer.rise < best.rise)) break;
    best = std::move(longer);
  }
  return best;
}

}  // namespace camgyro
