// How Ceres solves a FactorGraph.
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>

#include "estimator/window/factor_graph.h"
#include "estimator/window/kept_cost.h"
#include "estimator/window/prepare_kept_costs.h"

namespace camgyro {
namespace {

// Stops at the end of a step that lowered the cost by less than the tolerances allow, or after
// which the caller has seen enough.
class StopWhenSettled final : public ceres::IterationCallback {
 public:
  explicit StopWhenSettled(const SolveOptions& options) : options_(options) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (summary.iteration == 0 || !summary.step_is_successful) return ceres::SOLVER_CONTINUE;
    const bool settled = summary.cost_change <= std::min(options_.function_tolerance * summary.cost,
                                                         options_.cost_tolerance) ||
                         (options_.settled && options_.settled());
    return settled ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const SolveOptions options_;
};

ceres::Solver::Options CeresOptions(const SolveOptions& options) {
  ceres::Solver::Options ceres_options;
  ceres_options.logging_type = ceres::SILENT;
  ceres_options.num_threads = 1;
  ceres_options.max_num_iterations = options.max_iterations;
  ceres_options.function_tolerance = options.function_tolerance;
  ceres_options.initial_trust_region_radius = options.trust_region_radius;
  ceres_options.max_trust_region_radius =
      std::max(ceres_options.max_trust_region_radius, options.trust_region_radius);
  ceres_options.gradient_tolerance = 0.0;
  ceres_options.parameter_tolerance = 0.0;
  // The fastest for the window and as fast as any for the refinement (docs/lab/performance.md).
  // SuiteSparse's would wake threads of its BLAS for each small matrix.
  ceres_options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  ceres_options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  return ceres_options;
}

}  // namespace

SolveReport FactorGraph::Solve(const SolveOptions& options) {
  for (const auto& [key, factor] : factors_) {
    const auto* kept = dynamic_cast<const KeptCost*>(factor.cost.get());
    if (kept == nullptr) continue;
    std::vector<const double*> parameters;
    for (const BlockId& id : factor.blocks) parameters.push_back(value(id).data());
    prepare_->Add(kept, std::move(parameters));
  }
  ceres::Solver::Options ceres_options = CeresOptions(options);
  if (std::isfinite(options.cost_tolerance)) {
    double cost = 0.0;
    if (problem_->Evaluate({}, &cost, nullptr, nullptr, nullptr) && cost > 0.0) {
      ceres_options.function_tolerance =
          std::min(options.function_tolerance, options.cost_tolerance / cost);
    }
  }
  StopWhenSettled stop(options);
  ceres_options.update_state_every_iteration = options.settled != nullptr;
  ceres_options.callbacks.push_back(&stop);
  ceres::Solver::Summary summary;
  ceres::Solve(ceres_options, problem_.get(), &summary);
  prepare_->Clear();
  SolveReport report;
  report.usable = summary.IsSolutionUsable();
  report.iterations = std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  report.message = summary.message;
  return report;
}

}  // namespace camgyro
