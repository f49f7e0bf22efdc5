#include "core/pair_model.h"

#include <gmock/gmock.h>

#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "core/so3.h"

namespace camgyro {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix32 = Eigen::Matrix<double, 3, 2>;

struct Case {
  LensParameters lens;
  ShutterParameters shutter;
  Eigen::Quaterniond q_gyro_cam;
  std::vector<double> times;
  Eigen::Matrix3Xd rates;
  double frame_time_s = 0.02;
  Vector2d px;
  Vector3d noise_factor{1.0, 0.0, 1.0};

  bool Evaluate(Bearing* bearing) const {
    if (!EvaluateBearing(GetLens(DistortionModel::kRadTan), lens, shutter,
                         q_gyro_cam.toRotationMatrix(), RotationChain(times, rates), frame_time_s,
                         480.0, px, bearing)) {
      return false;
    }
    bearing->ScaleNoise(noise_factor);
    return true;
  }
};

Case RandomCase(uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Case c;
  c.lens = MakePinhole(460.0, {370.0, 245.0}, 1.01);
  c.lens.segment<4>(kK1) << -0.25, 0.06, 0.002, -0.001;
  c.shutter << 0.025, 0.004;
  c.q_gyro_cam = Exp(Vector3d{normal(generator), normal(generator), normal(generator)});
  c.rates.resize(3, 10);
  for (int i = 0; i < 10; ++i) {
    c.times.push_back(0.007 * i);
    c.rates.col(i) = 3.0 * Vector3d{normal(generator), normal(generator), normal(generator)};
  }
  c.px = Vector2d{752 * uniform(generator), 480 * uniform(generator)};
  return c;
}

// Exposure time of a row, by hand: 0.5 s + 30 ms delay + 24 ms * 120/480 = 0.536 s.
TEST(PairModel, RowTimeFollowsEquationTwo) {
  EXPECT_NEAR(RowTimeGyroS(0.5, ShutterParameters(0.024, 0.030), 120.0, 480.0), 0.536, 1e-15);
}

TEST(PairModel, DerivativeByThePixelIncludesTheRowsTime) {
  // The derivative is about 2e-3 rad / px; its row-time part, about 2e-4, is exact up to the
  // chain's commutator, here 2 % of it: rates of 5 rad/s that change at random every 7 ms.
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const Case c = RandomCase(seed);
    Bearing bearing;
    ASSERT_TRUE(c.Evaluate(&bearing));
    for (int k = 0; k < 2; ++k) {
      Case plus = c, minus = c;
      plus.px[k] += 1e-3;
      minus.px[k] -= 1e-3;
      Bearing b_plus, b_minus;
      ASSERT_TRUE(plus.Evaluate(&b_plus) && minus.Evaluate(&b_minus));
      EXPECT_LT(((b_plus.ray_ref - b_minus.ray_ref) / 2e-3 - bearing.J_ray_px.col(k)).norm(), 5e-6);
    }
  }
}

TEST(PairModel, BackpropagationMatchesDifferences) {
  const Vector3d by_ray(0.7, -1.1, 0.4);
  const Matrix32 by_J = (Matrix32() << 300, -200, 100, 150, -250, 50).finished();
  const auto scalar = [&](const Case& c) {
    Bearing b;
    EXPECT_TRUE(c.Evaluate(&b));
    return by_ray.dot(b.ray_ref) + by_J.cwiseProduct(b.J_ray_px).sum();
  };
  for (uint64_t seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    Case c = RandomCase(seed);
    if (seed % 2 == 1) c.noise_factor << 1.3, -0.4, 0.7;
    Bearing bearing;
    ASSERT_TRUE(c.Evaluate(&bearing));
    const RotationChain chain(c.times, c.rates);
    PairGradient gradient;
    Eigen::Matrix3Xd by_rates = Eigen::Matrix3Xd::Zero(3, 10);
    Backpropagate(bearing, chain, 480.0, by_ray, by_J, &gradient, by_rates);
    const auto check = [&](double analytic, double h, auto&& perturb) {
      Case plus = c, minus = c;
      perturb(&plus, h);
      perturb(&minus, -h);
      const double numeric = (scalar(plus) - scalar(minus)) / (2 * h);
      EXPECT_NEAR(analytic, numeric, 1e-6 * (1.0 + std::abs(numeric)));
    };
    for (int k = 0; k < kLensSize; ++k) {
      check(gradient.by_lens[k], k < kAspect ? 1e-3 : 1e-6,
            [k](Case* x, double h) { x->lens[k] += h; });
    }
    for (int k = 0; k < kShutterSize; ++k) {
      check(gradient.by_shutter[k], 1e-7, [k](Case* x, double h) { x->shutter[k] += h; });
    }
    for (int k = 0; k < 3; ++k) {
      check(gradient.by_rotation[k], 1e-6, [k](Case* x, double h) {
        x->q_gyro_cam = x->q_gyro_cam * Exp(Vector3d(h * Vector3d::Unit(k)));
      });
      for (int n = 0; n < 10; ++n) {
        check(by_rates(k, n), 1e-5, [k, n](Case* x, double h) { x->rates(k, n) += h; });
      }
    }
  }
}

// Lens, clock and row effects together, through a recording that has what they need.
TEST(PairModel, BackpropagationByEffectsMatchesDifferences) {
  EffectSetup setup;
  setup.size_px << 752.0, 480.0;
  for (int i = 0; i < 30; ++i) setup.frames.push_back({i / 3.0, 0.003 + 0.001 * (i % 5)});
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  SensorSamples gyro;
  gyro.values.resize(3, 2400);
  for (int i = 0; i < 2400; ++i) {
    gyro.times_s.push_back(0.005 * i);
    gyro.values.col(i) << std::sin(0.02 * i), std::cos(0.03 * i), std::sin(0.01 * i);
  }
  setup.gyro = std::make_shared<SensorSamples>(std::move(gyro));
  const Result<EffectSet> set = MakeEffects(
      "radial_distortion,tangential_distortion,aspect_ratio,focal_drift:curve,"
      "optical_stabilisation:0.5,clock_skew,delay_step:4.1,delay_wander,readout_direction,"
      "readout_nonlinear,exposure_delay",
      setup);
  ASSERT_TRUE(set) << set.error().message;
  const int size = set->size();
  Eigen::VectorXd values(size);
  for (int i = 0; i < size; ++i) values[i] = 0.02 * set->parameter(i).spread * normal(generator);

  const Vector3d by_ray(0.7, -1.1, 0.4);
  const Matrix32 by_J = (Matrix32() << 300, -200, 100, 150, -250, 50).finished();
  for (uint64_t seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE(seed);
    Case c = RandomCase(seed);
    c.frame_time_s = 5.02;
    for (double& t : c.times) t += 5.0;
    const FrameTime frame(c.frame_time_s, 0.006);
    const auto evaluate = [&](const Eigen::VectorXd& v, Bearing* bearing) {
      return EvaluateBearing(GetLens(DistortionModel::kRadTan), c.lens, c.shutter,
                             c.q_gyro_cam.toRotationMatrix(), RotationChain(c.times, c.rates),
                             frame, {752.0, 480.0}, c.px, {&*set, v.data()}, bearing);
    };
    Bearing bearing;
    ASSERT_TRUE(evaluate(values, &bearing));
    PairGradient gradient;
    Eigen::Matrix3Xd by_rates = Eigen::Matrix3Xd::Zero(3, 10);
    Backpropagate(bearing, RotationChain(c.times, c.rates), 480.0, by_ray, by_J, &gradient,
                  by_rates);
    ASSERT_EQ(gradient.by_effects.size(), size);
    for (int k = 0; k < size; ++k) {
      const double h = 1e-4 * set->parameter(k).spread;
      double difference = 0.0;
      for (const double sign : {1.0, -1.0}) {
        Eigen::VectorXd moved = values;
        moved[k] += sign * h;
        Bearing b;
        ASSERT_TRUE(evaluate(moved, &b));
        difference +=
            sign * (by_ray.dot(b.ray_ref) + by_J.cwiseProduct(b.J_ray_px).sum()) / (2.0 * h);
      }
      EXPECT_NEAR(gradient.by_effects[k], difference, 1e-5 * (1.0 + std::abs(difference)))
          << set->items().size() << " " << set->parameter(k).name;
    }
  }
}

// A pixel whose ray is kept, exposed 3 ms later than that says, has the bearing and the derivative
// by time of a frame that is 3 ms later.
TEST(PairModel, ATimedRayTurnsIntoTheSameBearing) {
  EffectSetup setup;
  setup.size_px = Vector2d(752.0, 480.0);
  setup.frames = {FrameTime(0.0), FrameTime(12.0)};
  const Result<EffectSet> set =
      MakeEffects("radial_distortion,clock_skew,readout_direction", setup);
  ASSERT_TRUE(set) << set.error().message;
  Eigen::VectorXd values(set->size());
  for (int i = 0; i < values.size(); ++i) values[i] = 0.02 * set->parameter(i).spread;
  const PairEffects effects{&*set, values.data()};
  const Lens& lens = GetLens(DistortionModel::kRadTan);
  const Vector3d by_ray(0.7, -1.1, 0.4);
  const Matrix32 by_J = (Matrix32() << 300, -200, 100, 150, -250, 50).finished();
  const double later_s = 0.003;
  for (uint64_t seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE(seed);
    const Case c = RandomCase(seed);
    const FrameTime frame(c.frame_time_s);
    const Vector2d size(752.0, 480.0);
    const Eigen::Matrix3d R_gyro_cam = c.q_gyro_cam.toRotationMatrix();
    const RotationChain chain(c.times, c.rates);
    Bearing whole;
    ASSERT_TRUE(EvaluateBearing(lens, c.lens, c.shutter, R_gyro_cam, chain, frame.Moved(later_s),
                                size, c.px, effects, &whole));
    TimedRay timed;
    ASSERT_TRUE(EvaluateTimedRay(lens, c.lens, c.shutter, frame, size, c.px, effects, &timed));
    Bearing turned;
    TurnRay(timed, later_s, R_gyro_cam, chain, &turned);
    for (Bearing* bearing : {&whole, &turned}) bearing->ScaleNoise({1.2, 0.1, 0.9});
    EXPECT_TRUE(turned.ray_ref.isApprox(whole.ray_ref, 1e-13));
    EXPECT_TRUE(turned.J_ray_px.isApprox(whole.J_ray_px, 1e-13));
    EXPECT_NEAR(ByTime(turned, by_ray, by_J), ByTime(whole, by_ray, by_J),
                1e-12 * std::abs(ByTime(whole, by_ray, by_J)));
  }
}

// Rows alone, also from bottom to top; a sensor that was turned; and both at once, as a pixel that
// is read first and last at opposite corners.
TEST(PairModel, ScanOfRowsAndColumns) {
  const Vector2d size(480.0, 640.0);
  const FrameTime frame(5.0, 0.0);
  const auto expect = [&](const Scan& scan, double readout_s, const Vector2d& shares) {
    EXPECT_NEAR(scan.readout_s, readout_s, 1e-15);
    EXPECT_LT((scan.shares - shares).norm(), 1e-12) << scan.shares.transpose();
  };
  expect(ScanOf({0.02, 0.1}, size, {}, frame), 0.02, {0.0, 1.0});
  expect(ScanOf({-0.02, 0.1}, size, {}, frame), -0.02, {0.0, 1.0});
  expect(ScanOf({0.0, 0.1}, size, {}, frame), 0.0, {0.0, 1.0});

  EffectSetup setup;
  setup.size_px = size;
  setup.frames = {frame, FrameTime(5.1, 0.0)};
  const Result<EffectSet> set = MakeEffects("readout_direction", setup);
  ASSERT_TRUE(set) << set.error().message;
  const double value = -0.03;
  const PairEffects columns{&*set, &value};
  expect(ScanOf({0.0, 0.1}, size, columns, frame), -0.03, {1.0, 0.0});
  expect(ScanOf({0.015, 0.1}, size, columns, frame), -0.03, {1.0, -0.5});
  expect(ScanOf({0.06, 0.1}, size, columns, frame), 0.06, {-0.5, 1.0});
}

}  // namespace
}  // namespace camgyro
