// The solver's minimum is that of the factors: held against Levenberg-Marquardt with dense normal
// equations, which shares nothing with Ceres but the factors.
#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include "core/parallel.h"
#include "core/so3.h"
#include "estimator/window/factor_graph.h"
#include "estimator/window/pair_graph.h"
#include "tests/estimator/simulated_input.h"

namespace camgyro {
namespace {

using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class DenseSolver {
 public:
  explicit DenseSolver(const FactorGraph& graph) : graph_(graph) {
    for (const auto& [id, block] : graph.blocks()) {
      values_[id] = block.value;
      offsets_[id] = size_;
      size_ += block.tangent_size();
    }
  }

  // Until no step lowers the cost any more.
  void Solve() {
    double damping = 1e-4;
    Linearize();
    for (int i = 0; i < 500 && damping < 1e8; ++i) {
      MatrixXd H = H_;
      H.diagonal() += damping * H_.diagonal();
      const VectorXd step = -H.ldlt().solve(g_);
      const double before = cost_;
      const auto values = values_;
      Move(step);
      if (Linearize() && cost_ < before) {
        damping = std::max(1e-12, 0.1 * damping);
      } else {
        values_ = values;
        Linearize();
        damping *= 10.0;
      }
    }
  }

  double cost() const { return cost_; }
  // Of another graph with the same blocks from the solution, each coordinate in sigmas.
  VectorXd DistanceInSigmas(const FactorGraph& other) const {
    const VectorXd sigma = H_.ldlt().solve(MatrixXd::Identity(size_, size_)).diagonal().cwiseSqrt();
    VectorXd distance(size_);
    for (const auto& [id, value] : values_) {
      const Block& block = graph_.block(id);
      const VectorXd change = other.value(id) - value;
      const int at = offsets_.at(id);
      if (block.geometry == Geometry::kRotation) {
        distance.segment<3>(at) = Log(Quaterniond(Quaterniond(Eigen::Vector4d(value)).conjugate() *
                                                  Quaterniond(Eigen::Vector4d(other.value(id)))));
      } else if (block.geometry == Geometry::kDirection) {
        distance.segment<2>(at) = Basis(value).transpose() * change;
      } else {
        distance.segment(at, block.tangent_size()) = Selection(block) * change;
      }
    }
    return distance.cwiseQuotient(sigma);
  }

 private:
  static Eigen::Matrix<double, 3, 2> Basis(const Vector3d& tau) {
    Eigen::Matrix<double, 3, 2> basis;
    basis.col(0) = tau.unitOrthogonal();
    basis.col(1) = tau.cross(basis.col(0));
    return basis;
  }
  // Rows of the unit matrix that are not constant.
  static MatrixXd Selection(const Block& block) {
    const Eigen::Index n = block.value.size();
    MatrixXd rows = MatrixXd::Zero(block.tangent_size(), n);
    Eigen::Index row = 0;
    for (int k = 0; k < n; ++k) {
      if (std::count(block.constant.begin(), block.constant.end(), k) == 0) rows(row++, k) = 1.0;
    }
    return rows;
  }
  // Derivative of a block's numbers by its tangent.
  MatrixXd Lift(const BlockId& id) const {
    const Block& block = graph_.block(id);
    const VectorXd& value = values_.at(id);
    if (block.geometry == Geometry::kDirection) return Basis(value);
    if (block.geometry == Geometry::kEuclidean) return Selection(block).transpose();
    MatrixXd lift(4, 3);  // q Exp(d) = q + q (d / 2, 0)
    const Quaterniond q{Eigen::Vector4d(value)};
    for (int k = 0; k < 3; ++k) {
      const Vector3d half = 0.5 * Vector3d::Unit(k);
      lift.col(k) = (q * Quaterniond(0.0, half.x(), half.y(), half.z())).coeffs();
    }
    return lift;
  }
  void Move(const VectorXd& step) {
    for (auto& [id, value] : values_) {
      const Block& block = graph_.block(id);
      const VectorXd d = step.segment(offsets_.at(id), block.tangent_size());
      if (block.geometry == Geometry::kRotation) {
        value = (Quaterniond(Eigen::Vector4d(value)) * Exp(Vector3d(d))).normalized().coeffs();
      } else {
        value += Lift(id) * d;
        if (block.geometry == Geometry::kDirection) value.normalize();
      }
    }
  }
  bool Linearize() {
    H_.setZero(size_, size_);
    g_.setZero(size_);
    cost_ = 0.0;
    for (const auto& entry : graph_.factors()) {
      const Factor& factor = entry.second;
      const int rows = factor.cost->num_residuals();
      std::vector<const double*> parameters;
      std::vector<RowMajor> J;
      std::vector<double*> pointers;
      for (const BlockId& id : factor.blocks) {
        parameters.push_back(values_.at(id).data());
        J.emplace_back(rows, values_.at(id).size());
      }
      for (RowMajor& j : J) pointers.push_back(j.data());
      VectorXd r(rows);
      if (!factor.cost->Evaluate(parameters.data(), r.data(), pointers.data())) return false;
      cost_ += 0.5 * r.squaredNorm();
      std::vector<MatrixXd> by_tangent;
      for (size_t k = 0; k < J.size(); ++k) by_tangent.push_back(J[k] * Lift(factor.blocks[k]));
      for (size_t i = 0; i < J.size(); ++i) {
        const int at = offsets_.at(factor.blocks[i]);
        g_.segment(at, by_tangent[i].cols()) += by_tangent[i].transpose() * r;
        for (size_t k = 0; k < J.size(); ++k) {
          H_.block(at, offsets_.at(factor.blocks[k]), by_tangent[i].cols(), by_tangent[k].cols()) +=
              by_tangent[i].transpose() * by_tangent[k];
        }
      }
    }
    return true;
  }

  const FactorGraph& graph_;
  std::map<BlockId, VectorXd> values_;
  std::map<BlockId, int> offsets_;
  int size_ = 0;
  MatrixXd H_;
  VectorXd g_;
  double cost_ = 0.0;
};

// cost: relative; distance: in sigmas.
void ExpectSolvedToTheMinimum(const FactorGraph& problem, double cost, double distance) {
  FactorGraph solved = problem;
  const SolveReport report = solved.Solve({200, 1e-14});
  ASSERT_TRUE(report.usable) << report.message;
  DenseSolver dense(problem);
  dense.Solve();
  EXPECT_LT(dense.cost(), report.initial_cost);
  EXPECT_NEAR(report.final_cost, dense.cost(), cost * dense.cost());
  EXPECT_LT(dense.DistanceInSigmas(solved).cwiseAbs().maxCoeff(), distance);
}

TEST(FactorGraphSolve, FindsTheMinimumOfAWindow) {
  simulation::Simulated s = simulation::SimulateTracks(ShortScenario(4.0)).value();
  SlidingWindowOptions options;
  options.unsettled_pairs = 20;  // the prior of those that have left is in it
  SlidingWindow window = MakeWindow(s, options);
  FeedAll(s.recording, &window);
  ASSERT_LT(window.graph().num_pairs(), window.num_used_pairs());
  FactorGraph problem = window.graph().graph();
  problem.value({BlockKind::kShutter, 0}) += Eigen::Vector2d(2e-4, 2e-4);  // off what was found
  // A pair of a window is linear while its residuals change by less than a tenth of a sigma.
  ExpectSolvedToTheMinimum(problem, 1e-4, 0.05);
}

// All pairs of 1.5 s, some 40.
PairGraph RefinedGraph(const PairGraphOptions& options) {
  const simulation::Simulated s = simulation::SimulateTracks(ShortScenario(1.5)).value();
  const EstimationInput input = MakeEstimationInput(s.recording);
  PairGraph graph(s.truth, StartOffTheTruth(s.truth), options);
  for (const TimedRate& rate : input.rates) graph.AddRate(rate);
  for (const TimedPair& pair : input.pairs) graph.AddPair(pair);
  return graph;
}

TEST(FactorGraphSolve, FindsTheMinimumOfARefinement) {
  PairGraphOptions options;
  options.sigma = 0.7;
  const PairGraph graph = RefinedGraph(options);
  ASSERT_GT(graph.num_pairs(), 40);
  ExpectSolvedToTheMinimum(graph.graph(), 1e-8, 1e-3);
}

// Where what pairs share is known, their own directions are found beside it.
TEST(FactorGraphSolve, HoldsWhatPairsShare) {
  PairGraphOptions options;
  options.sigma = 0.7;
  options.hold_shared = true;
  PairGraph graph = RefinedGraph(options);
  const auto before = graph.graph().blocks();
  const SolveReport report = graph.Solve({10, 1e-10});
  ASSERT_TRUE(report.usable);
  EXPECT_LT(report.final_cost, report.initial_cost);
  for (const auto& [id, block] : graph.graph().blocks()) {
    const bool own = id.kind == BlockKind::kDirection || id.kind == BlockKind::kBend;
    EXPECT_EQ(block.value != before.at(id).value, own) << static_cast<int>(id.kind);
  }
}

// Pairs that keep their linearisation while nothing changes are evaluated by any number of threads.
TEST(FactorGraphSolve, TheSameBytesWhoeverEvaluates) {
  const int most_threads = MostThreads();
  std::vector<std::vector<VectorXd>> solutions;
  for (const int threads : {0, 1, 2, 3}) {
    LimitThreads(std::max(1, threads));
    PairGraphOptions options;
    options.sigma = 0.7;
    options.keep_within_sigmas = threads == 0 ? -1.0 : 0.0;
    PairGraph graph = RefinedGraph(options);
    ASSERT_TRUE(graph.Solve({10, 1e-10}).usable);
    solutions.emplace_back();
    for (const auto& entry : graph.graph().blocks()) solutions.back().push_back(entry.second.value);
  }
  LimitThreads(most_threads);
  for (const auto& solution : solutions) EXPECT_EQ(solution, solutions.front());
}

}  // namespace
}  // namespace camgyro
