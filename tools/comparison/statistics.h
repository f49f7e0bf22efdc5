// What many runs of one estimator amount to.
#ifndef CAMGYRO_TOOLS_COMPARISON_STATISTICS_H_
#define CAMGYRO_TOOLS_COMPARISON_STATISTICS_H_

#include <array>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "tools/comparison/estimator_runs.h"

namespace camgyro::comparison {

// Of one parameter, in its own unit (px, s, rad/s, rad). NaN: not known.
struct ParameterStatistics {
  double rmse = 0.0;
  double sigma = 0.0;           // rms of the claimed standard deviations
  double bound = 0.0;           // rms of the Cramer-Rao bounds of the same runs
  double bias_sigmas = 0.0;     // mean error / sigma
  double within_3_sigma = 0.0;  // share of runs
  // Frames until the error is below 3 x the run's final sigma for good, median over the runs. NaN:
  // in half of the runs it never is, or the estimator has no trace.
  double frames_to_converge = 0.0;
};

struct EstimatorStatistics {
  std::string estimator;
  int runs = 0;  // that gave a result; the others are not in any number below
  int failed = 0;
  std::vector<std::string> failures;  // reasons, each once
  std::array<ParameterStatistics, kStateSize> parameters;
  // e' P^-1 e / 11, mean over the runs; 1 for an estimator whose covariance is right. Interval: 95
  // % of the mean, bootstrapped over the runs; NaN for fewer than 3.
  double nees = 0.0, nees_low = 0.0, nees_high = 0.0;
  double within_3_sigma = 0.0;  // share of all errors of all runs
  double ms_per_frame = 0.0;    // CPU, mean
  double memory_mb = 0.0;       // largest
};

// Statistics of the estimator that is number `index` in every run. runs must not be empty.
EstimatorStatistics Summarize(const std::vector<SeedRun>& runs, size_t index);

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_STATISTICS_H_
