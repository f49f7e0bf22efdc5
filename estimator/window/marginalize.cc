#include "estimator/window/marginalize.h"

#include <Eigen/QR>
#include <algorithm>

namespace camgyro {

Elimination EliminateLeading(const Eigen::MatrixXd& J, const Eigen::VectorXd& residuals,
                             int num_leaving) {
  const Eigen::Index rows = J.rows(), staying = J.cols() - num_leaving;
  Eigen::MatrixXd rest(rows, staying + 1);
  rest << J.rightCols(staying), residuals;
  Elimination result;
  Eigen::Index rank = 0;
  if (num_leaving > 0) {
    Eigen::MatrixXd leaving = J.leftCols(num_leaving);
    for (Eigen::Index c = 0; c < num_leaving; ++c) {
      const double norm = leaving.col(c).norm();
      if (norm > 0.0) leaving.col(c) /= norm;
    }
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(leaving);
    qr.setThreshold(1e-10);
    rank = qr.rank();
    rest.applyOnTheLeft(qr.householderQ().transpose());
  }
  result.undetermined = num_leaving - static_cast<int>(rank);

  // What is left of the rows, compressed to an upper trapezoid.
  const Eigen::MatrixXd below = rest.bottomRows(rows - rank);
  const Eigen::Index kept = std::min<Eigen::Index>(below.rows(), staying);
  if (below.rows() > staying) {
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(below);
    const Eigen::MatrixXd R = qr.matrixQR().topRows(kept).triangularView<Eigen::Upper>();
    result.sqrt_information = R.leftCols(staying);
    result.offset = R.col(staying);
  } else {
    result.sqrt_information = below.leftCols(staying);
    result.offset = below.col(staying);
  }
  return result;
}

}  // namespace camgyro
