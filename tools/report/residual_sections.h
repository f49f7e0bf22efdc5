// Maps of what fits leave unexplained, any number of fits side by side.
#ifndef CAMGYRO_TOOLS_REPORT_RESIDUAL_SECTIONS_H_
#define CAMGYRO_TOOLS_REPORT_RESIDUAL_SECTIONS_H_

#include <string>
#include <vector>

#include "estimator/residual_table.h"
#include "tools/report/page.h"

namespace camgyro {

struct TitledResiduals {
  std::string title;  // "at the start", "with gyro_scale"
  std::vector<MatchResidual> residuals;
};

// Typical residual over the picture (with the mean correction as arrows), and over row, time and
// rate; every fit on the same scale. noise_px: of one coordinate, drawn as a line. `id` and `title`
// are the section's: a page may hold several.
ReportSection ResidualSection(const std::string& id, const std::string& title,
                              const std::vector<TitledResiduals>& fits, int width_px, int height_px,
                              double noise_px);

// Standard deviation of a Gaussian with the same median magnitude [px]: outliers hardly move it.
// NaN with fewer than `min_count`.
double TypicalResidual(const std::vector<double>& residuals_px, size_t min_count);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_RESIDUAL_SECTIONS_H_
