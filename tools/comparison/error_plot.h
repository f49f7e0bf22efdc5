// Errors against frames with their +-3 sigma, in the manner of figures 5 and 6 of Jia & Evans.
#ifndef CAMGYRO_TOOLS_COMPARISON_ERROR_PLOT_H_
#define CAMGYRO_TOOLS_COMPARISON_ERROR_PLOT_H_

#include <string>

#include "tools/comparison/estimator_runs.h"

namespace camgyro::comparison {

// An SVG with one panel per parameter: error and +-3 sigma of each estimator that has a trace, the
// +-3 sigma of the bound if there is one, and a mark at the right edge for one that has a result
// only. The vertical axis is linear around zero and logarithmic beyond, so that the start and the
// end can both be read.
std::string ErrorPlotSvg(const std::string& title, const SeedRun& run);

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_ERROR_PLOT_H_
