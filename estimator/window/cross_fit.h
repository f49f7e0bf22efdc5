// What the matches of a graph's pairs say of the information that is left in them.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_CROSS_FIT_H_
#define CAMGYRO_ESTIMATOR_WINDOW_CROSS_FIT_H_

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// How far the errors of matches hang together with those of their neighbours in the picture. A
// calibration adds up what matches tell as if each had an error of its own. In real pictures what
// lies side by side is shifted alike, up to 80 px apart in a phone's 640 x 480; compression does
// that (docs/lab/tracking.md#errors-of-neighbours).
class NeighbourCorrelation {
 public:
  // residuals: of the matches, in sigmas; none, or as many (CHECKed). Those beyond `most` are of
  // wrong matches, and left out.
  void Add(const std::vector<Match>& matches, const std::vector<double>& residuals, double most,
           const Eigen::Vector2d& size_px);
  NeighbourCorrelation& operator+=(const NeighbourCorrelation& other);
  NeighbourCorrelation operator*(double factor) const;

  // The variance of the mean of errors that hang together like this, over that of as many
  // independent ones (>= 1; the "design effect", Kish 1965):
  //
  //   1 + 2 sum_(i < j) r_i r_j / sum_i r_i^2
  //
  // over neighbours up to the distance at which the mean product is no longer positive: what is
  // beyond is noise (as the initial positive sequence of Geyer 1992). 1 where the sum is within
  // three sigmas of that of independent errors.
  double DesignEffect() const;

 private:
  // Distances, in parts of the picture's diagonal.
  static constexpr double kBinsPerDiagonal = 64.0;
  static constexpr size_t kBins = 16;

  double matches_ = 0.0, squares_ = 0.0;
  std::array<double, kBins> pairs_{}, products_{};
};

// Sums of squared residuals, bounded as by the loss, of matches that had a say in their pair's
// direction and of the same matches without one. A direction that is the best of many which all say
// little takes more of the variance than its degrees of freedom, and where it takes noise for a
// direction, the information that is left is too large by as much.
struct CrossFit {
  double own = 0.0;       // under the pair's direction and bend, corrected for degrees of freedom
  double expected = 0.0;  // of the next, where every direction is well determined
  double unseen = 0.0;    // each half of the matches under direction and bend of the other half
  NeighbourCorrelation neighbours;

  CrossFit& operator+=(const CrossFit& other) {
    own += other.own;
    expected += other.expected;
    unseen += other.unseen;
    neighbours += other.neighbours;
    return *this;
  }
  CrossFit operator*(double factor) const {
    return {factor * own, factor * expected, factor * unseen, neighbours * factor};
  }
  // By how much to widen the covariance of what the pairs determine (>= 1).
  double inflation() const {
    const double of_directions =
        own > 0.0 ? std::max(1.0, unseen / own) * std::max(1.0, unseen / expected) : 1.0;
    return of_directions * neighbours.DesignEffect();
  }
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_CROSS_FIT_H_
