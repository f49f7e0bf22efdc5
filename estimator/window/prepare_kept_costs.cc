#include "estimator/window/prepare_kept_costs.h"

#include <cstddef>

#include "core/parallel.h"

namespace camgyro {

void PrepareKeptCosts::PrepareForEvaluation(bool /*evaluate_jacobians*/,
                                            bool new_evaluation_point) {
  // Fewer are evaluated sooner than a thread begins: those of a settled window, of which most hold.
  constexpr size_t kLeastForThreads = 16;
  if (!new_evaluation_point || costs_.size() < kLeastForThreads) return;
  // What cannot be evaluated, Ceres hears when it asks.
  ParallelFor(costs_.size(),
              [this](size_t i) { costs_[i].cost->Prepare(costs_[i].parameters.data()); });
}

}  // namespace camgyro
