// Evaluates the kept costs of a problem in parallel, before Ceres asks for them one by one.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PREPARE_KEPT_COSTS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PREPARE_KEPT_COSTS_H_

#include <ceres/evaluation_callback.h>

#include <vector>

#include "estimator/window/kept_cost.h"

namespace camgyro {

// Ceres' own threads would sum the cost and the gradient in an order that depends on their number.
class PrepareKeptCosts final : public ceres::EvaluationCallback {
 public:
  // Both outlive the solve; the parameters are where Ceres writes the point that it evaluates.
  void Add(const KeptCost* cost, std::vector<const double*> parameters) {
    costs_.push_back({cost, std::move(parameters)});
  }
  void Clear() { costs_.clear(); }

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;

 private:
  struct Cost {
    const KeptCost* cost = nullptr;
    std::vector<const double*> parameters;
  };
  std::vector<Cost> costs_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PREPARE_KEPT_COSTS_H_
