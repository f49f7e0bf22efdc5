// Schur complements against the dense problem, and the prior that they leave.
#include "estimator/odometry/reduced_information.h"

#include <ceres/autodiff_cost_function.h>
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <array>

namespace camgyro {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// r = A a + B b + C c - d, a: 2, b: 3, c: 1, with numbers that have no symmetry.
struct Linear {
  explicit Linear(int seed) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 6; ++j) J(i, j) = std::sin(1.0 + seed + 2.3 * i + 0.7 * j * j);
      d[i] = std::cos(seed + i);
    }
  }
  template <typename T>
  bool operator()(const T* a, const T* b, const T* c, T* r) const {
    for (int i = 0; i < 4; ++i) {
      r[i] = J(i, 0) * a[0] + J(i, 1) * a[1] + J(i, 2) * b[0] + J(i, 3) * b[1] + J(i, 4) * b[2] +
             J(i, 5) * c[0] - d[i];
    }
    return true;
  }
  Eigen::Matrix<double, 4, 6> J;
  Eigen::Vector4d d;
};

class Problem : public testing::Test {
 protected:
  Problem() {
    for (int seed = 0; seed < 3; ++seed) {
      ids_.push_back(problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<Linear, 4, 2, 3, 1>(new Linear(seed)), nullptr, a_.data(),
          b_.data(), c_.data()));
      const Linear linear(seed);
      VectorXd x(6);
      x << a_[0], a_[1], b_[0], b_[1], b_[2], c_[0];
      H_ += linear.J.transpose() * linear.J;
      g_ += linear.J.transpose() * (linear.J * x - linear.d);
    }
  }
  // H and g of the last `kept` of (a, b, c), the others eliminated.
  Quadratic Expected(int kept) const {
    const int gone = 6 - kept;
    const MatrixXd inverse = H_.topLeftCorner(gone, gone).inverse();
    const MatrixXd W = H_.topRightCorner(gone, kept);
    return {H_.bottomRightCorner(kept, kept) - W.transpose() * inverse * W,
            g_.tail(kept) - W.transpose() * inverse * g_.head(gone)};
  }

  std::array<double, 2> a_{0.3, -0.4};
  std::array<double, 3> b_{1.0, 2.0, -1.0};
  std::array<double, 1> c_{0.5};
  ceres::Problem problem_;
  std::vector<ceres::ResidualBlockId> ids_;
  MatrixXd H_ = MatrixXd::Zero(6, 6);
  VectorXd g_ = VectorXd::Zero(6);
};

TEST_F(Problem, LeadingColumnsAreEliminated) {
  ReducedInformation information;
  information.AddBlock(a_.data(), 2);
  information.AddBlock(b_.data(), 3);
  information.AddBlock(c_.data(), 1);
  for (const auto id : ids_) ASSERT_TRUE(information.Add(problem_, id));
  EXPECT_LT((information.All().H - H_).norm(), 1e-12);
  const Quadratic rest = information.Without(2), expected = Expected(4);
  EXPECT_LT((rest.H - expected.H).norm(), 1e-9);
  EXPECT_LT((rest.g - expected.g).norm(), 1e-9);
}

TEST_F(Problem, ABlockThatNobodyElseKnowsIsEliminatedOnTheWay) {
  ReducedInformation information;
  information.AddBlock(b_.data(), 3);
  information.AddBlock(c_.data(), 1);
  ASSERT_TRUE(information.AddWithout(problem_, ids_, a_.data(), 2));
  const Quadratic expected = Expected(4);
  EXPECT_LT((information.All().H - expected.H).norm(), 1e-9);
  EXPECT_LT((information.All().g - expected.g).norm(), 1e-9);
}

TEST_F(Problem, BlocksThatAreNotAddedCountAsKnown) {
  ReducedInformation information;
  information.AddBlock(c_.data(), 1);
  for (const auto id : ids_) ASSERT_TRUE(information.Add(problem_, id));
  EXPECT_NEAR(information.All().H(0, 0), H_(5, 5), 1e-12);
}

TEST_F(Problem, TheRootIsTheQuadratic) {
  const SquareRoot root = RootOf({H_, g_});
  EXPECT_LT((root.S.transpose() * root.S - H_).norm(), 1e-9);
  EXPECT_LT((root.S.transpose() * root.r - g_).norm(), 1e-9);
}

TEST(RootOf, LeavesOutWhatNothingIsKnownOf) {
  MatrixXd H = MatrixXd::Zero(3, 3);
  H(0, 0) = 4e6;
  H(2, 2) = 1e-4;
  const SquareRoot root = RootOf({H, Eigen::Vector3d(8e6, 0.0, 0.0)});
  EXPECT_EQ(root.S.rows(), 2);
  EXPECT_LT((root.S.transpose() * root.S - H).norm(), 1e-6);
  EXPECT_NEAR((root.S.transpose() * root.r)[0], 8e6, 1e-3);
}

}  // namespace
}  // namespace camgyro
