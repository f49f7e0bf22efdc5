#include "estimator/window/local_equations.h"

#include <ceres/cost_function.h>

#include <vector>

#include "core/linear_algebra.h"
#include "core/sphere.h"
#include "estimator/window/kept_cost.h"

namespace camgyro {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

void LocalEquations::AddAfresh(const FactorGraph& graph, const Factor& factor) {
  const auto* const kept = dynamic_cast<const KeptCost*>(factor.cost.get());
  Add(graph, factor, kept != nullptr ? kept->cost() : *factor.cost);
}

void LocalEquations::Step(FactorGraph* graph) const {
  const Eigen::VectorXd step = -SymmetricSolver(H_).Solve(g_);
  if (!step.allFinite()) return;
  for (const auto& [id, at] : columns_) {
    Eigen::Map<Eigen::VectorXd> value = graph->value(id);
    if (graph->block(id).geometry == Geometry::kDirection) {
      value = (value + TangentsOf(value) * step.segment<2>(at)).normalized();
    } else {
      value += step.segment(at, value.size());
    }
  }
}

void LocalEquations::Add(const FactorGraph& graph, const Factor& factor,
                         const ceres::CostFunction& cost) {
  std::vector<const double*> values;
  std::vector<RowMajor> jacobians;
  std::vector<double*> pointers;
  const int rows = cost.num_residuals();
  jacobians.reserve(factor.blocks.size());
  for (const BlockId& id : factor.blocks) {
    values.push_back(graph.value(id).data());
    const bool wanted = columns_.count(id) > 0;
    jacobians.emplace_back(wanted ? rows : 0, graph.value(id).size());
    pointers.push_back(wanted ? jacobians.back().data() : nullptr);
  }
  Eigen::VectorXd r(rows);
  if (!cost.Evaluate(values.data(), r.data(), pointers.data())) return;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, size_);
  for (size_t i = 0; i < factor.blocks.size(); ++i) {
    if (pointers[i] == nullptr) continue;
    const Block& block = graph.block(factor.blocks[i]);
    const int at = columns_.at(factor.blocks[i]);
    if (block.geometry == Geometry::kDirection) {
      J.middleCols<2>(at) = jacobians[i] * TangentsOf(block.value);
    } else {
      J.middleCols(at, block.tangent_size()) = jacobians[i];
    }
  }
  H_.noalias() += J.transpose() * J;
  g_.noalias() += J.transpose() * r;
}

}  // namespace camgyro
