#include "estimator/window/kept_cost.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
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

class KeptCostTest : public testing::Test {
 protected:
  bool Evaluate(const KeptCost& kept, bool by_x, bool by_y, Value* result) {
    const double* parameters[] = {x_.data(), &y_};
    double* jacobians[] = {by_x ? result->by_x.data() : nullptr,
                           by_y ? result->by_y.data() : nullptr};
    return kept.Evaluate(parameters, result->residuals.data(), by_x || by_y ? jacobians : nullptr);
  }
  bool Evaluate(bool by_x, bool by_y, Value* result) { return Evaluate(kept_, by_x, by_y, result); }

  const std::shared_ptr<Counted> inner_ = std::make_shared<Counted>();
  KeptCost kept_{inner_, {}};
  std::array<double, 2> x_ = {1.0, 2.0};
  double y_ = 3.0;
};

TEST_F(KeptCostTest, GivesTheSameAgainWithoutAnEvaluation) {
  EXPECT_EQ(kept_.num_residuals(), 2);
  EXPECT_EQ(kept_.parameter_block_sizes(), inner_->parameter_block_sizes());
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

TEST_F(KeptCostTest, IsPreparedBeforeItIsAsked) {
  const double* parameters[] = {x_.data(), &y_};
  ASSERT_TRUE(kept_.Prepare(parameters));
  ASSERT_TRUE(kept_.Prepare(parameters));
  Value value;
  ASSERT_TRUE(Evaluate(true, true, &value));
  EXPECT_EQ(inner_->count, 1);
  EXPECT_EQ(value.residuals, (std::array<double, 2>{7.0, 9.0}));
  y_ = -1.0;
  EXPECT_FALSE(kept_.Prepare(parameters));
  EXPECT_FALSE(Evaluate(true, true, &value));
}

TEST_F(KeptCostTest, EvaluatesWhatIsNew) {
  Value result;
  EXPECT_EQ(kept_.number(), 0);
  ASSERT_TRUE(Evaluate(true, false, &result));
  ASSERT_TRUE(Evaluate(true, true, &result));  // a block that was not asked for
  EXPECT_EQ(inner_->count, 1);
  EXPECT_EQ(result.by_y, (std::array<double, 2>{2.0, 6.0}));
  const int64_t first = kept_.number();
  x_[1] = -2.0;
  ASSERT_TRUE(Evaluate(true, true, &result));
  EXPECT_EQ(inner_->count, 2);
  EXPECT_EQ(result.residuals[0], -5.0);
  EXPECT_NE(kept_.number(), first);
  inner_->scale = 2.0;
  kept_.Forget();
  EXPECT_EQ(kept_.number(), 0);
  ASSERT_TRUE(Evaluate(true, true, &result));
  EXPECT_EQ(inner_->count, 3);
  EXPECT_EQ(result.residuals[0], -10.0);
}

// By y the residuals move by (2, 6) dy, of which the root mean square is sqrt(20) dy.
TEST_F(KeptCostTest, StaysLinearWithinItsBounds) {
  const KeptCost kept(inner_, {std::sqrt(20.0) * 0.01, {}});
  Value result;
  ASSERT_TRUE(Evaluate(kept, true, true, &result));
  const int64_t first = kept.number();
  y_ = 3.0 + 0.0099;
  ASSERT_TRUE(Evaluate(kept, false, false, &result));
  EXPECT_EQ(inner_->count, 1);
  EXPECT_EQ(kept.number(), first);
  EXPECT_NEAR(result.residuals[0], 7.0 + 2.0 * 0.0099, 1e-12);
  EXPECT_NEAR(result.residuals[1], 9.0 + 6.0 * 0.0099, 1e-12);  // not 3.0099^2
  // The distance counts from where it was evaluated, not from the last value.
  y_ = 3.0 - 0.0099;
  ASSERT_TRUE(Evaluate(kept, true, true, &result));
  EXPECT_EQ(inner_->count, 1);
  EXPECT_EQ(result.by_y[1], 6.0);
  y_ = 3.0 - 0.0101;
  ASSERT_TRUE(Evaluate(kept, true, true, &result));
  EXPECT_EQ(inner_->count, 2);
  EXPECT_DOUBLE_EQ(result.residuals[1], 2.9899 * 2.9899);
}

TEST_F(KeptCostTest, ABlockMovesNoFurtherThanItsBound) {
  const KeptCost kept(inner_, {std::numeric_limits<double>::infinity(), {{0, 0.5}}});
  Value result;
  ASSERT_TRUE(Evaluate(kept, true, true, &result));
  y_ = 30.0;
  x_[0] = 1.4;
  ASSERT_TRUE(Evaluate(kept, true, true, &result));
  EXPECT_EQ(inner_->count, 1);
  x_[1] = 2.4;  // sqrt(0.32) from the first
  ASSERT_TRUE(Evaluate(kept, true, true, &result));
  EXPECT_EQ(inner_->count, 2);
}

TEST_F(KeptCostTest, WithoutAValueNothingIsKept) {
  Value result;
  ASSERT_TRUE(Evaluate(true, true, &result));
  y_ = -1.0;
  EXPECT_FALSE(Evaluate(true, true, &result));
  EXPECT_EQ(kept_.number(), 0);
  y_ = std::numeric_limits<double>::quiet_NaN();  // differs from itself
  ASSERT_TRUE(Evaluate(true, true, &result));
  ASSERT_TRUE(Evaluate(true, true, &result));
  EXPECT_EQ(inner_->count, 4);
}

}  // namespace
}  // namespace camgyro
