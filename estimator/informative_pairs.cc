#include "estimator/informative_pairs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

namespace camgyro {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kStretchS = 1.0;
// What is known at the beginning, of what all pairs tell: without it, the first few stretches would
// be as good as any.
constexpr double kShareAtFirst = 1e-3;

struct Stretch {
  size_t first = 0, count = 0;  // of the pairs
  double bytes = 0.0;
  Matrix6d information = Matrix6d::Zero();
};

Eigen::Vector3d RateAt(const EstimationInput& input, double time_s) {
  const auto next =
      std::lower_bound(input.rates.begin(), input.rates.end(), time_s,
                       [](const TimedRate& rate, double t) { return rate.time_s < t; });
  return (next == input.rates.end() ? input.rates.back() : *next).omega_gyro_rad_s;
}

// Mean rate between the two frames, and how much it changes from the one to the other.
Vector6d MotionOf(const EstimationInput& input, const TimedPair& pair, double delay_s) {
  const Eigen::Vector3d a = RateAt(input, pair.time_a_s + delay_s),
                        b = RateAt(input, pair.time_b_s + delay_s);
  Vector6d motion;
  motion << 0.5 * (a + b), b - a;
  return motion;
}

std::vector<Stretch> StretchesOf(const EstimationInput& input, double delay_s,
                                 const PairGraphOptions& options) {
  std::vector<Stretch> stretches;
  double begin_s = 0.0;
  for (size_t i = 0; i < input.pairs.size(); ++i) {
    const TimedPair& pair = input.pairs[i];
    if (i == 0 || pair.time_a_s - begin_s >= kStretchS) {
      stretches.push_back({i, 0, 0.0, Matrix6d::Zero()});
      begin_s = pair.time_a_s;
    }
    Stretch& stretch = stretches.back();
    ++stretch.count;
    stretch.bytes += RefinementBytes(pair, options);
    const Vector6d motion = MotionOf(input, pair, delay_s);
    stretch.information +=
        std::max<double>(1.0, static_cast<double>(pair.num_matches)) * motion * motion.transpose();
  }
  return stretches;
}

// In units of what all stretches have of each diagonal element.
void Scale(std::vector<Stretch>* stretches) {
  Vector6d sum = Vector6d::Zero();
  for (const Stretch& stretch : *stretches) sum += stretch.information.diagonal();
  const Vector6d scale = sum.cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  for (Stretch& stretch : *stretches) {
    stretch.information = scale.asDiagonal() * stretch.information * scale.asDiagonal();
  }
}

double LogDeterminant(const Matrix6d& information) {
  return 2.0 * information.llt().matrixLLT().diagonal().array().log().sum();
}

}  // namespace

double RefinementBytes(const TimedPair& pair, const PairGraphOptions& options) {
  constexpr double kShared = 20.0;  // columns: lens, shutter, mounting, bias, direction, bend
  constexpr double kTimesHeld = 2.0, kMatchesHeld = 4.0;
  // Of the rates, at both ends and for the readout, of which nothing is known here, a few more.
  const double rates = 4.0 + (pair.time_b_s - pair.time_a_s) / options.rate_step_s;
  const double columns = kShared + 3.0 * rates;
  return sizeof(double) * columns * (kTimesHeld * pair.num_matches + columns) +
         kMatchesHeld * sizeof(Match) * pair.num_matches;
}

double BytesOf(const Recording& recording) {
  double points = 0.0, matches = 0.0;
  for (const auto& tracks : recording.tracks) points += static_cast<double>(tracks.size());
  for (const FramePair& pair : recording.matches) {
    matches += static_cast<double>(pair.matches.size());
  }
  // A sample is in the recording, in the outline, and in the graph.
  const auto samples = static_cast<double>(recording.gyro.size());
  return points * sizeof(TrackedPoint) + matches * sizeof(Match) +
         samples * (sizeof(GyroSample) + 2.0 * sizeof(TimedRate)) +
         static_cast<double>(recording.accel.size()) * sizeof(AccelSample) +
         static_cast<double>(recording.frames.size()) * (sizeof(Frame) + sizeof(TimedPair));
}

std::vector<TimedPair> InformativePairs(const EstimationInput& input, double delay_s,
                                        const PairLimits& limits, const PairGraphOptions& options) {
  double bytes = 0.0;
  for (const TimedPair& pair : input.pairs) bytes += RefinementBytes(pair, options);
  if ((input.pairs.size() <= limits.pairs && bytes <= limits.bytes) || input.rates.empty()) {
    return input.pairs;
  }
  std::vector<Stretch> stretches = StretchesOf(input, delay_s, options);
  Scale(&stretches);
  Matrix6d sum = kShareAtFirst * Matrix6d::Identity();
  const auto gain_of = [&](size_t k) {
    return (LogDeterminant(sum + stretches[k].information) - LogDeterminant(sum)) /
           static_cast<double>(stretches[k].count);
  };
  // What a stretch adds only falls as others are taken, so that the best of old gains is the best
  // of all if its new one is still above the next. Of equal ones, the earlier.
  struct Entry {
    double gain;
    size_t stretch;
    bool operator<(const Entry& other) const {
      return gain != other.gain ? gain < other.gain : stretch > other.stretch;
    }
  };
  std::priority_queue<Entry> queue;
  for (size_t k = 0; k < stretches.size(); ++k) queue.push({gain_of(k), k});
  std::vector<bool> taken(stretches.size(), false);
  bytes = 0.0;
  for (size_t pairs = 0; !queue.empty();) {
    const Entry best = {gain_of(queue.top().stretch), queue.top().stretch};
    queue.pop();
    if (!queue.empty() && best < queue.top()) {
      queue.push(best);
      continue;
    }
    const Stretch& stretch = stretches[best.stretch];
    if (pairs + stretch.count > limits.pairs || bytes + stretch.bytes > limits.bytes) continue;
    pairs += stretch.count;
    bytes += stretch.bytes;
    taken[best.stretch] = true;
    sum += stretches[best.stretch].information;
  }
  std::vector<TimedPair> kept;
  for (size_t k = 0; k < stretches.size(); ++k) {
    if (!taken[k]) continue;
    const auto first = input.pairs.begin() + static_cast<std::ptrdiff_t>(stretches[k].first);
    kept.insert(kept.end(), first, first + static_cast<std::ptrdiff_t>(stretches[k].count));
  }
  return kept;
}

}  // namespace camgyro
