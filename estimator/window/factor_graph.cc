#include "estimator/window/factor_graph.h"

#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sphere_manifold.h>
#include <glog/logging.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "estimator/window/marginalize.h"
#include "estimator/window/normal_equations.h"
#include "estimator/window/prepare_kept_costs.h"
#include "factors/marginal_prior.h"
#include "factors/rotation_manifold.h"

namespace camgyro {
namespace {

// Null: Euclidean. Without state: all blocks share them.
ceres::Manifold* ManifoldOf(Geometry geometry) {
  static RotationManifold rotation;
  static ceres::SphereManifold<3> direction;
  switch (geometry) {
    case Geometry::kRotation:
      return &rotation;
    case Geometry::kDirection:
      return &direction;
    case Geometry::kEuclidean:
      break;
  }
  return nullptr;
}

// Of a residual that is not a number, or has none where the parameters are.
tl::unexpected<Error> NoValue() {
  return CannotEstimate(
      "a residual has no value at the estimate: a match has no ray through the lens there, or a "
      "parameter has run away");
}

bool IsConstant(const Block& block, int coordinate) {
  return std::find(block.constant.begin(), block.constant.end(), coordinate) !=
         block.constant.end();
}

// Puts the step of a walk in front of the unknowns, and its prior below the rows. What was of the
// state before the step, x - direction * step, is then of the state x after it, and of the step.
void AddWalk(const FactorGraph::Walk& walk, const std::map<BlockId, Eigen::Index>& columns,
             Eigen::MatrixXd* J, Eigen::VectorXd* residuals) {
  CHECK_GT(walk.sigma, 0.0);
  const Eigen::Index rows = J->rows(), size = J->cols();
  Eigen::MatrixXd with = Eigen::MatrixXd::Zero(rows + 1, size + 1);
  with.block(0, 1, rows, size) = *J;
  for (const FactorGraph::FunctionalTerm& term : walk.direction) {
    const auto column = columns.find(term.block);
    if (column == columns.end()) continue;  // nothing that leaves knows it
    with.col(0).head(rows) -= term.weight * J->col(column->second + term.coordinate);
  }
  with(rows, 0) = 1.0 / walk.sigma;
  *J = std::move(with);
  residuals->conservativeResize(rows + 1);
  (*residuals)[rows] = 0.0;
}

}  // namespace

FactorGraph::FactorGraph() : prepare_(std::make_unique<PrepareKeptCosts>()) {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.enable_fast_removal = true;
  options.evaluation_callback = prepare_.get();
  problem_ = std::make_unique<ceres::Problem>(options);
}

FactorGraph::~FactorGraph() = default;
FactorGraph::FactorGraph(FactorGraph&& other) noexcept = default;

FactorGraph::FactorGraph(const FactorGraph& other) : FactorGraph() {
  blocks_ = other.blocks_;
  factors_ = other.factors_;
  next_key_ = other.next_key_;
  for (auto& [id, block] : blocks_) AddToProblem(id, &block);
  for (auto& entry : factors_) AddToProblem(&entry.second);
}

FactorGraph& FactorGraph::operator=(FactorGraph other) noexcept {
  std::swap(blocks_, other.blocks_);
  std::swap(spare_directions_, other.spare_directions_);
  std::swap(factors_, other.factors_);
  std::swap(next_key_, other.next_key_);
  std::swap(subsets_, other.subsets_);
  std::swap(prepare_, other.prepare_);
  std::swap(problem_, other.problem_);
  return *this;
}

void FactorGraph::AddBlock(const BlockId& id, Block block) {
  CHECK(!Has(id)) << "block exists";
  if (block.geometry == Geometry::kDirection && !spare_directions_.empty()) {
    auto node = std::move(spare_directions_.back());
    spare_directions_.pop_back();
    node.key() = id;
    node.mapped() = block;  // a copy: the value keeps its place in memory
    blocks_.insert(std::move(node));
  } else {
    blocks_.emplace(id, std::move(block));
  }
  AddToProblem(id, &blocks_.at(id));
}

void FactorGraph::AddToProblem(const BlockId& id, Block* block) {
  double* const values = block->value.data();
  const auto size = static_cast<int>(block->value.size());
  // Not AddParameterBlock with a manifold, see spare_directions_.
  problem_->AddParameterBlock(values, size);
  if (block->held || block->tangent_size() == 0) {
    problem_->SetParameterBlockConstant(values);
  } else if (!block->constant.empty()) {
    CHECK(block->geometry == Geometry::kEuclidean);
    auto subset = std::make_shared<ceres::SubsetManifold>(size, block->constant);
    problem_->SetManifold(values, subset.get());
    subsets_[id] = std::move(subset);
  } else if (ceres::Manifold* const manifold = ManifoldOf(block->geometry)) {
    problem_->SetManifold(values, manifold);
  }
}

FactorGraph::FactorKey FactorGraph::AddFactor(std::shared_ptr<const ceres::CostFunction> cost,
                                              std::vector<BlockId> blocks) {
  CHECK_EQ(cost->parameter_block_sizes().size(), blocks.size());
  for (size_t i = 0; i < blocks.size(); ++i) {
    CHECK(Has(blocks[i]));
    CHECK_EQ(cost->parameter_block_sizes()[i], block(blocks[i]).value.size());
  }
  const auto added = factors_.emplace(next_key_, Factor{std::move(cost), std::move(blocks)}).first;
  AddToProblem(&added->second);
  return next_key_++;
}

void FactorGraph::AddToProblem(Factor* factor) {
  std::vector<double*> values;
  for (const BlockId& id : factor->blocks) values.push_back(value(id).data());
  // The problem does not own the cost function, and only evaluates it.
  factor->residual_block = problem_->AddResidualBlock(
      const_cast<ceres::CostFunction*>(factor->cost.get()), nullptr, values);
}

void FactorGraph::RemoveFactor(FactorKey key) {
  const auto factor = factors_.find(key);
  if (factor == factors_.end()) return;
  problem_->RemoveResidualBlock(factor->second.residual_block);
  factors_.erase(factor);
}

std::vector<const Factor*> FactorGraph::AllFactors() const {
  std::vector<const Factor*> factors;
  for (const auto& entry : factors_) factors.push_back(&entry.second);
  return factors;
}

Result<FactorGraph::CovarianceReport> FactorGraph::Covariance(
    const std::vector<Functional>& functionals) const {
  const std::vector<const Factor*> factors = AllFactors();
  const Unknowns unknowns(blocks_, factors);
  std::optional<NormalEquations> normal =
      MakeNormalEquations(*problem_, blocks_, factors, unknowns);
  if (!normal) return NoValue();

  Eigen::MatrixXd weights =
      Eigen::MatrixXd::Zero(unknowns.size, static_cast<Eigen::Index>(functionals.size()));
  for (size_t i = 0; i < functionals.size(); ++i) {
    for (const FunctionalTerm& term : functionals[i]) {
      const auto k = static_cast<size_t>(unknowns.numbers.at(term.block));
      weights(unknowns.offsets[k] + term.coordinate, static_cast<Eigen::Index>(i)) += term.weight;
    }
  }
  const auto singular = [] { return CannotEstimate("the information matrix is singular"); };
  if (!normal->information.Factorize()) return singular();
  const Eigen::MatrixXd X = normal->information.Solve(weights);
  if (!X.allFinite()) return singular();
  CovarianceReport report;
  report.covariance = weights.transpose() * X;
  report.covariance = 0.5 * (report.covariance + report.covariance.transpose()).eval();
  if (!(report.covariance.diagonal().array() > 0.0).all()) return singular();

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

Result<Linearization> FactorGraph::Linearize(const std::vector<FactorKey>& keys) const {
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
  FactorValue linear;
  Eigen::Index row = 0;
  for (const Factor* factor : factors) {
    if (!EvaluateFactor(*problem_, blocks_, *factor, &linear)) return NoValue();
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

Result<int> FactorGraph::Marginalize(const std::vector<BlockId>& leaving,
                                     const std::vector<FactorKey>& also,
                                     const std::optional<Walk>& walk) {
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
    const Result<Linearization> linearized = Linearize(touched);
    if (!linearized) return tl::unexpected(linearized.error());
    const Linearization& linear = *linearized;
    // Columns: what leaves first. A staying Euclidean block gets a column for every coordinate,
    // zero for the constant ones, since the prior knows nothing of subsets.
    std::vector<Eigen::Index> order;
    std::vector<BlockId> staying;
    std::map<BlockId, Eigen::Index> columns;  // of what stays
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
        columns[linear.blocks[i]] = static_cast<Eigen::Index>(order.size());
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
    Eigen::VectorXd residuals = linear.residuals;
    if (walk) {
      AddWalk(*walk, columns, &J, &residuals);
      ++num_leaving;
    }
    Elimination elimination = EliminateLeading(J, residuals, num_leaving);
    undetermined = elimination.undetermined;
    if (!staying.empty() && elimination.offset.size() > 0) {
      std::vector<MarginalPrior::Block> prior_blocks;
      for (const BlockId& id : staying) {
        prior_blocks.push_back({value(id), block(id).geometry == Geometry::kRotation
                                               ? MarginalPrior::Kind::kRotation
                                               : MarginalPrior::Kind::kVector});
      }
      AddFactor(std::make_shared<MarginalPrior>(std::move(prior_blocks),
                                                std::move(elimination.sqrt_information),
                                                std::move(elimination.offset)),
                staying);
    }
  }
  for (const FactorKey key : touched) RemoveFactor(key);
  for (const BlockId& id : leaving) {
    problem_->RemoveParameterBlock(value(id).data());
    subsets_.erase(id);
    auto node = blocks_.extract(id);
    if (node.mapped().geometry == Geometry::kDirection)
      spare_directions_.push_back(std::move(node));
  }
  return undetermined;
}

}  // namespace camgyro
