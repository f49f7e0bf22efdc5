#include "tools/fit_flags.h"

#include <gflags/gflags.h>

DEFINE_string(residual, "plane",
              "image residual of window and refinement: plane, determinant as in the paper, or "
              "transfer, of the rotation alone, for scenes without parallax");
DEFINE_bool(robust, true, "no robust loss in window and refinement: plain least squares");

namespace camgyro {

std::vector<std::string> FitFlags() { return {"residual", "robust"}; }

Status ReadFitFlags(PairGraphOptions* options) {
  if (FLAGS_residual == "plane") {
    options->residual = ResidualKind::kPlane;
  } else if (FLAGS_residual == "determinant") {
    options->residual = ResidualKind::kDeterminant;
  } else if (FLAGS_residual == "transfer") {
    options->residual = ResidualKind::kSymmetricTransfer;
  } else {
    return BadUsage("--residual=" + FLAGS_residual + ": expected plane, determinant or transfer");
  }
  if (!FLAGS_robust) options->robust_threshold = 0.0;
  return {};
}

}  // namespace camgyro
