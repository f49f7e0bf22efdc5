// What is plausible of a lens's distortion, and where its fit begins.
#include <gtest/gtest.h>

#include <cmath>

#include "core/effects/catalogue.h"

namespace camgyro {
namespace {

EffectParameter Term(double edge_rad, int column) {
  EffectSetup setup;
  setup.edge_rad = edge_rad;
  return MakeEffects("radial_distortion:kannala_brandt", setup)->parameter(column);
}

// Within 40 degrees off the axis theta^7 is small: a coefficient of -3 bends the edge by a third.
TEST(RadialDistortion, ATermIsPlausibleByWhatItMakesOfTheEdge) {
  const EffectParameter wide = Term(1.4, 2), unit = Term(1.0, 2), phone = Term(0.69, 2);
  EXPECT_EQ(wide.plausible_min, -2.0);
  EXPECT_EQ(unit.plausible_min, -2.0);
  EXPECT_NEAR(std::pow(0.69, 6) * phone.plausible_min, -2.0, 1e-12);
  EXPECT_LT(phone.plausible_min, -3.0);
  EXPECT_EQ(phone.spread, wide.spread);
  EXPECT_NEAR(std::pow(0.69, 2) * Term(0.69, 0).plausible_max, 0.5, 1e-12);
}

// Both shapes begin where the same pixels are seen: at half of the edge, within 0.5 %.
TEST(RadialDistortion, BeginsAtTheLensThatTheMatchesShow) {
  EffectSetup setup;
  setup.edge_rad = std::atan(0.8);
  const auto start = [&](const std::string& shape) {
    const auto effect = FindEffect("radial_distortion")->make(setup, shape);
    Eigen::VectorXd values = Eigen::VectorXd::Zero(effect->size());
    effect->SetStart(values.data());
    return values;
  };
  EXPECT_EQ(start("radtan").norm(), 0.0);
  EXPECT_EQ(start("kannala_brandt").norm(), 0.0);
  setup.division_lambda = -0.25;
  const double seen = 0.4, r = seen / (1.0 - 0.25 * 0.25), theta = std::atan(r);
  const Eigen::VectorXd k = start("radtan"), kb = start("kannala_brandt");
  EXPECT_NEAR(r + k[0] * std::pow(r, 3) + k[1] * std::pow(r, 5), seen, 2e-3);
  EXPECT_NEAR(r + kb[0] * std::pow(theta, 3) + kb[1] * std::pow(theta, 5) +
                  kb[2] * std::pow(theta, 7) + kb[3] * std::pow(theta, 9),
              seen, 1e-3);
  EXPECT_LT(k[0], -0.2);
}

}  // namespace
}  // namespace camgyro
