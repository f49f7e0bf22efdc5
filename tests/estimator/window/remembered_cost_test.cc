#include "estimator/window/remembered_cost.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <memory>

namespace camgyro {
namespace {

// scale * (x0 + x1 * y, y^2), by x = (x0, x1) and y; counts its evaluations.
class Counted final : public ceres::CostFunction {
 public:
  Counted() {
    set_num_residuals(2);
    *mutable_parameter_block_sizes() = {2, 1};
  }
  bool Evaluate(double const* const* p, double* residuals, double** jacobians) const override {
    ++count;
    const double y = p[1][0];
    if (y < 0.0) return false;
    residuals[0] = scale * (p[0][0] + p[0][1] * y);
    residuals[1] = scale * y * y;
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      const std::array<double, 4> by_x = {scale, scale * y, 0.0, 0.0};
      std::copy(by_x.begin(), by_x.end(), jacobians[0]);
    }
    if (jacobians[1] != nullptr) {
      jacobians[1][0] = scale * p[0][1];
      jacobians[1][1] = 2.0 * scale * y;
    }
    return true;
  }
  double scale = 1.0;
  mutable int count = 0;
};

struct Value {
  std::array<double, 2> residuals{};
  std::array<double, 4> by_x{};
  std::array<double, 2> by_y{};
};

class RememberedCostTest : public testing::Test {
 protected:
  bool Evaluate(bool by_x, bool by_y, Value* result) {
    const double* parameters[] = {x_.data(), &y_};
    double* jacobians[] = {by_x ? result->by_x.data() : nullptr,
                           by_y ? result->by_y.data() : nullptr};
    return remembered_.Evaluate(parameters, result->residuals.data(),
                                by_x || by_y ? jacobians : nullptr);
  }

  const std::shared_ptr<Counted> inner_ = std::make_shared<Counted>();
  RememberedCost remembered_{inner_};
  std::array<double, 2> x_ = {1.0, 2.0};
  double y_ = 3.0;
};

TEST_F(RememberedCostTest, GivesTheSameAgainWithoutAnEvaluation) {
  EXPECT_EQ(remembered_.num_residuals(), 2);
  EXPECT_EQ(remembered_.parameter_block_sizes(), inner_->parameter_block_sizes());
  Value first, second, residuals_only;
  ASSERT_TRUE(Evaluate(true, true, &first));
  ASSERT_TRUE(Evaluate(true, true, &second));
  ASSERT_TRUE(Evaluate(false, false, &residuals_only));
  EXPECT_EQ(inner_->count, 1);
  EXPECT_EQ(first.residuals, (std::array<double, 2>{7.0, 9.0}));
  EXPECT_EQ(second.residuals, first.residuals);
  EXPECT_EQ(residuals_only.residuals, first.residuals);
  EXPECT_EQ(second.by_x, (std::array<double, 4>{1.0, 3.0, 0.0, 0.0}));
  EXPECT_EQ(second.by_y, (std::array<double, 2>{2.0, 6.0}));
}

TEST_F(RememberedCostTest, EvaluatesWhatIsNew) {
  Value result;
  ASSERT_TRUE(Evaluate(true, false, &result));
  ASSERT_TRUE(Evaluate(true, true, &result));  // a block that was not asked for
  EXPECT_EQ(inner_->count, 2);
  x_[1] = -2.0;
  ASSERT_TRUE(Evaluate(true, true, &result));
  EXPECT_EQ(inner_->count, 3);
  EXPECT_EQ(result.residuals[0], -5.0);
  inner_->scale = 2.0;
  remembered_.Forget();
  ASSERT_TRUE(Evaluate(true, true, &result));
  EXPECT_EQ(inner_->count, 4);
  EXPECT_EQ(result.residuals[0], -10.0);
}

TEST_F(RememberedCostTest, FailuresAndResidualsAloneAreNotRemembered) {
  Value result;
  ASSERT_TRUE(Evaluate(false, false, &result));
  ASSERT_TRUE(Evaluate(false, false, &result));
  EXPECT_EQ(inner_->count, 2);
  ASSERT_TRUE(Evaluate(true, true, &result));
  y_ = -1.0;
  EXPECT_FALSE(Evaluate(true, true, &result));
  y_ = std::numeric_limits<double>::quiet_NaN();  // differs from itself
  ASSERT_TRUE(Evaluate(true, true, &result));
  ASSERT_TRUE(Evaluate(true, true, &result));
  EXPECT_EQ(inner_->count, 6);
}

}  // namespace
}  // namespace camgyro
