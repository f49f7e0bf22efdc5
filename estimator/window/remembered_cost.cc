#include "estimator/window/remembered_cost.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace camgyro {

RememberedCost::RememberedCost(std::shared_ptr<const ceres::CostFunction> cost)
    : cost_(std::move(cost)) {
  set_num_residuals(cost_->num_residuals());
  *mutable_parameter_block_sizes() = cost_->parameter_block_sizes();
}

bool RememberedCost::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  if (Knows(parameters, jacobians)) {
    std::copy(last_.residuals.begin(), last_.residuals.end(), residuals);
    for (size_t i = 0; jacobians != nullptr && i < last_.jacobians.size(); ++i) {
      if (jacobians[i] == nullptr) continue;
      std::copy(last_.jacobians[i].begin(), last_.jacobians[i].end(), jacobians[i]);
    }
    return true;
  }
  if (!cost_->Evaluate(parameters, residuals, jacobians)) return false;
  if (jacobians != nullptr) Remember(parameters, residuals, jacobians);
  return true;
}

bool RememberedCost::Knows(double const* const* parameters, double** jacobians) const {
  if (!last_.known) return false;
  const double* last = last_.parameters.data();
  for (size_t i = 0; i < parameter_block_sizes().size(); ++i) {
    const auto size = static_cast<size_t>(parameter_block_sizes()[i]);
    if (!std::equal(last, last + size, parameters[i])) return false;
    if (jacobians != nullptr && jacobians[i] != nullptr && last_.jacobians[i].empty()) return false;
    last += size;
  }
  return true;
}

void RememberedCost::Remember(double const* const* parameters, const double* residuals,
                              double** jacobians) const {
  const std::vector<int>& sizes = parameter_block_sizes();
  const auto rows = static_cast<size_t>(num_residuals());
  last_.parameters.clear();
  last_.jacobians.resize(sizes.size());
  for (size_t i = 0; i < sizes.size(); ++i) {
    const auto size = static_cast<size_t>(sizes[i]);
    last_.parameters.insert(last_.parameters.end(), parameters[i], parameters[i] + size);
    if (jacobians[i] == nullptr) {
      last_.jacobians[i].clear();
    } else {
      last_.jacobians[i].assign(jacobians[i], jacobians[i] + rows * size);
    }
  }
  last_.residuals.assign(residuals, residuals + rows);
  last_.known = true;
}

}  // namespace camgyro
