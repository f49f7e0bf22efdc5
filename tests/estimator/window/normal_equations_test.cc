#include "estimator/window/normal_equations.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <set>

#include "tests/estimator/window/linear_factor.h"

namespace camgyro {
namespace {

BlockId Bias(int64_t i) { return {BlockKind::kBias, i}; }
BlockId Rates(int64_t i) { return {BlockKind::kRates, i}; }
BlockId FrameTimeId(int64_t i) { return {BlockKind::kFrameTime, 1'000'000 * i}; }
BlockId Direction(int64_t i) { return {BlockKind::kDirection, i}; }

// Of scalars: pair i has a direction, the times of frames i and i + 1, and the rates of groups i
// and i + 1. Four groups have a bias, which walks to the next.
FactorGraph ChainOfPairs(int pairs, bool frame_times) {
  FactorGraph graph;
  const auto add = [&](const BlockId& id, const std::vector<BlockId>& with) {
    if (graph.Has(id)) return;
    graph.AddBlock(id, {Geometry::kEuclidean, Eigen::VectorXd::Zero(1), {}});
    std::vector<BlockId> blocks = with;
    blocks.push_back(id);
    graph.AddFactor(std::make_shared<LinearFactor>(
                        std::vector<Eigen::MatrixXd>(blocks.size(), Eigen::MatrixXd::Ones(1, 1)),
                        Eigen::VectorXd::Zero(1)),
                    blocks);
  };
  add(Bias(0), {});
  for (int i = 0; i < pairs; ++i) {
    add(Rates(i), {Bias(i / 4)});
    if ((i + 1) % 4 == 0) add(Bias((i + 1) / 4), {Bias(i / 4)});
    add(Rates(i + 1), {Bias((i + 1) / 4)});
    std::vector<BlockId> touched = {Rates(i), Rates(i + 1)};
    if (frame_times) {
      add(FrameTimeId(i), {});
      add(FrameTimeId(i + 1), {});
      touched.insert(touched.end(), {FrameTimeId(i), FrameTimeId(i + 1)});
    }
    add(Direction(i), touched);
  }
  return graph;
}

// The most unknowns that one is coupled with when it is eliminated.
size_t MostNeighbours(const FactorGraph& graph) {
  std::vector<const Factor*> factors;
  for (const auto& entry : graph.factors()) factors.push_back(&entry.second);
  const Unknowns unknowns(graph.blocks(), factors);
  std::vector<std::set<int>> later(unknowns.ids.size());
  const auto couple = [&](const std::set<int>& all) {
    for (const int a : all) {
      later[static_cast<size_t>(a)].insert(all.upper_bound(a), all.end());
    }
  };
  for (const std::vector<int>& of_factor : unknowns.of_factors) {
    couple(std::set<int>(of_factor.begin(), of_factor.end()));
  }
  size_t most = 0;
  for (const std::set<int>& neighbours : later) {
    most = std::max(most, neighbours.size());
    couple(neighbours);
  }
  return most;
}

// Whatever the length: what the covariance costs grows with the recording and no faster.
TEST(Unknowns, AreEliminatedWithFewNeighboursAtATime) {
  for (const int pairs : {10, 60}) {
    // Rates of two groups, and two biases.
    EXPECT_LE(MostNeighbours(ChainOfPairs(pairs, false)), 4u);
    // Times of two frames as well.
    EXPECT_LE(MostNeighbours(ChainOfPairs(pairs, true)), 6u);
  }
}

}  // namespace
}  // namespace camgyro
