// A cost function that keeps its linearisation while that holds.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_KEPT_COST_H_
#define CAMGYRO_ESTIMATOR_WINDOW_KEPT_COST_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

namespace camgyro {

// How far parameters may move from where a cost function was evaluated.
struct KeepBounds {
  // Root mean square of the change of the residuals, by the linearisation, in their own unit. The
  // default allows for none.
  double rms = 0.0;
  // Of these parameter blocks, the Euclidean distance: for those whose change may bend residuals
  // that hardly move.
  struct OfBlock {
    size_t block = 0;
    double distance = 0.0;
  };
  std::vector<OfBlock> blocks;
};

// Evaluates another cost function only where its parameters are further from where it was evaluated
// than the bounds allow; nearer, it is r0 + J d, with d the change of the parameters as they are
// stored. A pair of a sliding window is solved again and again with parameters that hardly move.
//
// Takes as much memory as the Jacobian. Not thread-safe: each object is for one thread at a time.
class KeptCost final : public ceres::CostFunction {
 public:
  KeptCost(std::shared_ptr<const ceres::CostFunction> cost, KeepBounds bounds);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

  // Evaluates the other cost function now, if Evaluate would have to. Returns what that would.
  bool Prepare(double const* const* parameters) const;

  // The other one.
  const ceres::CostFunction& cost() const { return *cost_; }

  // What the function depends on besides its parameters has changed.
  void Forget() { known_ = false; }

  // Of the linearisation that is kept: another one after each evaluation. 0: none is.
  int64_t number() const { return known_ ? number_ : 0; }

 private:
  // Sets change_ to the change of the residuals. False if it is too large, or nothing is kept.
  bool Holds(double const* const* parameters) const;
  bool Linearise(double const* const* parameters) const;

  const std::shared_ptr<const ceres::CostFunction> cost_;
  const KeepBounds bounds_;
  Eigen::Index size_ = 0;  // of all parameters
  mutable bool known_ = false;
  mutable int64_t number_ = 0;
  mutable Eigen::VectorXd at_, residuals_, change_;
  mutable std::vector<double> by_blocks_;  // Jacobians, one after the other
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_KEPT_COST_H_
