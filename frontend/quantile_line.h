// A straight line with a given fraction of some points below it.
#ifndef CAMGYRO_FRONTEND_QUANTILE_LINE_H_
#define CAMGYRO_FRONTEND_QUANTILE_LINE_H_

#include <vector>

namespace camgyro {

struct LinePoint {
  double x = 0.0, y = 0.0;
};
struct StraightLine {
  double x0 = 0.0, y0 = 0.0, slope = 0.0;
  double At(double x) const { return y0 + slope * (x - x0); }
};

// The line with a fraction `q` of the points below it, and the least sum of asymmetric absolute
// distances (quantile regression). Exact: such a line goes through two of the points, and all pairs
// of them are tried. At least one point.
StraightLine QuantileLine(const std::vector<LinePoint>& points, double q);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_QUANTILE_LINE_H_
