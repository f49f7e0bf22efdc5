#include "estimator/window/normal_equations.h"

#include <algorithm>
#include <set>

namespace camgyro {

bool EvaluateFactor(const ceres::Problem& problem, const std::map<BlockId, Block>& blocks,
                    const Factor& factor, FactorValue* value) {
  using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const int rows = factor.cost->num_residuals();
  std::vector<int> sizes;
  Eigen::Index columns = 0;
  for (const BlockId& id : factor.blocks) {
    sizes.push_back(blocks.at(id).tangent_size());
    columns += sizes.back();
  }
  Eigen::VectorXd storage(rows * columns);
  std::vector<double*> jacobians;
  double* next = storage.data();
  for (const int size : sizes) {
    jacobians.push_back(size > 0 ? next : nullptr);
    next += rows * size;
  }
  value->residuals.resize(rows);
  if (!problem.EvaluateResidualBlock(factor.residual_block, /*apply_loss_function=*/true, nullptr,
                                     value->residuals.data(), jacobians.data())) {
    return false;
  }
  value->J.resize(rows, columns);
  Eigen::Index column = 0;
  for (size_t k = 0; k < sizes.size(); ++k) {
    if (sizes[k] == 0) continue;
    value->J.middleCols(column, sizes[k]) =
        Eigen::Map<const RowMajorMatrix>(jacobians[k], rows, sizes[k]);
    column += sizes[k];
  }
  return true;  // Ceres has checked that all numbers are finite
}

std::vector<BlockId> BlocksOf(const std::vector<const Factor*>& factors) {
  std::set<BlockId> used;
  for (const Factor* factor : factors) used.insert(factor->blocks.begin(), factor->blocks.end());
  return {used.begin(), used.end()};
}

namespace {

// Frames' own times, rates and biases as one, from the last to the first, by the first factor that
// touches them: each couples a pair with the next one, and if all of one kind went before another,
// every rate would in the end be coupled with every later frame's time, or bias.
void OrderAlongTime(const std::vector<const Factor*>& factors, std::vector<BlockId>* ids) {
  const auto is_timed = [](const BlockId& id) {
    return id.kind == BlockKind::kFrameTime || id.kind == BlockKind::kRates ||
           id.kind == BlockKind::kBias;
  };
  std::map<BlockId, size_t> first;
  for (size_t f = 0; f < factors.size(); ++f) {
    for (const BlockId& id : factors[f]->blocks) {
      if (is_timed(id)) first.emplace(id, f);
    }
  }
  // The kinds are neighbours.
  const auto begin = std::find_if(ids->begin(), ids->end(), is_timed);
  const auto end = std::find_if_not(begin, ids->end(), is_timed);
  std::stable_sort(begin, end,
                   [&](const BlockId& a, const BlockId& b) { return first.at(a) > first.at(b); });
}

}  // namespace

Unknowns::Unknowns(const std::map<BlockId, Block>& blocks,
                   const std::vector<const Factor*>& factors) {
  ids = BlocksOf(factors);
  std::reverse(ids.begin(), ids.end());
  ids.erase(std::remove_if(ids.begin(), ids.end(),
                           [&](const BlockId& id) { return blocks.at(id).tangent_size() == 0; }),
            ids.end());
  OrderAlongTime(factors, &ids);
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

std::optional<NormalEquations> MakeNormalEquations(const ceres::Problem& problem,
                                                   const std::map<BlockId, Block>& blocks,
                                                   const std::vector<const Factor*>& factors,
                                                   const Unknowns& unknowns) {
  NormalEquations normal(unknowns);
  FactorValue linear;
  for (size_t f = 0; f < factors.size(); ++f) {
    if (!EvaluateFactor(problem, blocks, *factors[f], &linear)) return std::nullopt;
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

}  // namespace camgyro
