// Pre-integration and row projection: zero at the truth, right size and sign when wrong.
#include <gmock/gmock.h>

#include <cmath>
#include <memory>

#include "core/calibration.h"
#include "core/so3.h"
#include "factors/drift_step.h"
#include "factors/preintegration.h"
#include "factors/row_projection.h"
#include "tests/factors/difference_check.h"

namespace camgyro {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kG = 9.80665;

struct State {
  Quaterniond q = Quaterniond::Identity();
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero();
};

// Two states, and the delta between them by its definition.
struct Scene {
  State i{Exp(Vector3d(0.3, -0.2, 0.5)), {1.0, 2.0, 3.0}, {0.5, -0.7, 0.2}};
  State j{Exp(Vector3d(0.1, 0.4, 0.9)), {1.2, 1.9, 3.1}, {0.8, -0.1, 0.4}};
  Vector3d up = Vector3d(0.1, -0.9, 0.3).normalized();
  Vector3d bias_accel{0.1, -0.2, 0.05};
  StateVector calibration = StateVector::Zero();
  PreintegrationMeasurement m;

  Scene() {
    ImuDelta& d = m.delta;
    d.dt_s = 0.2;
    calibration.segment<3>(kStateBias) << 2e-3, -1e-3, 3e-3;
    const Vector3d db = calibration.segment<3>(kStateBias);
    d.J_rot_bias_gyro << -0.2, 0.01, 0, -0.01, -0.2, 0.02, 0, 0, -0.2;
    d.J_dv_bias_gyro << 0, 0.2, -0.1, -0.2, 0, 0.1, 0.1, -0.1, 0;
    d.J_dp_bias_gyro = 0.1 * d.J_dv_bias_gyro;
    d.J_dv_bias_accel = -0.2 * Eigen::Matrix3d::Identity();
    d.J_dp_bias_accel = -0.02 * Eigen::Matrix3d::Identity();
    d.q_i_j = i.q.conjugate() * j.q * Exp(Vector3d(d.J_rot_bias_gyro * db)).conjugate();
    d.dv = i.q.conjugate() * (j.v - i.v - kG * up * d.dt_s) - d.J_dv_bias_gyro * db -
           d.J_dv_bias_accel * bias_accel;
    d.dp = i.q.conjugate() * (j.p - i.p - i.v * d.dt_s - 0.5 * kG * d.dt_s * d.dt_s * up) -
           d.J_dp_bias_gyro * db - d.J_dp_bias_accel * bias_accel;
    m.covariance.setZero();
    m.covariance.diagonal() << 1e-6, 1e-6, 1e-6, 4e-4, 4e-4, 4e-4, 1e-4, 1e-4, 1e-4;
  }

  Eigen::VectorXd Residual() const {
    const auto factor = MakePreintegration(m);
    const double* parameters[] = {i.q.coeffs().data(), i.p.data(),        i.v.data(),
                                  j.q.coeffs().data(), j.p.data(),        j.v.data(),
                                  up.data(),           bias_accel.data(), calibration.data()};
    Eigen::VectorXd r = Eigen::VectorXd::Constant(9, std::nan(""));
    EXPECT_TRUE(factor->Evaluate(parameters, r.data(), nullptr));
    return r;
  }
};

TEST(Preintegration, IsZeroWhereTheDeltaWasMade) { EXPECT_LT(Scene().Residual().norm(), 1e-9); }

TEST(Preintegration, ResidualIsTheErrorInSigmas) {
  Scene s;
  s.j.q = s.j.q * Exp(Vector3d(0, 0, 2e-3));  // 2 sigma about the last gyro frame's z
  EXPECT_LT((s.Residual() - 2.0 * Eigen::VectorXd::Unit(9, 2)).norm(), 1e-4);
  s = Scene();
  s.j.v += s.i.q * Vector3d(0.06, 0, 0);  // 3 sigma
  EXPECT_LT((s.Residual() - 3.0 * Eigen::VectorXd::Unit(9, 3)).norm(), 1e-9);
  s = Scene();
  s.j.p += s.i.q * Vector3d(0, -0.01, 0);
  EXPECT_LT((s.Residual() + 1.0 * Eigen::VectorXd::Unit(9, 7)).norm(), 1e-9);
}

TEST(Preintegration, CorrelatedNoiseIsWhitened) {
  Scene s;
  s.m.covariance(3, 6) = s.m.covariance(6, 3) = 1.2e-4;  // correlation 0.6
  s.j.v += s.i.q * Vector3d(0.02, 0, 0);
  s.j.p += s.i.q * Vector3d(0.01, 0, 0);
  // e' C^-1 e of (1, 1) sigma with correlation 0.6: 2 (1 - 0.6) / (1 - 0.36).
  EXPECT_NEAR(s.Residual().squaredNorm(), 0.8 / 0.64, 1e-9);
}

TEST(Preintegration, BiasesOfAStateAreThoseThatWereNotTakenOut) {
  Scene s;
  BiasedPreintegrationMeasurement m;
  m.preintegration = s.m;
  m.bias_gyro_rad_s = {0.01, -0.02, 0.03};
  m.bias_accel_m_s2 = {0.3, 0.2, -0.1};
  Vector3d bias_gyro = m.bias_gyro_rad_s + s.calibration.segment<3>(kStateBias);
  Vector3d bias_accel = m.bias_accel_m_s2 + s.bias_accel;
  const auto factor = MakePreintegrationWithBias(m);
  const std::vector<double*> parameters = {
      s.i.q.coeffs().data(), s.i.p.data(), s.i.v.data(),     s.j.q.coeffs().data(), s.j.p.data(),
      s.j.v.data(),          s.up.data(),  bias_gyro.data(), bias_accel.data()};
  Eigen::VectorXd r(9);
  ASSERT_TRUE(factor->Evaluate(parameters.data(), r.data(), nullptr));
  EXPECT_LT(r.norm(), 1e-9);
  bias_accel.x() += 0.1;  // 0.2 s of it: 0.02 m/s, one sigma, and 0.002 m, a fifth of one
  ASSERT_TRUE(factor->Evaluate(parameters.data(), r.data(), nullptr));
  EXPECT_NEAR(r[3], 1.0, 1e-9);
  EXPECT_NEAR(r[6], 0.2, 1e-9);
}

// A point seen by a row 12 ms after the node, through a lens with distortion.
struct Sight {
  State node{Exp(Vector3d(0.3, -0.2, 0.5)), {1.0, 2.0, 3.0}, {0.5, -0.7, 0.2}};
  Vector3d up = Vector3d(0.1, -0.9, 0.3).normalized();
  Vector3d arm{0.03, 0.05, -0.01};
  StateVector calibration = StateVector::Zero();
  Eigen::Vector4d point;
  RowProjectionMeasurement m;
  LensParameters lens = MakePinhole(500.0, {320.0, 240.0}, 1.01);
  Eigen::Vector2d px;

  explicit Sight(double depth_m = 4.0) {
    lens.segment<4>(kK1) << -0.2, 0.05, 1e-3, -1e-3;
    const Vector3d ray(0.25, -0.3, 1.0);
    px = GetLens(DistortionModel::kRadTan).Project(ray, lens).value();
    EXPECT_TRUE(GetLens(DistortionModel::kRadTan).Unproject(px, lens, &m.ray));
    m.node_to_row.dt_s = 0.012;
    m.node_to_row.q_i_j = Exp(Vector3d(0.01, -0.02, 0.015));
    m.node_to_row.dv = {0.1, 0.02, -0.05};
    m.node_to_row.dp = {6e-4, 1e-4, -3e-4};
    m.omega_gyro_rad_s = {0.8, -1.5, 1.2};
    m.row_fraction = 0.7;
    m.q_gyro_cam = Exp(Vector3d(0.1, 1.4, -0.3));
    m.sigma_px = 0.5;
    point << CameraAt(0.0) * (depth_m * ray), 1.0;
  }

  // Camera to world at the row plus dt.
  Eigen::Isometry3d CameraAt(double dt) const {
    const ImuDelta& d = m.node_to_row;
    const Quaterniond q = node.q * d.q_i_j * Exp(Vector3d(m.omega_gyro_rad_s * dt));
    const Vector3d v = node.v + kG * up * d.dt_s + node.q * d.dv;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = (q * m.q_gyro_cam).toRotationMatrix();
    T.translation() = node.p + node.v * d.dt_s + 0.5 * kG * d.dt_s * d.dt_s * up + node.q * d.dp +
                      v * dt + q * arm;
    return T;
  }

  bool Evaluate(Eigen::Vector2d* r) const {
    const auto factor = MakeRowProjection(m);
    const Eigen::Vector4d unit = point.normalized();
    const double* parameters[] = {
        node.q.coeffs().data(), node.p.data(), node.v.data(), up.data(), arm.data(),
        calibration.data(),     unit.data()};
    r->setConstant(std::nan(""));
    return factor->Evaluate(parameters, r->data(), nullptr);
  }
  Eigen::Vector2d Residual() const {
    Eigen::Vector2d r;
    EXPECT_TRUE(Evaluate(&r));
    return r;
  }
};

TEST(RowProjection, IsZeroAtTheTruthNearAndFar) {
  EXPECT_LT(Sight(4.0).Residual().norm(), 1e-9);
  EXPECT_LT(Sight(1e6).Residual().norm(), 1e-6);
}

TEST(RowProjection, ResidualIsThePixelErrorInSigmas) {
  Sight s;
  ASSERT_TRUE(GetLens(DistortionModel::kRadTan)
                  .Unproject(s.px + Eigen::Vector2d(0.1, -0.05), s.lens, &s.m.ray));
  // Seen 0.1 px to the right with a sigma of 0.5 px; the distortion's slope changes by 1e-3.
  EXPECT_LT((s.Residual() - Eigen::Vector2d(0.2, -0.1)).norm(), 1e-3);
}

// Or else a larger focal length would make the noise of all observations smaller, and be preferred.
TEST(RowProjection, APixelIsAPixelAtAnyFocalLength) {
  for (const double focal_px : {0.0, 10.0, -10.0}) {
    Sight s;
    s.calibration[kStateFocal] = focal_px;
    s.calibration[kStateCx] = 0.1 * focal_px;
    const Eigen::Vector2d before = s.Residual();
    ASSERT_TRUE(GetLens(DistortionModel::kRadTan)
                    .Unproject(s.px + Eigen::Vector2d(0.1, -0.05), s.lens, &s.m.ray));
    // Second order of 2 %, and the distortion's slope; it used to be 2 % of 0.2.
    EXPECT_LT((s.Residual() - before - Eigen::Vector2d(0.2, -0.1)).norm(), 1.5e-3) << focal_px;
  }
}

TEST(RowProjection, DelayAndReadoutMoveTheCamera) {
  Sight s;
  s.calibration[kStateDelay] = 2e-3;
  s.calibration[kStateReadout] = -1e-3;
  const double dt = 2e-3 - 1e-3 * 0.7;
  s.point << s.CameraAt(dt) * Vector3d(0.25 * 4.0, -0.3 * 4.0, 4.0), 1.0;
  EXPECT_LT(s.Residual().norm(), 1e-9);
  s.calibration[kStateDelay] = 0.0;
  EXPECT_GT(s.Residual().norm(), 1.0);  // 2 rad/s * 2 ms * 500 px = 2 px: several sigmas
}

TEST(RowProjection, LensAndMountingMoveTheRay) {
  Sight s;
  s.calibration[kStateRotation + 1] = 0.01;
  const Quaterniond turned = s.m.q_gyro_cam * Exp(Vector3d(0.0, 0.01, 0.0));
  const Quaterniond nominal = s.m.q_gyro_cam;
  s.m.q_gyro_cam = turned;
  s.point << s.CameraAt(0.0) * Vector3d(1.0, -1.2, 4.0), 1.0;
  s.m.q_gyro_cam = nominal;
  EXPECT_LT(s.Residual().norm(), 1e-9);

  Sight f;
  f.calibration[kStateFocal] = 1.0;
  f.calibration[kStateCx] = -0.7;
  LensParameters moved = f.lens;
  moved[kFocal] += 1.0;
  moved[kCx] -= 0.7;
  RayJet ray;
  ASSERT_TRUE(GetLens(DistortionModel::kRadTan).Unproject(f.px, moved, &ray));
  f.point << f.CameraAt(0.0) * Vector3d(4.0 * ray.ray), 1.0;
  EXPECT_LT(f.Residual().norm(), 5e-3);  // second order of 1 px in 500
}

TEST(RowProjection, DerivativesAreThoseOfTheResidual) {
  Sight s;
  s.calibration << 1.5, -2.0, 1.0, 2e-3, -3e-3, 0.02, -0.03, 0.01, 0.02, -0.01, 0.03;
  s.node.p += Vector3d(0.02, -0.03, 0.01);
  Eigen::Vector4d point = s.point.normalized();
  const auto factor = MakeRowProjection(s.m);
  ExpectJacobiansMatchDifferences(*factor,
                                  {s.node.q.coeffs().data(), s.node.p.data(), s.node.v.data(),
                                   s.up.data(), s.arm.data(), s.calibration.data(), point.data()},
                                  1e-6, {point.data()});
}

// The point of Sight, seen a second time from elsewhere, by a row of another place in the picture.
struct TwoSights {
  Sight a, b;
  Eigen::Vector4d point;

  // offset_px: where the two sightings are off.
  TwoSights(const Eigen::Vector2d& offset_a_px, const Eigen::Vector2d& offset_b_px) {
    point = a.point.normalized();
    b.node.p += Vector3d(0.3, -0.1, 0.2);
    b.node.q = b.node.q * Exp(Vector3d(0.05, -0.04, 0.03));
    b.m.row_fraction = 0.3;
    b.m.sigma_px = 0.8;
    const Vector3d ray = b.CameraAt(0.0).inverse() * Vector3d(a.point.head<3>());
    b.px = GetLens(DistortionModel::kRadTan).Project(ray, b.lens).value();
    See(a.px + offset_a_px, &a);
    See(b.px + offset_b_px, &b);
  }
  static void See(const Eigen::Vector2d& px, Sight* s) {
    ASSERT_TRUE(GetLens(DistortionModel::kRadTan).Unproject(px, s->lens, &s->m.ray));
  }
  std::vector<double*> Blocks() {
    return {a.node.q.coeffs().data(), a.node.p.data(), a.node.v.data(), b.node.q.coeffs().data(),
            b.node.p.data(),          b.node.v.data(), a.up.data(),     a.arm.data(),
            a.calibration.data(),     point.data()};
  }
  // With steps of 0.1 px from frame to frame.
  Eigen::Vector2d Residual(double frames) {
    const auto from = MakeRowProjection(a.m), to = MakeRowProjection(b.m);
    const auto step =
        MakeDriftStep({from.get(), a.m.sigma_px}, {to.get(), b.m.sigma_px}, 0.1, frames);
    Eigen::Vector2d r;
    EXPECT_TRUE(step->Evaluate(Blocks().data(), r.data(), nullptr));
    return r;
  }
};

TEST(DriftStep, IsZeroWhereBothSightingsAreOffByTheSame) {
  EXPECT_LT(TwoSights({0.0, 0.0}, {0.0, 0.0}).Residual(4.0).norm(), 1e-8);
  // 0.9 px of drift; the distortion's slope changes by 1e-3 of it.
  EXPECT_LT(TwoSights({0.9, -0.4}, {0.9, -0.4}).Residual(4.0).norm(), 0.05);
}

TEST(DriftStep, IsTheStepInSigmasOfItsFrames) {
  // 0.2 px with 0.1 px per frame: two sigmas in one frame, one in four.
  const Eigen::Vector2d one = TwoSights({0.5, 0.5}, {0.7, 0.4}).Residual(1.0);
  EXPECT_LT((one - Eigen::Vector2d(2.0, -1.0)).norm(), 0.03);
  const Eigen::Vector2d four = TwoSights({0.5, 0.5}, {0.7, 0.4}).Residual(4.0);
  EXPECT_LT((four - 0.5 * one).norm(), 1e-9);
}

TEST(DriftStep, DerivativesAreThoseOfTheResidual) {
  TwoSights s({0.3, -0.2}, {-0.5, 0.4});
  s.a.calibration << 1.5, -2.0, 1.0, 2e-3, -3e-3, 0.02, -0.03, 0.01, 0.02, -0.01, 0.03;
  s.a.node.p += Vector3d(0.02, -0.03, 0.01);
  const auto from = MakeRowProjection(s.a.m), to = MakeRowProjection(s.b.m);
  const auto step =
      MakeDriftStep({from.get(), s.a.m.sigma_px}, {to.get(), s.b.m.sigma_px}, 0.1, 3.0);
  ExpectJacobiansMatchDifferences(*step, s.Blocks(), 1e-6, {s.point.data()});
}

TEST(RowProjection, PointsBehindTheCameraAreRefused) {
  Sight s(-4.0);
  Eigen::Vector2d r;
  EXPECT_FALSE(s.Evaluate(&r));
}

}  // namespace
}  // namespace camgyro
