// A cost function that remembers its last Jacobian.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_REMEMBERED_COST_H_
#define CAMGYRO_ESTIMATOR_WINDOW_REMEMBERED_COST_H_

#include <ceres/cost_function.h>

#include <memory>
#include <vector>

namespace camgyro {

// Evaluates another cost function, and gives the last residuals and Jacobians again while the
// parameters are the same to the bit. A solve evaluates at its end what the covariance and the next
// solve ask for at their beginning. Takes as much memory as the Jacobian. Not thread-safe.
class RememberedCost final : public ceres::CostFunction {
 public:
  explicit RememberedCost(std::shared_ptr<const ceres::CostFunction> cost);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  // What the function depends on besides its parameters has changed.
  void Forget() { last_.known = false; }

 private:
  struct Last {
    bool known = false;
    std::vector<double> parameters, residuals;
    std::vector<std::vector<double>> jacobians;  // one per block; empty: was not asked for
  };
  bool Knows(double const* const* parameters, double** jacobians) const;
  void Remember(double const* const* parameters, const double* residuals, double** jacobians) const;

  const std::shared_ptr<const ceres::CostFunction> cost_;
  mutable Last last_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_REMEMBERED_COST_H_
