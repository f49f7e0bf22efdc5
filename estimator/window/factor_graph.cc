#include "estimator/window/factor_graph.h"

#include <ceres/sphere_manifold.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "estimator/window/block_cholesky.h"
#include "estimator/window/marginalize.h"
#include "factors/marginal_prior.h"
#include "factors/rotation_manifold.h"

namespace camgyro {
namespace {

const ceres::Manifold* ManifoldOf(const Block& block) {
  static const RotationManifold rotation;
  static const ceres::SphereManifold<3> direction;
  switch (block.geometry) {
    case Geometry::kRotation:
      return &rotation;
    case Geometry::kDirection:
      return &direction;
    case Geometry::kEuclidean:
      break;
  }
  return nullptr;
}

bool IsConstant(const Block& block, int coordinate) {
  return std::find(block.constant.begin(), block.constant.end(), coordinate) !=
         block.constant.end();
}

void Move(const Eigen::VectorXd& tangent, Block* block) {
  if (const ceres::Manifold* manifold = ManifoldOf(*block)) {
    const Eigen::VectorXd from = block->value;
    CHECK(manifold->Plus(from.data(), tangent.data(), block->value.data()));
    return;
  }
  Eigen::Index k = 0;
  for (int c = 0; c < block->value.size(); ++c) {
    if (!IsConstant(*block, c)) block->value[c] += tangent[k++];
  }
}

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A factor at the values of its blocks.
struct LinearFactor {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd J;  // by the tangents of its blocks, side by side
};

// False where the factor has no value.
bool Evaluate(const std::map<BlockId, Block>& blocks, const Factor& factor, LinearFactor* linear) {
  const int rows = factor.cost->num_residuals();
  std::vector<const Block*> touched;
  std::vector<const double*> values;
  Eigen::Index ambient = 0, tangent = 0;
  for (const BlockId& id : factor.blocks) {
    touched.push_back(&blocks.at(id));
    values.push_back(touched.back()->value.data());
    ambient += touched.back()->value.size();
    tangent += touched.back()->tangent_size();
  }
  Eigen::VectorXd storage(rows * ambient);
  std::vector<double*> jacobians;
  double* next = storage.data();
  for (const Block* block : touched) {
    jacobians.push_back(block->tangent_size() > 0 ? next : nullptr);
    next += rows * block->value.size();
  }
  linear->residuals.resize(rows);
  if (!factor.cost->Evaluate(values.data(), linear->residuals.data(), jacobians.data())) {
    return false;
  }
  linear->J.resize(rows, tangent);
  Eigen::Index column = 0;
  for (size_t k = 0; k < touched.size(); ++k) {
    const Block& block = *touched[k];
    const int size = block.tangent_size();
    if (size == 0) continue;
    const Eigen::Map<const RowMajorMatrix> J(jacobians[k], rows, block.value.size());
    if (const ceres::Manifold* manifold = ManifoldOf(block)) {
      RowMajorMatrix plus(block.value.size(), size);
      CHECK(manifold->PlusJacobian(block.value.data(), plus.data()));
      linear->J.middleCols(column, size).noalias() = J.lazyProduct(plus);
      column += size;
    } else if (block.constant.empty()) {
      linear->J.middleCols(column, size) = J;
      column += size;
    } else {
      for (int c = 0; c < block.value.size(); ++c) {
        if (!IsConstant(block, c)) linear->J.col(column++) = J.col(c);
      }
    }
  }
  return linear->residuals.allFinite() && linear->J.allFinite();
}

std::vector<BlockId> BlocksOf(const std::vector<const Factor*>& factors) {
  std::set<BlockId> used;
  for (const Factor* factor : factors) used.insert(factor->blocks.begin(), factor->blocks.end());
  return {used.begin(), used.end()};
}

// The unknowns of some factors in the order of elimination: bends, directions, rates from the last
// to the first, and what all share.
struct Unknowns {
  Unknowns(const std::map<BlockId, Block>& blocks, const std::vector<const Factor*>& factors) {
    ids = BlocksOf(factors);
    std::reverse(ids.begin(), ids.end());
    ids.erase(std::remove_if(ids.begin(), ids.end(),
                             [&](const BlockId& id) { return blocks.at(id).tangent_size() == 0; }),
              ids.end());
    for (const BlockId& id : ids) {
      numbers[id] = static_cast<int>(sizes.size());
      sizes.push_back(blocks.at(id).tangent_size());
      offsets.push_back(size);
      size += sizes.back();
    }
    for (const Factor* factor : factors) {
      of_factors.emplace_back();
      for (const BlockId& id : factor->blocks) {
        if (numbers.count(id) > 0) of_factors.back().push_back(numbers.at(id));
      }
    }
  }

  std::vector<BlockId> ids;
  std::map<BlockId, int> numbers;
  std::vector<int> sizes, offsets;
  int size = 0;
  std::vector<std::vector<int>> of_factors;  // numbers of the unknowns of each factor
};

// Gauss-Newton's equations information * x = -gradient at the values of the blocks.
struct NormalEquations {
  explicit NormalEquations(const Unknowns& unknowns)
      : information(unknowns.sizes), gradient(Eigen::VectorXd::Zero(unknowns.size)) {}

  BlockCholesky information;
  Eigen::VectorXd gradient;
  std::vector<Eigen::VectorXd> gradients;  // of each factor, by its own unknowns
  double cost = 0.0;                       // half the sum of squares
};

std::optional<NormalEquations> Linearized(const std::map<BlockId, Block>& blocks,
                                          const std::vector<const Factor*>& factors,
                                          const Unknowns& unknowns) {
  NormalEquations normal(unknowns);
  LinearFactor linear;
  for (size_t f = 0; f < factors.size(); ++f) {
    if (!Evaluate(blocks, *factors[f], &linear)) return std::nullopt;
    normal.cost += 0.5 * linear.residuals.squaredNorm();
    normal.information.AddSquare(unknowns.of_factors[f], linear.J);
    normal.gradients.push_back(linear.J.transpose() * linear.residuals);
    Eigen::Index column = 0;
    for (const int k : unknowns.of_factors[f]) {
      const int size = unknowns.sizes[static_cast<size_t>(k)];
      normal.gradient.segment(unknowns.offsets[static_cast<size_t>(k)], size) +=
          normal.gradients.back().segment(column, size);
      column += size;
    }
  }
  return normal;
}

}  // namespace

void FactorGraph::AddBlock(const BlockId& id, Block block) {
  CHECK(blocks_.emplace(id, std::move(block)).second) << "block exists";
}

FactorGraph::FactorKey FactorGraph::AddFactor(std::shared_ptr<const ceres::CostFunction> cost,
                                              std::vector<BlockId> blocks) {
  CHECK_EQ(cost->parameter_block_sizes().size(), blocks.size());
  for (size_t i = 0; i < blocks.size(); ++i) {
    CHECK(Has(blocks[i]));
    CHECK_EQ(cost->parameter_block_sizes()[i], value(blocks[i]).size());
  }
  factors_.emplace(next_key_, Factor{std::move(cost), std::move(blocks)});
  return next_key_++;
}

std::vector<const Factor*> FactorGraph::AllFactors() const {
  std::vector<const Factor*> factors;
  for (const auto& entry : factors_) factors.push_back(&entry.second);
  return factors;
}

SolveReport FactorGraph::Solve(const SolveOptions& options) {
  const std::vector<const Factor*> factors = AllFactors();
  const Unknowns unknowns(blocks_, factors);
  SolveReport report;
  std::optional<NormalEquations> now = Linearized(blocks_, factors, unknowns);
  if (!now) {
    report.message = "a factor has no value at the start";
    return report;
  }
  report.initial_cost = report.final_cost = now->cost;
  report.message = "no step can be solved for";
  double damping = 1e-4, growth = 2.0;
  for (report.iterations = 0; report.iterations < options.max_iterations; ++report.iterations) {
    const Eigen::VectorXd added = damping * now->information.Diagonal().cwiseMax(1e-6);
    now->information.AddToDiagonal(added);
    if (now->information.Factorize()) {
      const Eigen::VectorXd step = now->information.Solve(-now->gradient);
      report.usable = true;
      report.message = "no convergence";
      const double expected =
          0.5 * (added.dot(step.cwiseAbs2()) - now->gradient.dot(step));  // fall of the cost
      if (expected <= std::min(options.function_tolerance * now->cost, options.cost_tolerance)) {
        report.message = "convergence";
        break;
      }
      std::vector<Eigen::VectorXd> before;
      for (size_t k = 0; k < unknowns.ids.size(); ++k) {
        Block& block = blocks_.at(unknowns.ids[k]);
        before.push_back(block.value);
        Move(step.segment(unknowns.offsets[k], unknowns.sizes[k]), &block);
      }
      if (expected <= 1e-13 * now->cost) {  // rounding hides whether the cost falls
        report.message = "convergence to rounding";
        break;
      }
      // Most steps are good: linearised at once.
      std::optional<NormalEquations> next = Linearized(blocks_, factors, unknowns);
      const double gain = next ? (now->cost - next->cost) / expected : 0.0;
      if (gain > 1e-3) {
        damping *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
        growth = 2.0;
        now = std::move(next);
        report.final_cost = now->cost;
        continue;
      }
      for (size_t k = 0; k < unknowns.ids.size(); ++k) {
        blocks_.at(unknowns.ids[k]).value = before[k];
      }
    }
    damping *= growth;
    growth *= 2.0;
    now = Linearized(blocks_, factors, unknowns);  // rare: cheaper than copies of the equations
  }
  return report;
}

FactorGraph::CovarianceReport FactorGraph::Covariance(
    const std::vector<Functional>& functionals) const {
  const std::vector<const Factor*> factors = AllFactors();
  const Unknowns unknowns(blocks_, factors);
  std::optional<NormalEquations> normal = Linearized(blocks_, factors, unknowns);
  CHECK(normal) << "a factor could not be evaluated at the present state";

  Eigen::MatrixXd weights =
      Eigen::MatrixXd::Zero(unknowns.size, static_cast<Eigen::Index>(functionals.size()));
  for (size_t i = 0; i < functionals.size(); ++i) {
    for (const FunctionalTerm& term : functionals[i]) {
      const auto k = static_cast<size_t>(unknowns.numbers.at(term.block));
      weights(unknowns.offsets[k] + term.coordinate, static_cast<Eigen::Index>(i)) += term.weight;
    }
  }
  CovarianceReport report;
  if (!normal->information.Factorize()) return report;
  const Eigen::MatrixXd X = normal->information.Solve(weights);
  if (!X.allFinite()) return report;
  report.covariance = weights.transpose() * X;
  report.covariance = 0.5 * (report.covariance + report.covariance.transpose()).eval();
  report.usable = (report.covariance.diagonal().array() > 0.0).all();

  size_t f = 0;
  for (const auto& entry : factors_) {
    Eigen::VectorXd& influence = report.influence[entry.first];
    influence.setZero(X.cols());
    Eigen::Index column = 0;
    for (const int k : unknowns.of_factors[f]) {
      const int size = unknowns.sizes[static_cast<size_t>(k)];
      influence += X.middleRows(unknowns.offsets[static_cast<size_t>(k)], size).transpose() *
                   normal->gradients[f].segment(column, size);
      column += size;
    }
    ++f;
  }
  return report;
}

Linearization FactorGraph::Linearize(const std::vector<FactorKey>& keys) const {
  std::vector<const Factor*> factors;
  for (const FactorKey key : keys) factors.push_back(&factors_.at(key));
  Linearization result;
  result.blocks = BlocksOf(factors);
  int rows = 0, columns = 0;
  for (const BlockId& id : result.blocks) {
    result.offsets.push_back(columns);
    columns += blocks_.at(id).tangent_size();
  }
  result.offsets.push_back(columns);
  for (const Factor* factor : factors) rows += factor->cost->num_residuals();
  result.residuals.resize(rows);
  result.J = Eigen::MatrixXd::Zero(rows, columns);
  LinearFactor linear;
  Eigen::Index row = 0;
  for (const Factor* factor : factors) {
    CHECK(Evaluate(blocks_, *factor, &linear)) << "a factor could not be evaluated";
    result.residuals.segment(row, linear.residuals.size()) = linear.residuals;
    Eigen::Index column = 0;
    for (const BlockId& id : factor->blocks) {
      const auto k = std::lower_bound(result.blocks.begin(), result.blocks.end(), id);
      const int size = blocks_.at(id).tangent_size();
      result.J.block(row, result.offsets[static_cast<size_t>(k - result.blocks.begin())],
                     linear.J.rows(), size) = linear.J.middleCols(column, size);
      column += size;
    }
    row += linear.J.rows();
  }
  return result;
}

int FactorGraph::Marginalize(const std::vector<BlockId>& leaving,
                             const std::vector<FactorKey>& also) {
  const std::set<BlockId> leaving_set(leaving.begin(), leaving.end());
  std::vector<FactorKey> touched;
  for (const auto& [key, factor] : factors_) {
    if (std::count(also.begin(), also.end(), key) > 0 ||
        std::any_of(factor.blocks.begin(), factor.blocks.end(),
                    [&](const BlockId& id) { return leaving_set.count(id) > 0; })) {
      touched.push_back(key);
    }
  }
  int undetermined = 0;
  if (!touched.empty()) {
    const Linearization linear = Linearize(touched);
    // Columns: what leaves first. A staying Euclidean block gets a column for every coordinate,
    // zero for the constant ones, since the prior knows nothing of subsets.
    std::vector<Eigen::Index> order;
    std::vector<BlockId> staying;
    for (const bool leaves : {true, false}) {
      for (size_t i = 0; i < linear.blocks.size(); ++i) {
        if ((leaving_set.count(linear.blocks[i]) > 0) != leaves) continue;
        const Block& block = blocks_.at(linear.blocks[i]);
        if (leaves) {
          for (int c = linear.offsets[i]; c < linear.offsets[i + 1]; ++c) order.push_back(c);
          continue;
        }
        CHECK(block.geometry != Geometry::kDirection) << "a direction leaves with its pair";
        staying.push_back(linear.blocks[i]);
        int column = linear.offsets[i];
        const int size =
            block.geometry == Geometry::kRotation ? 3 : static_cast<int>(block.value.size());
        for (int c = 0; c < size; ++c) {
          order.push_back(IsConstant(block, c) ? -1 : column++);
        }
      }
    }
    int num_leaving = 0;
    for (size_t i = 0; i < linear.blocks.size(); ++i) {
      if (leaving_set.count(linear.blocks[i]) > 0) {
        num_leaving += linear.offsets[i + 1] - linear.offsets[i];
      }
    }
    Eigen::MatrixXd J =
        Eigen::MatrixXd::Zero(linear.J.rows(), static_cast<Eigen::Index>(order.size()));
    for (size_t c = 0; c < order.size(); ++c) {
      if (order[c] >= 0) J.col(static_cast<Eigen::Index>(c)) = linear.J.col(order[c]);
    }
    Elimination elimination = EliminateLeading(J, linear.residuals, num_leaving);
    undetermined = elimination.undetermined;
    if (!staying.empty() && elimination.offset.size() > 0) {
      std::vector<MarginalPrior::Block> prior_blocks;
      for (const BlockId& id : staying) {
        prior_blocks.push_back({value(id), block(id).geometry == Geometry::kRotation});
      }
      AddFactor(std::make_shared<MarginalPrior>(std::move(prior_blocks),
                                                std::move(elimination.sqrt_information),
                                                std::move(elimination.offset)),
                staying);
    }
  }
  for (const FactorKey key : touched) factors_.erase(key);
  for (const BlockId& id : leaving) blocks_.erase(id);
  return undetermined;
}

}  // namespace camgyro
