// One estimator on one input: errors over time, cost, and what it believes of itself.
#ifndef CAMGYRO_TOOLS_COMPARISON_ESTIMATOR_RUNS_H_
#define CAMGYRO_TOOLS_COMPARISON_ESTIMATOR_RUNS_H_

#include <string>
#include <vector>

#include "core/calibration.h"
#include "estimator/reference/implicit_ekf.h"
#include "estimator/window/pair_graph.h"
#include "tools/comparison/comparison_input.h"

namespace camgyro::comparison {

// Estimators by their names on the command line: `window` (online), `refinement` (all pairs at
// once, from the window's result), `ekf` (the paper's).
const std::vector<std::string>& EstimatorNames();

// Error and sigma in the order of StateIndex after one more frame.
struct TracePoint {
  int frame = 0;
  StateVector error, sigma;
};

struct EstimatorRun {
  std::string estimator;
  std::string failure;                      // why there is no result; empty: there is
  std::vector<TracePoint> trace;            // of the online estimators
  StateVector error = StateVector::Zero();  // of the result, estimate [-] truth
  StateCovariance covariance = StateCovariance::Zero();
  int frames = 0;
  double cpu_s = 0.0;      // of this estimator alone
  double memory_mb = 0.0;  // peak above what the process held before; 0 where /proc cannot tell
};

// names: of EstimatorNames(). Window and refinement take `graph`, with the noise of the input; the
// filter is told `ekf` as it is.
std::vector<EstimatorRun> RunEstimators(const std::vector<std::string>& names, const Input& input,
                                        const PairGraphOptions& graph, const EkfOptions& ekf);

// A run of one seed: every estimator and the bound (scenarios only; one entry per pair of frames).
struct SeedRun {
  std::vector<EstimatorRun> estimators;
  std::vector<StateCovariance> bound;
};

// To hand a result from one process to another; bytes of this machine.
std::string Pack(const SeedRun& run);
SeedRun Unpack(const std::string& bytes);

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_ESTIMATOR_RUNS_H_
