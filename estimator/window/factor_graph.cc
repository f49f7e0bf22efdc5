#include "estimator/window/factor_graph.h"

#include <ceres/ceres.h>
#include <ceres/sphere_manifold.h>
#include <glog/logging.h>

#include <Eigen/CholmodSupport>
#include <Eigen/Sparse>
#include <algorithm>
#include <set>

#include "estimator/window/marginalize.h"
#include "factors/marginal_prior.h"
#include "factors/rotation_manifold.h"

namespace camgyro {
namespace {

// A ceres::Problem on values that live elsewhere; owns the manifolds.
class ProblemView {
 public:
  ProblemView(const std::map<BlockId, Block>& blocks, const std::vector<const Factor*>& factors,
              const std::function<double*(const BlockId&)>& data)
      : problem_(Options()) {
    std::set<BlockId> used;
    for (const Factor* factor : factors) used.insert(factor->blocks.begin(), factor->blocks.end());
    for (const BlockId& id : used) {
      const Block& block = blocks.at(id);
      double* values = data(id);
      problem_.AddParameterBlock(values, static_cast<int>(block.value.size()), ManifoldOf(block));
      if (block.tangent_size() == 0) problem_.SetParameterBlockConstant(values);
    }
    std::vector<double*> pointers;
    for (const Factor* factor : factors) {
      pointers.clear();
      for (const BlockId& id : factor->blocks) pointers.push_back(data(id));
      // Ceres takes the cost function without const, and never changes it.
      problem_.AddResidualBlock(const_cast<ceres::CostFunction*>(factor->cost.get()), nullptr,
                                pointers);
    }
  }

  ceres::Problem* operator->() { return &problem_; }
  ceres::Problem* get() { return &problem_; }

 private:
  static ceres::Problem::Options Options() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    return options;
  }

  ceres::Manifold* ManifoldOf(const Block& block) {
    switch (block.geometry) {
      case Geometry::kRotation:
        return &rotation_;
      case Geometry::kDirection:
        return &direction_;
      case Geometry::kEuclidean:
        break;
    }
    if (block.constant.empty() || block.tangent_size() == 0) return nullptr;
    subsets_.push_back(std::make_unique<ceres::SubsetManifold>(static_cast<int>(block.value.size()),
                                                               block.constant));
    return subsets_.back().get();
  }

  RotationManifold rotation_;
  ceres::SphereManifold<3> direction_;
  std::vector<std::unique_ptr<ceres::Manifold>> subsets_;
  ceres::Problem problem_;  // refers to the manifolds: destroyed first
};

// The value of a block is never written through this when Ceres only evaluates.
double* Data(const std::map<BlockId, Block>& blocks, const BlockId& id) {
  return const_cast<double*>(blocks.at(id).value.data());
}

struct SparseLinearization {
  std::vector<int> offsets;
  std::vector<double> residuals;
  ceres::CRSMatrix J;
};

SparseLinearization EvaluateSparse(const std::map<BlockId, Block>& blocks,
                                   const std::vector<const Factor*>& factors,
                                   const std::vector<BlockId>& columns) {
  ProblemView problem(blocks, factors, [&](const BlockId& id) { return Data(blocks, id); });
  SparseLinearization result;
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;  // losses are inside our factors
  int offset = 0;
  for (const BlockId& id : columns) {
    result.offsets.push_back(offset);
    if (blocks.at(id).tangent_size() > 0) options.parameter_blocks.push_back(Data(blocks, id));
    offset += blocks.at(id).tangent_size();
  }
  result.offsets.push_back(offset);
  CHECK(problem->Evaluate(options, nullptr, &result.residuals, nullptr, &result.J))
      << "a factor could not be evaluated at the present state";
  return result;
}

std::vector<BlockId> BlocksOf(const std::vector<const Factor*>& factors) {
  std::set<BlockId> used;
  for (const Factor* factor : factors) used.insert(factor->blocks.begin(), factor->blocks.end());
  return {used.begin(), used.end()};
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

SolveReport FactorGraph::Solve(const SolveOptions& options) {
  std::vector<const Factor*> factors;
  for (const auto& entry : factors_) factors.push_back(&entry.second);
  std::map<BlockId, Eigen::VectorXd> before;
  for (const auto& [id, block] : blocks_) before[id] = block.value;
  ProblemView problem(blocks_, factors, [&](const BlockId& id) { return Data(blocks_, id); });

  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  solver.num_threads = 1;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.function_tolerance;
  solver.gradient_tolerance = 1e-12;
  solver.parameter_tolerance = 1e-10;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, problem.get(), &summary);
  SolveReport report;
  report.usable = summary.IsSolutionUsable();
  report.iterations = static_cast<int>(summary.iterations.size());
  report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  report.message = summary.message;
  if (!report.usable) {
    for (auto& [id, value] : before) blocks_.at(id).value = value;
  }
  return report;
}

FactorGraph::CovarianceReport FactorGraph::Covariance(
    const std::vector<Functional>& functionals) const {
  std::vector<const Factor*> factors;
  std::vector<FactorKey> keys;
  for (const auto& [key, factor] : factors_) {
    factors.push_back(&factor);
    keys.push_back(key);
  }
  const std::vector<BlockId> columns = BlocksOf(factors);
  const SparseLinearization linear = EvaluateSparse(blocks_, factors, columns);
  const Eigen::Index n = linear.offsets.back();
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> J(
      linear.J.num_rows, linear.J.num_cols, static_cast<Eigen::Index>(linear.J.values.size()),
      linear.J.rows.data(), linear.J.cols.data(), linear.J.values.data());
  // J^T J factor by factor: the rows of one factor have the same columns, so that each is a small
  // dense product (a general sparse product took a quarter of the online pass).
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd dense;
  for (Eigen::Index row = 0, f = 0; row < J.rows(); ++f) {
    const Eigen::Index rows = factors[static_cast<size_t>(f)]->cost->num_residuals();
    const int begin = linear.J.rows[static_cast<size_t>(row)];
    const int count = linear.J.rows[static_cast<size_t>(row) + 1] - begin;
    const int* const cols = linear.J.cols.data() + begin;
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
        block(linear.J.values.data() + begin, rows, count);
    dense.noalias() = block.transpose() * block;
    for (int j = 0; j < count; ++j) {
      for (int i = 0; i < count; ++i) {
        if (cols[i] >= cols[j]) entries.emplace_back(cols[i], cols[j], dense(i, j));
      }
    }
    row += rows;
  }
  Eigen::SparseMatrix<double> information(n, n);  // lower triangle
  information.setFromTriplets(entries.begin(), entries.end());

  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(functionals.size()));
  for (size_t i = 0; i < functionals.size(); ++i) {
    for (const FunctionalTerm& term : functionals[i]) {
      const auto it = std::lower_bound(columns.begin(), columns.end(), term.block);
      CHECK(it != columns.end() && *it == term.block);
      weights(linear.offsets[static_cast<size_t>(it - columns.begin())] + term.coordinate,
              static_cast<Eigen::Index>(i)) += term.weight;
    }
  }
  CovarianceReport report;
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>> solver(information);
  if (solver.info() != Eigen::Success) return report;
  const Eigen::MatrixXd X = solver.solve(weights);
  if (solver.info() != Eigen::Success || !X.allFinite()) return report;
  report.covariance = weights.transpose() * X;
  report.covariance = 0.5 * (report.covariance + report.covariance.transpose()).eval();
  report.usable = (report.covariance.diagonal().array() > 0.0).all();

  const Eigen::MatrixXd JX = J * X;
  Eigen::Index row = 0;
  for (size_t i = 0; i < factors.size(); ++i) {
    const Eigen::Index rows = factors[i]->cost->num_residuals();
    const Eigen::Map<const Eigen::VectorXd> r(linear.residuals.data() + row, rows);
    report.influence[keys[i]] = JX.middleRows(row, rows).transpose() * r;
    row += rows;
  }
  return report;
}

Linearization FactorGraph::Linearize(const std::vector<FactorKey>& keys) const {
  std::vector<const Factor*> factors;
  for (const FactorKey key : keys) factors.push_back(&factors_.at(key));
  Linearization result;
  result.blocks = BlocksOf(factors);
  const SparseLinearization linear = EvaluateSparse(blocks_, factors, result.blocks);
  result.offsets = linear.offsets;
  result.residuals = Eigen::Map<const Eigen::VectorXd>(
      linear.residuals.data(), static_cast<Eigen::Index>(linear.residuals.size()));
  result.J = Eigen::MatrixXd::Zero(linear.J.num_rows, linear.offsets.back());
  for (int row = 0; row < linear.J.num_rows; ++row) {
    for (int k = linear.J.rows[row]; k < linear.J.rows[row + 1]; ++k) {
      result.J(row, linear.J.cols[k]) = linear.J.values[k];
    }
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
          const bool constant =
              std::find(block.constant.begin(), block.constant.end(), c) != block.constant.end();
          order.push_back(constant ? -1 : column++);
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
