// Effects that are not linear in their parameters, held against what they are.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/effects/catalogue.h"

namespace camgyro {
namespace {

// The three axes' readings: polynomials of fourth degree, whose derivatives RateDerivatives sees as
// they are, so that only an effect's own approximations are left.
Eigen::Vector3d Reading(double t) {
  const double s = (t - 0.5) / 0.05;  // as fast as a rotation of 4 Hz
  return {0.3 * s - 0.2 * s * s + 0.1 * s * s * s, 0.2 + 0.3 * s * s - 0.04 * s * s * s * s,
          1.0 - 0.5 * s + 0.02 * s * s * s * s};
}

Eigen::Vector3d ReadingDot(double t) {
  const double s = (t - 0.5) / 0.05;
  return Eigen::Vector3d(0.3 - 0.4 * s + 0.3 * s * s, 0.6 * s - 0.16 * s * s * s,
                         -0.5 + 0.08 * s * s * s) /
         0.05;
}

constexpr double kTime_s = 0.52;

EffectSet Make(const std::string& name) {
  auto gyro = std::make_shared<SensorSamples>();
  gyro->values.resize(3, 201);
  for (Eigen::Index i = 0; i < gyro->values.cols(); ++i) {
    gyro->times_s.push_back(static_cast<double>(i) / 200.0);
    gyro->values.col(i) = Reading(gyro->times_s.back());
  }
  EffectSetup setup;
  setup.frames = {FrameTime(0.0), FrameTime(1.0)};
  setup.gyro = gyro;
  const Result<EffectSet> set = MakeEffects(name, setup);
  EXPECT_TRUE(set) << set.error().message;
  return *set;
}

using Change = std::function<Eigen::Vector3d(const Eigen::VectorXd& values)>;

// Of an effect by itself, and its derivatives.
std::pair<Eigen::Vector3d, Eigen::Matrix3Xd> ChangeAt(const EffectSet& set,
                                                      const Eigen::VectorXd& values) {
  Eigen::Matrix3Xd columns(3, set.size());
  const Eigen::Vector3d change = set.ChangeRate(kTime_s, Reading(kTime_s), values.data(), columns);
  return {change, columns};
}

void ExpectDerivatives(const Change& change, const Eigen::VectorXd& values,
                       const Eigen::Matrix3Xd& columns) {
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(values.size());
    step[k] = 1e-3 * values[k];
    const Eigen::Vector3d slope = (change(values + step) - change(values - step)) / (2.0 * step[k]);
    EXPECT_LT((columns.col(k) - slope).norm(), 1e-5 * slope.norm()) << k;
  }
}

void ExpectIs(const std::string& name, const Eigen::VectorXd& values, const Change& exact) {
  const auto [change, columns] = ChangeAt(Make(name), values);
  EXPECT_LT((change - exact(values)).norm(), 1e-9 * change.norm());
  ExpectDerivatives(exact, values, columns);
}

TEST(NonlinearEffects, AFilterIsOneOfFirstOrder) {
  ExpectIs("gyro_lowpass", Eigen::VectorXd::Constant(1, 0.016 * 0.016),
           [](const Eigen::VectorXd& values) -> Eigen::Vector3d {
             const double T = std::sqrt(values[0]);
             return Reading(kTime_s) - Reading(kTime_s - T) - T * ReadingDot(kTime_s - T);
           });
}

TEST(NonlinearEffects, DelaysOfTheAxesAreDelays) {
  ExpectIs("gyro_axis_delay", Eigen::Vector2d(0.012, -0.007),
           [](const Eigen::VectorXd& values) -> Eigen::Vector3d {
             return {0.0, Reading(kTime_s).y() - Reading(kTime_s + values[0]).y(),
                     Reading(kTime_s).z() - Reading(kTime_s + values[1]).z()};
           });
}

// So that a solver finds its way back.
TEST(NonlinearEffects, GoOnStraightWhereTheyAreNotKnown) {
  const std::vector<std::pair<std::string, Eigen::VectorXd>> beyond = {
      {"gyro_lowpass", Eigen::VectorXd::Constant(1, -1e-3)},
      {"gyro_lowpass", Eigen::VectorXd::Constant(1, 3e-3)},
      {"gyro_axis_delay", Eigen::Vector2d(0.05, -0.06)}};
  for (const auto& [name, values] : beyond) {
    const EffectSet set = Make(name);
    const auto change = [&set](const Eigen::VectorXd& at) { return ChangeAt(set, at).first; };
    const auto [here, columns] = ChangeAt(set, values);
    EXPECT_GT(here.norm(), 0.0) << name;
    ExpectDerivatives(change, values, columns);
    EXPECT_LT((change(1.1 * values) - here - columns * (0.1 * values)).norm(), 1e-9 * here.norm())
        << name;
  }
}

}  // namespace
}  // namespace camgyro
