#include "estimator/diagnosis/frame_time_test.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <utility>

#include "core/linear_algebra.h"
#include "core/parallel.h"
#include "estimator/diagnosis/pair_system.h"
#include "estimator/diagnosis/thresholds.h"

namespace camgyro {
namespace {

using Matrix5d = Eigen::Matrix<double, 5, 5>;
using Rows2 = Eigen::Matrix<double, 2, 5>;
using Rows3 = Eigen::Matrix<double, 3, 5>;
using Matrix5Xd = Eigen::Matrix<double, 5, Eigen::Dynamic>;

// As many matches in each.
std::array<TimedPair, 2> Split(const TimedPair& pair, SplitOfMatches split) {
  std::vector<double> x;
  for (const Match& match : pair.matches) x.push_back(match.px_b.x());
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  if (middle != x.end()) std::nth_element(x.begin(), middle, x.end());
  std::array<TimedPair, 2> halves = {pair, pair};
  for (TimedPair& half : halves) half.matches.clear();
  for (size_t i = 0; i < pair.matches.size(); ++i) {
    const Match& match = pair.matches[i];
    const size_t half =
        split == SplitOfMatches::kEveryOther ? i % 2 : (match.px_b.x() < *middle ? 0 : 1);
    halves[half].matches.push_back(match);
  }
  return halves;
}

// A half with what is the pair's own projected out, and how the gyro's noise, in sigmas, enters the
// score of bias and offsets.
struct Projected {
  HalvesOfPair::Half half;
  Matrix5Xd by_gyro;
};

Projected Project(const PairSystem& s) {
  Eigen::MatrixXd J(s.J.rows(), s.J.cols() + 2);
  J << s.J, s.by_times;
  Eigen::MatrixXd A = s.N.transpose() * s.N;
  A.diagonal() += s.prior;
  A.diagonal().array() += 1e-9;
  const Eigen::MatrixXd NJ = s.N.transpose() * J;
  const Eigen::MatrixXd X = SymmetricSolver(A).Solve(NJ);
  Projected p;
  p.half.g =
      J.transpose() * s.r - X.transpose() * (s.N.transpose() * s.r + s.prior.cwiseProduct(s.at));
  p.half.H = J.transpose() * J - NJ.transpose() * X;
  // Noise n of the pair's own unknowns: r has N n, of which the projection leaves X^T prior n.
  const Eigen::Index gyro = s.N.cols() - s.first_of_gyro;
  Matrix5Xd left(5, gyro);
  left.topRows<3>() = X.middleCols<3>(kStateBias).bottomRows(gyro).transpose();
  left.bottomRows<2>() = X.rightCols<2>().bottomRows(gyro).transpose();
  p.by_gyro = left * s.prior.tail(gyro).cwiseSqrt().asDiagonal();
  return p;
}

std::optional<HalvesOfPair> HalvesOf(const EstimationInput& input, const TimedPair& pair,
                                     const Calibration& calibration, const AllEffects& all,
                                     double noise, const PairGraphOptions& options,
                                     SplitOfMatches split) {
  const auto project = [&](const TimedPair& matches) {
    PairSystem system;
    return MakePairSystem(input, matches, calibration, all, noise, options, &system)
               ? std::optional<Projected>(Project(system))
               : std::nullopt;
  };
  const std::array<TimedPair, 2> halves = Split(pair, split);
  std::optional<Projected> first = project(halves[0]), second = project(halves[1]);
  std::optional<Projected> whole = project(pair);
  if (!first || !second || !whole) return std::nullopt;
  HalvesOfPair both;
  both.common = first->by_gyro * second->by_gyro.transpose();
  both.halves = {std::move(first->half), std::move(second->half)};
  both.whole = std::move(whole->half);
  return both;
}

using Half = HalvesOfPair::Half;

// Score and information of bias and offsets in one half, or the whole, of a pair's matches, the
// model projected out of the sum over all pairs.
struct Own {
  Eigen::Matrix<double, 5, 1> s;
  Matrix5d W;
};

Own OwnOf(const Half& half, const Eigen::VectorXd& step) {
  const Eigen::Index n = step.size();
  const std::array<Eigen::Index, 5> at = {kStateBias, kStateBias + 1, kStateBias + 2, n, n + 1};
  Own own;
  for (Eigen::Index i = 0; i < 5; ++i) {
    const Eigen::Index row = at[static_cast<size_t>(i)];
    own.s[i] = half.g[row] + half.H.row(row).head(n).dot(step);
    for (Eigen::Index k = 0; k < 5; ++k) own.W(i, k) = half.H(row, at[static_cast<size_t>(k)]);
  }
  return own;
}

// Of all pairs: `part` is what counts of each.
template <typename Part>
std::vector<Own> OwnOfAll(const std::vector<HalvesOfPair>& pairs, const Eigen::VectorXd& prior,
                          const Part& part) {
  const Eigen::Index n = prior.size();
  Eigen::MatrixXd H = prior.asDiagonal();
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  for (const HalvesOfPair& pair : pairs) {
    H += part(pair).H.topLeftCorner(n, n);
    g += part(pair).g.head(n);
  }
  const Eigen::VectorXd step = -SymmetricSolver(H, kSmallRidge).Solve(g);
  std::vector<Own> own;
  for (const HalvesOfPair& pair : pairs) own.push_back(OwnOf(part(pair), step));
  return own;
}

// The halves of all pairs.
std::vector<std::array<Own, 2>> OwnOfHalves(const std::vector<HalvesOfPair>& pairs,
                                            const Eigen::VectorXd& prior) {
  const auto half = [&](size_t k) {
    return OwnOfAll(pairs, prior,
                    [k](const HalvesOfPair& pair) -> const Half& { return pair.halves[k]; });
  };
  const std::vector<Own> first = half(0), second = half(1);
  std::vector<std::array<Own, 2>> own;
  for (size_t i = 0; i < pairs.size(); ++i) own.push_back({first[i], second[i]});
  return own;
}

// What the pairs say of times. Frames of different pairs count as different ones.
std::vector<PairTimes> TimesOf(const std::vector<HalvesOfPair>& pairs,
                               const Eigen::VectorXd& prior) {
  std::vector<PairTimes> times;
  const auto whole = [](const HalvesOfPair& pair) -> const Half& { return pair.whole; };
  for (const Own& own : OwnOfAll(pairs, prior, whole)) {
    const auto frame = static_cast<int64_t>(2 * times.size());
    times.push_back({frame, frame + 1, own.s.tail<2>(), own.W.bottomRightCorner<2, 2>()});
  }
  return times;
}

// Picks rotations out of bias and offsets, with whatever times there are projected out.
Rows3 WithoutTimes(const Own& own) {
  Eigen::Matrix2d W = own.W.bottomRightCorner<2, 2>();
  W.diagonal().array() += std::pow(kMostTimesS, -2.0);
  Rows3 T = Rows3::Zero();
  T.leftCols<3>().setIdentity();
  T.rightCols<2>() = -(W.inverse() * own.W.bottomLeftCorner<2, 3>()).transpose();
  return T;
}

HalvesAgreement Judge(const std::vector<double>& x) {
  HalvesAgreement agreement;
  double sum_sq = 0.0;
  for (const double value : x) {
    agreement.sum += value;
    sum_sq += value * value;
  }
  if (x.size() < kLeastPairsOfHalves || !(sum_sq > 0.0)) return agreement;
  agreement.sigmas = agreement.sum / std::sqrt(sum_sq);
  std::mt19937_64 random(1);
  int as_large = 0;
  for (int choice = 0; choice < kSignChoices; ++choice) {
    double sum = 0.0;
    uint64_t bits = 0;
    for (size_t i = 0; i < x.size(); ++i, bits >>= 1) {
      if (i % 64 == 0) bits = random();
      sum += (bits & 1) != 0 ? x[i] : -x[i];
    }
    if (sum >= agreement.sum) ++as_large;
  }
  agreement.p_value = (1.0 + as_large) / (1.0 + kSignChoices);
  if (as_large == 0) {
    const double z = std::max(0.0, agreement.sigmas);
    agreement.p_value = std::min(agreement.p_value, std::exp(-0.5 * z * z));
  }
  return agreement;
}

// x of one pair in the columns that T, 5 x any, picks out of bias and offsets in each half.
template <typename Transform, typename Prior>
double InCommon(const Own& a, const Own& b, const Transform& T_a, const Transform& T_b,
                const Prior& prior, const Matrix5d& common) {
  using Small = Eigen::Matrix<double, Transform::RowsAtCompileTime, Transform::RowsAtCompileTime>;
  Small W = 0.5 * (T_a * a.W * T_a.transpose() + T_b * b.W * T_b.transpose());
  W.diagonal() += prior;
  const Small inverse = W.inverse();
  const Small C = T_a * common * T_b.transpose();
  return (T_a * a.s).dot(inverse * (T_b * b.s)) - (inverse * C).trace();
}

}  // namespace

std::vector<HalvesOfPair> ScoreHalves(const EstimationInput& input,
                                      const std::vector<TimedPair>& pairs,
                                      const Calibration& calibration, double noise,
                                      const PairGraphOptions& options, SplitOfMatches split) {
  AllEffects all = AllEffectsOf(calibration, nullptr);
  all.with_times = true;
  std::vector<std::optional<HalvesOfPair>> found(pairs.size());
  ParallelFor(pairs.size(), [&](size_t i) {
    found[i] = HalvesOf(input, pairs[i], calibration, all, noise, options, split);
  });
  std::vector<HalvesOfPair> halves;
  for (auto& pair : found) {
    if (pair) halves.push_back(*std::move(pair));
  }
  return halves;
}

bool FrameTimeTest::is_of_times() const {
  if (rest.p_value < kRestP && far_times.sum < kLeastShareOfTimes * (far_times.sum + rest.sum)) {
    return false;
  }
  return spread.value_s > kLeastNearSpread * far_spread.value_s;
}

FrameTimeTest TestFrameTimes(const std::vector<HalvesOfPair>& near,
                             const std::vector<HalvesOfPair>& far,
                             const Eigen::VectorXd& prior_information) {
  FrameTimeTest test;
  test.pairs = static_cast<int>(near.size());
  const Eigen::Vector2d times_prior = Eigen::Vector2d::Constant(std::pow(kTimesPriorS, -2.0));
  const Eigen::Vector3d rest_prior = Eigen::Vector3d::Constant(std::pow(kRestPriorRadS, -2.0));
  Rows2 pick_times = Rows2::Zero();
  pick_times.rightCols<2>().setIdentity();
  std::vector<double> near_times, far_times, rest;
  const auto near_own = OwnOfHalves(near, prior_information);
  const auto far_own = OwnOfHalves(far, prior_information);
  for (size_t i = 0; i < near.size(); ++i) {
    const auto& [a, b] = near_own[i];
    near_times.push_back(InCommon(a, b, pick_times, pick_times, times_prior, near[i].common));
  }
  for (size_t i = 0; i < far.size(); ++i) {
    const auto& [a, b] = far_own[i];
    far_times.push_back(InCommon(a, b, pick_times, pick_times, times_prior, far[i].common));
    rest.push_back(InCommon(a, b, WithoutTimes(a), WithoutTimes(b), rest_prior, far[i].common));
  }
  test.times = Judge(near_times);
  test.far_times = Judge(far_times);
  test.rest = Judge(rest);
  test.spread = MostLikelySpread(TimesOf(near, prior_information));
  test.far_spread = MostLikelySpread(TimesOf(far, prior_information));
  return test;
}

}  // namespace camgyro
