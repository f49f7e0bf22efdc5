// Parameter blocks and factors under stable names: a ceres::Problem whose blocks come and go.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_FACTOR_GRAPH_H_
#define CAMGYRO_ESTIMATOR_WINDOW_FACTOR_GRAPH_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"

namespace ceres {
class Manifold;
class Problem;
namespace internal {
class ResidualBlock;
}  // namespace internal
}  // namespace ceres

namespace camgyro {

class PrepareKeptCosts;

// What a block is. The covariance eliminates from the last kind and index to the first.
enum class BlockKind {
  kLens,
  kShutter,
  kRotation,
  kEffects,
  kBias,
  kRates,
  kFrameTime,
  kDirection,
  kBend
};

struct BlockId {
  BlockKind kind = BlockKind::kLens;
  int64_t index = 0;

  bool operator<(const BlockId& other) const {
    return kind != other.kind ? kind < other.kind : index < other.index;
  }
  bool operator==(const BlockId& other) const { return kind == other.kind && index == other.index; }
};

enum class Geometry {
  kEuclidean,
  kRotation,   // 4 numbers [x y z w], RotationManifold
  kDirection,  // 3 numbers, unit vector, SphereManifold<3>
};

struct Block {
  Geometry geometry = Geometry::kEuclidean;
  Eigen::VectorXd value;
  std::vector<int> constant;  // coordinates that keep their value; Euclidean blocks only
  bool held = false;          // in solves the whole block keeps its value

  int tangent_size() const {
    if (geometry == Geometry::kRotation) return 3;
    if (geometry == Geometry::kDirection) return 2;
    return static_cast<int>(value.size() - static_cast<Eigen::Index>(constant.size()));
  }
};

struct Factor {
  std::shared_ptr<const ceres::CostFunction> cost;
  std::vector<BlockId> blocks;
  ceres::internal::ResidualBlock* residual_block = nullptr;  // in the problem
};

struct SolveOptions {
  int max_iterations = 10;
  // Stops at a step that would lower the cost by less than this fraction of it,
  double function_tolerance = 1e-6;
  // and by less than this: a cost that falls by 0.5 moves an estimate by a sigma, however many
  // factors there are.
  double cost_tolerance = std::numeric_limits<double>::infinity();
  // Or as soon as this is true, if it is given: asked after each step that lowers the cost, with
  // the values of that step in the graph.
  std::function<bool()> settled = nullptr;
  // Of the first step; Ceres' own. Where columns nearly depend on each other, and are determined
  // all the same, its damping would hold what tells them apart.
  double trust_region_radius = 1e4;
};

struct SolveReport {
  bool usable = false;  // numerical success; values are unchanged otherwise
  int iterations = 0;
  double initial_cost = 0.0, final_cost = 0.0;
  std::string message;
};

// Residuals and tangent-space Jacobian of some factors by some blocks. Columns follow `blocks`,
// each with its tangent size; the tangent of a direction block is the one of its manifold.
struct Linearization {
  std::vector<BlockId> blocks;
  std::vector<int> offsets;  // first column of each block, and the number of columns at the end
  Eigen::MatrixXd J;
  Eigen::VectorXd residuals;
};

// Keeps one ceres::Problem for its whole life: blocks and factors are added to and removed from it,
// solves start from the values that are there.
class FactorGraph {
 public:
  using FactorKey = int64_t;

  FactorGraph();
  ~FactorGraph();
  // A copy has values and a problem of its own; cost functions are shared.
  FactorGraph(const FactorGraph& other);
  FactorGraph(FactorGraph&& other) noexcept;
  FactorGraph& operator=(FactorGraph other) noexcept;

  // CHECKs that the block is new.
  void AddBlock(const BlockId& id, Block block);
  // CHECKs that the blocks exist and have the sizes that the cost function expects.
  FactorKey AddFactor(std::shared_ptr<const ceres::CostFunction> cost, std::vector<BlockId> blocks);
  void RemoveFactor(FactorKey key);

  bool Has(const BlockId& id) const { return blocks_.count(id) > 0; }
  const Block& block(const BlockId& id) const { return blocks_.at(id); }
  // The problem points at the numbers: they can be set, but neither moved nor resized.
  Eigen::Map<Eigen::VectorXd> value(const BlockId& id) {
    Eigen::VectorXd& value = blocks_.at(id).value;
    return {value.data(), value.size()};
  }
  const Eigen::VectorXd& value(const BlockId& id) const { return blocks_.at(id).value; }
  const std::map<BlockId, Block>& blocks() const { return blocks_; }
  const std::map<FactorKey, Factor>& factors() const { return factors_; }

  // Levenberg-Marquardt on all factors. Factors whose cost is a KeptCost are evaluated in as many
  // threads as are free, and Ceres sums them up in one: the result does not depend on the threads.
  SolveReport Solve(const SolveOptions& options);

  // Linear functionals of the state with their covariance. Row i of a functional is the sum over
  // blocks of weight * (coordinate of the block's tangent).
  struct FunctionalTerm {
    BlockId block;
    int coordinate = 0;  // of the tangent
    double weight = 1.0;
  };
  using Functional = std::vector<FunctionalTerm>;
  struct CovarianceReport {
    Eigen::MatrixXd covariance;
    // Influence of each factor: minus the first-order effect of its residuals on the functionals
    // (one column per functional); sums to zero at the optimum.
    std::map<FactorKey, Eigen::VectorXd> influence;
  };
  // Errors: kCannotEstimate where a factor has no value, or the information is not positive
  // definite.
  Result<CovarianceReport> Covariance(const std::vector<Functional>& functionals) const;

  // Linearises the given factors by the blocks that they touch (sorted by id). Errors:
  // kCannotEstimate where one has no value.
  Result<Linearization> Linearize(const std::vector<FactorKey>& keys) const;

  // A random walk: what stays has moved by N(0, sigma^2) along a direction of Euclidean blocks
  // since the factors that leave were true.
  struct Walk {
    Functional direction;
    double sigma = 0.0;  // > 0
  };
  // Removes `leaving` and every factor that touches them, and the factors `also`, and adds a
  // MarginalPrior that says the same about the neighbours, after their walk if there is one.
  // Returns the number of directions of `leaving` that no factor determined (0 in a sound window).
  // No neighbours: nothing is added. Errors: those of Linearize; then nothing has changed.
  Result<int> Marginalize(const std::vector<BlockId>& leaving,
                          const std::vector<FactorKey>& also = {},
                          const std::optional<Walk>& walk = std::nullopt);

 private:
  std::vector<const Factor*> AllFactors() const;
  void AddToProblem(const BlockId& id, Block* block);
  void AddToProblem(Factor* factor);

  std::map<BlockId, Block> blocks_;  // nodes: values stay where they are
  // Directions that have left, for those that come: ceres::Problem 2.1 keeps an entry for every
  // address that ever had a manifold, so that new addresses would let it grow with each pair.
  std::vector<std::map<BlockId, Block>::node_type> spare_directions_;
  std::map<FactorKey, Factor> factors_;
  FactorKey next_key_ = 0;
  std::map<BlockId, std::shared_ptr<ceres::Manifold>> subsets_;  // of blocks partly constant
  std::unique_ptr<PrepareKeptCosts> prepare_;                    // the problem has its address
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_FACTOR_GRAPH_H_
