// The comparison in words and files.
#ifndef CAMGYRO_TOOLS_COMPARISON_COMPARISON_REPORT_H_
#define CAMGYRO_TOOLS_COMPARISON_COMPARISON_REPORT_H_

#include <string>
#include <vector>

#include "tools/comparison/statistics.h"

namespace camgyro::comparison {

struct CaseResult {
  std::string name;
  double noise_px = 0.0;      // 0: not known
  std::vector<SeedRun> runs;  // in the order of the seeds; not empty
  std::vector<EstimatorStatistics> statistics;
};

// The tables of a case for the terminal.
std::string CaseTable(const CaseResult& result);

// The same as Markdown, for documents: one table of cost and honesty, one of errors.
std::string ComparisonMarkdown(const std::vector<CaseResult>& results);

// compare.yaml: the same numbers for programs; px, s, rad/s, rad.
std::string ComparisonYaml(const std::vector<CaseResult>& results);

// One row per run and estimator: errors, sigmas, bounds, cost.
std::string RunsCsv(const std::vector<CaseResult>& results);

// One row per frame, estimator and case, of the first seed: errors and sigmas over time.
std::string TracesCsv(const std::vector<CaseResult>& results);

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_COMPARISON_REPORT_H_
