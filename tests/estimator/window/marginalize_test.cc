// Elimination of columns against the other ways to do the same.
#include "estimator/window/marginalize.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>

#include "core/linear_algebra.h"
#include "tests/estimator/window/linear_factor.h"

namespace camgyro {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Information and gradient of what is left: what matters of S and s.
struct Remainder {
  MatrixXd information;
  VectorXd gradient;
};
Remainder Of(const Elimination& e) {
  return {e.sqrt_information.transpose() * e.sqrt_information,
          e.sqrt_information.transpose() * e.offset};
}

Remainder Schur(const MatrixXd& J, const VectorXd& r, int leaving) {
  const Eigen::Index staying = J.cols() - leaving;
  const MatrixXd H = J.transpose() * J;
  const VectorXd g = J.transpose() * r;
  const MatrixXd K =
      H.bottomLeftCorner(staying, leaving) *
      H.topLeftCorner(leaving, leaving).ldlt().solve(MatrixXd::Identity(leaving, leaving));
  return {H.bottomRightCorner(staying, staying) - K * H.topRightCorner(leaving, staying),
          g.tail(staying) - K * g.head(leaving)};
}

TEST(EliminateLeading, AgreesWithSchurAndWithInvertCutInvert) {
  for (int seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    RandomNumbers random(static_cast<uint64_t>(seed));
    const int leaving = 1 + seed % 6, staying = 2 + seed % 5;
    MatrixXd J = random.Matrix(30, leaving + staying);
    // Units differ by many orders of magnitude: pixels, seconds, radians.
    for (int c = 0; c < J.cols(); ++c) J.col(c) *= std::pow(10.0, (c * 3) % 7 - 3);
    const VectorXd r = random.Vector(30);
    const Elimination e = EliminateLeading(J, r, leaving);
    EXPECT_EQ(e.undetermined, 0);
    EXPECT_EQ(e.sqrt_information.rows(), staying);
    EXPECT_TRUE(e.sqrt_information.isUpperTriangular(0.0));

    const VectorXd scale =
        (J.rightCols(staying).transpose() * J.rightCols(staying)).diagonal().cwiseSqrt();
    const auto relative = [&](const MatrixXd& m) -> MatrixXd {
      return scale.cwiseInverse().asDiagonal() * m * scale.cwiseInverse().asDiagonal();
    };
    const Remainder got = Of(e), schur = Schur(J, r, leaving);
    EXPECT_LT((relative(got.information) - relative(schur.information)).norm(), 1e-9);
    EXPECT_LT((got.gradient - schur.gradient).cwiseQuotient(scale).norm(), 1e-9);

    // Covariance of what stays, cut out of the whole covariance (columns scaled to unit norm, so
    // that the plain inverse is accurate).
    const VectorXd norms = J.colwise().norm();
    const MatrixXd unit = J * norms.cwiseInverse().asDiagonal();
    const MatrixXd covariance = (unit.transpose() * unit).inverse();
    const MatrixXd cut = covariance.bottomRightCorner(staying, staying).inverse();
    EXPECT_LT((relative(got.information) - cut).norm(), 1e-9);

    // The optimum of the remainder is the staying part of the whole optimum.
    const VectorXd whole = -LeastSquares(unit, r).cwiseQuotient(norms);
    const VectorXd rest = -LeastSquares(e.sqrt_information, e.offset);
    EXPECT_LT((rest - whole.tail(staying)).cwiseProduct(scale).norm(), 1e-9);
  }
}

TEST(EliminateLeading, KeepsTheInformationOfRowsThatDoNotDetermineWhatLeaves) {
  // Two leaving columns that only occur as their sum: one direction is determined, one row is
  // spent on it; everything else stays.
  RandomNumbers random(5);
  MatrixXd J = random.Matrix(12, 5);
  J.col(1) = J.col(0);
  const VectorXd r = random.Vector(12);
  const Elimination e = EliminateLeading(J, r, 2);
  EXPECT_EQ(e.undetermined, 1);
  const Remainder got = Of(e), expected = Schur(J.rightCols(4), r, 1);
  EXPECT_LT((got.information - expected.information).norm(), 1e-9);
  EXPECT_LT((got.gradient - expected.gradient).norm(), 1e-9);
}

TEST(EliminateLeading, ColumnsOfZerosCostNothing) {
  RandomNumbers random(6);
  MatrixXd J = random.Matrix(9, 5);
  J.leftCols(2).setZero();
  const VectorXd r = random.Vector(9);
  const Elimination e = EliminateLeading(J, r, 2);
  EXPECT_EQ(e.undetermined, 2);
  const MatrixXd stay = J.rightCols(3);
  EXPECT_LT((Of(e).information - stay.transpose() * stay).norm(), 1e-9);
  EXPECT_LT((Of(e).gradient - stay.transpose() * r).norm(), 1e-9);
}

TEST(EliminateLeading, FewRowsAreSpentOnWhatLeaves) {
  // Two rows, three leaving columns: nothing is left to say, one direction is open.
  RandomNumbers random(7);
  const Elimination nothing = EliminateLeading(random.Matrix(2, 5), random.Vector(2), 3);
  EXPECT_EQ(nothing.undetermined, 1);
  EXPECT_EQ(nothing.sqrt_information.rows(), 0);
  EXPECT_EQ(nothing.sqrt_information.cols(), 2);
  // Three rows, one leaving column: two rows stay, though four columns could take more.
  const MatrixXd J = random.Matrix(3, 5);
  const VectorXd r = random.Vector(3);
  const Elimination two = EliminateLeading(J, r, 1);
  EXPECT_EQ(two.sqrt_information.rows(), 2);
  EXPECT_LT((Of(two).information - Schur(J, r, 1).information).norm(), 1e-9);
}

TEST(EliminateLeading, RowsOfZerosAndNoRowsAtAll) {
  RandomNumbers random(8);
  MatrixXd J = MatrixXd::Zero(20, 4);
  J.topRows(6) = random.Matrix(6, 4);
  VectorXd r = VectorXd::Zero(20);
  r.head(6) = random.Vector(6);
  const Remainder padded = Of(EliminateLeading(J, r, 2));
  const Remainder plain = Of(EliminateLeading(J.topRows(6), r.head(6), 2));
  EXPECT_LT((padded.information - plain.information).norm(), 1e-12);
  EXPECT_LT((padded.gradient - plain.gradient).norm(), 1e-12);

  const Elimination empty = EliminateLeading(MatrixXd::Zero(4, 3), VectorXd::Zero(4), 1);
  EXPECT_EQ(empty.undetermined, 1);
  EXPECT_EQ(empty.sqrt_information.norm(), 0.0);
}

TEST(EliminateLeading, NothingLeavesIsOnlyACompression) {
  RandomNumbers random(9);
  const MatrixXd J = random.Matrix(15, 4);
  const VectorXd r = random.Vector(15);
  const Elimination e = EliminateLeading(J, r, 0);
  EXPECT_EQ(e.undetermined, 0);
  EXPECT_EQ(e.sqrt_information.rows(), 4);
  EXPECT_LT((Of(e).information - J.transpose() * J).norm(), 1e-9);
  EXPECT_LT((Of(e).gradient - J.transpose() * r).norm(), 1e-9);
}

}  // namespace
}  // namespace camgyro
