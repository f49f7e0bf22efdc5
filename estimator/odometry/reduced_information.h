// What the factors of a Ceres problem say about some of its blocks, the others eliminated: as
// information for covariances, and as the prior that marginalisation leaves.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_REDUCED_INFORMATION_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_REDUCED_INFORMATION_H_

#include <ceres/problem.h>

#include <Eigen/Core>
#include <unordered_map>
#include <utility>
#include <vector>

namespace camgyro {

// A quadratic about the present values: 1/2 d' H d + g' d + constant.
struct Quadratic {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

// The same as the norm of a residual: 1/2 |S d + r|^2. Directions whose information is below 1e-12
// of the largest, counted in units of each coordinate's own, are left out.
struct SquareRoot {
  Eigen::MatrixXd S;
  Eigen::VectorXd r;
};

class ReducedInformation {
 public:
  // Columns for a block, in its tangent, after those added before. Blocks that are never added
  // count as known.
  void AddBlock(const double* block, int tangent_size);
  int size() const { return size_; }
  // First column of a block that was added.
  int ColumnOf(const double* block) const { return columns_.at(block).first; }

  // Adds a residual block, linearised where its parameters are, its loss applied. False if it
  // cannot be evaluated.
  [[nodiscard]] bool Add(const ceres::Problem& problem, ceres::ResidualBlockId id);

  // Adds residual blocks that share one block of tangent size `tangent_size` that nobody else
  // knows, and eliminates it. What does not determine it is not lost: its undetermined directions
  // take nothing away.
  [[nodiscard]] bool AddWithout(const ceres::Problem& problem,
                                const std::vector<ceres::ResidualBlockId>& ids,
                                const double* eliminated, int tangent_size);

  // Everything that was added; and what is left of it with the first `leading` columns eliminated.
  const Quadratic& All() const { return sum_; }
  Quadratic Without(int leading) const;

 private:
  struct Linearised;
  bool Linearise(const ceres::Problem& problem, ceres::ResidualBlockId id,
                 Linearised* linearised) const;
  void Grow();

  std::unordered_map<const double*, std::pair<int, int>> columns_;  // first, number
  int size_ = 0;
  Quadratic sum_;
};

SquareRoot RootOf(const Quadratic& quadratic);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_REDUCED_INFORMATION_H_
