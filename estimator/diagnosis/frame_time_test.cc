#include "estimator/diagnosis/frame_time_test.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

namespace camgyro {
namespace {

struct Component {
  double z = 0.0, w = 0.0;
  size_t block = 0;
};

// A block's frames share pairs, so that it is whitened as a whole.
std::vector<Component> ComponentsOf(const Scores& scores) {
  std::vector<Component> components;
  for (size_t block = 0; block < scores.blocks.size(); ++block) {
    std::map<int64_t, Eigen::Index> at;
    for (const PairScore& pair : scores.pairs) {
      if (static_cast<size_t>(pair.block) != block) continue;
      at.emplace(pair.times.frame_a, 0);
      at.emplace(pair.times.frame_b, 0);
    }
    Eigen::Index size = 0;
    for (auto& entry : at) entry.second = size++;
    if (size == 0) continue;
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(size);
    for (const PairScore& pair : scores.pairs) {
      if (static_cast<size_t>(pair.block) != block) continue;
      const Eigen::Index index[2] = {at.at(pair.times.frame_a), at.at(pair.times.frame_b)};
      for (int i = 0; i < 2; ++i) {
        u[index[i]] += pair.times.score[i];
        for (int k = 0; k < 2; ++k) W(index[i], index[k]) += pair.times.information(i, k);
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(W);
    for (Eigen::Index i = 0; i < size; ++i) {
      const double w = eigen.eigenvalues()[i];
      if (w * kMostSpreadS * kMostSpreadS < 1.0) continue;  // nothing could show there
      components.push_back({eigen.eigenvectors().col(i).dot(u) / std::sqrt(w), w, block});
    }
  }
  return components;
}

// The most likely level where the spread squared over it is `ratio`.
double LevelOf(const std::vector<Component>& components, double ratio) {
  double sum = 0.0;
  for (const Component& c : components) sum += c.z * c.z / (1.0 + ratio * c.w);
  return sum / static_cast<double>(components.size());
}

// -2 log of the likelihood with the level at its best, up to a constant.
double Cost(const std::vector<Component>& components, double ratio) {
  double cost = static_cast<double>(components.size()) * std::log(LevelOf(components, ratio));
  for (const Component& c : components) cost += std::log1p(ratio * c.w);
  return cost;
}

// The ratio of least cost between the squares of the least and the largest spread.
double BestRatio(const std::vector<Component>& components) {
  const double low = 2.0 * std::log(kLeastSpreadS), high = 2.0 * std::log(kMostSpreadS);
  constexpr int kGrid = 60;
  const auto cost = [&](double log_ratio) { return Cost(components, std::exp(log_ratio)); };
  double step = (high - low) / kGrid, best = low, least = cost(low);
  for (int i = 1; i <= kGrid; ++i) {
    const double here = low + i * step, value = cost(here);
    if (value < least) {
      least = value;
      best = here;
    }
  }
  while (step > 1e-4) {
    step *= 0.5;
    for (const double here : {best - step, best + step}) {
      const double value = cost(here);
      if (value < least) {
        least = value;
        best = here;
      }
    }
  }
  return std::exp(best);
}

}  // namespace

FrameTimeTest TestFrameTimes(const Scores& scores, const Scatter& usual) {
  FrameTimeTest test;
  const std::vector<Component> components = ComponentsOf(scores);
  constexpr size_t kLeastComponents = 10, kLeastBlocks = 4;
  if (components.size() < kLeastComponents || scores.blocks.size() < kLeastBlocks) return test;
  test.dof = 1;
  const double ratio = BestRatio(components), level = LevelOf(components, ratio);
  const double gain = Cost(components, 0.0) - Cost(components, ratio);
  // Derivative of log L by log(ratio), the level projected out, by block.
  double mean = 0.0, expected = 0.0;
  for (const Component& c : components) mean += ratio * c.w / (1.0 + ratio * c.w);
  mean /= static_cast<double>(components.size());
  std::vector<double> by_block(scores.blocks.size(), 0.0);
  for (const Component& c : components) {
    const double share = ratio * c.w / (1.0 + ratio * c.w) - mean;
    by_block[c.block] += share * (c.z * c.z / (level * (1.0 + ratio * c.w)) - 1.0);
    expected += 2.0 * share * share;
  }
  double scatter = 0.0;
  for (const double part : by_block) scatter += part * part;
  const double free = static_cast<double>(by_block.size()) - 2.0;  // level and spread are fitted
  const double dof = free + usual.dof;
  const double variance = scatter / std::max(1e-30, expected) * (free + 2.0) / free;
  test.inflation = std::max(1.0, (variance * free + usual.variance * usual.dof) / dof);
  test.most_likely.level = level;
  test.most_likely.spread_s = std::sqrt(ratio * level);
  // The information on log(spread) is four times that on its square's, which is expected / 4.
  test.most_likely.sigma_s =
      test.most_likely.spread_s * std::sqrt(test.inflation / std::max(1e-30, expected));
  test.statistic = std::max(0.0, gain) / test.inflation;
  test.p_value = test.statistic > 0.0 ? 0.5 * FTail(test.statistic, 1.0, dof) : 1.0;
  return test;
}

std::vector<double> GainOfSpread(const Scores& scores, const FrameTimeSpread& spread) {
  std::vector<double> gain(scores.blocks.size(), 0.0);
  const double ratio = spread.spread_s * spread.spread_s / spread.level;
  for (const Component& c : ComponentsOf(scores)) {
    const double x = ratio * c.w;
    gain[c.block] += c.z * c.z * x / (1.0 + x) - spread.level * std::log1p(x);
  }
  return gain;
}

}  // namespace camgyro
