// Marginalisation as small pure functions: what leaves is linearised (FactorGraph::Linearize),
// eliminated, and turned into a prior on what stays.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_MARGINALIZE_H_
#define CAMGYRO_ESTIMATOR_WINDOW_MARGINALIZE_H_

#include <Eigen/Core>

namespace camgyro {

struct Elimination {
  Eigen::MatrixXd sqrt_information;  // rows x staying columns, upper trapezoidal
  Eigen::VectorXd offset;            // rows
  int undetermined = 0;              // directions of the leaving columns without information
};

// Eliminates the first `num_leaving` columns of the least-squares problem min |J x + r|^2: returns
// S, s with min over the leaving part = |S x_stay + s|^2 + constant. Householder QR with column
// pivoting on the leaving columns, each scaled to unit norm; a direction whose pivot is below
// 1e-10 of the largest carries no information, and its rows are kept for what stays.
Elimination EliminateLeading(const Eigen::MatrixXd& J, const Eigen::VectorXd& residuals,
                             int num_leaving);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_MARGINALIZE_H_
