#include "frontend/quantile_line.h"

#include <cstddef>
#include <limits>

namespace camgyro {

StraightLine QuantileLine(const std::vector<LinePoint>& points, double q) {
  StraightLine best{points.front().x, points.front().y, 0.0};
  double best_cost = std::numeric_limits<double>::infinity();
  for (size_t a = 0; a < points.size(); ++a) {
    for (size_t b = a + 1; b < points.size(); ++b) {
      const StraightLine line{points[a].x, points[a].y,
                              (points[b].y - points[a].y) / (points[b].x - points[a].x)};
      double cost = 0.0;
      for (const LinePoint& p : points) {
        const double distance = p.y - line.At(p.x);
        cost += distance > 0.0 ? q * distance : (q - 1.0) * distance;
        if (cost >= best_cost) break;
      }
      if (cost < best_cost) {
        best_cost = cost;
        best = line;
      }
    }
  }
  return best;
}

}  // namespace camgyro
