#include <gmock/gmock.h>

#include <cmath>
#include <memory>

#include "core/effects/catalogue.h"
#include "core/so3.h"

namespace camgyro {
namespace {

// A second at 200 Hz of a camera that turns by the rotation vector amplitude * sin(2 pi t).
struct Turning {
  static constexpr double kOmega = 2.0 * M_PI;
  Eigen::Quaterniond q_gyro_cam = Exp(Eigen::Vector3d(0.3, -0.5, 1.2));
  Eigen::Vector3d amplitude_cam{0.2, 0.3, -0.5};

  EffectSetup Setup() const {
    auto gyro = std::make_shared<SensorSamples>();
    gyro->values.resize(3, 201);
    for (Eigen::Index i = 0; i <= 200; ++i) {
      gyro->times_s.push_back(0.005 * static_cast<double>(i));
      gyro->values.col(i) = q_gyro_cam * Rate(gyro->times_s.back());
    }
    EffectSetup setup;
    setup.gyro = gyro;
    setup.R_gyro_cam = q_gyro_cam.toRotationMatrix();
    setup.has_pixels = false;
    return setup;
  }
  Eigen::Vector3d Rate(double t) const { return amplitude_cam * kOmega * std::cos(kOmega * t); }
};

// An attitude that is turned by e(t) in its own axes turns faster than the camera, by the
// derivative of the product: what the gyro reads is less by that.
TEST(AttitudeRollingShutter, TakesYawForRollAndRollForYaw) {
  const Turning turning;
  const EffectSetup setup = turning.Setup();
  const auto effect = FindEffect("attitude_rolling_shutter")->make(setup, "rows");
  ASSERT_NE(effect, nullptr);
  for (const double t : {0.2, 0.345, 0.6}) {
    Eigen::Matrix3Xd columns = Eigen::Matrix3Xd::Zero(3, 2);
    effect->ChangeRate(t, turning.q_gyro_cam * turning.Rate(t), columns);
    for (Eigen::Index k = 0; k < 2; ++k) {
      constexpr double kSize_s = 1e-4, kStep_s = 1e-4;
      const auto attitude = [&](double time) {
        const Eigen::Vector3d omega = turning.Rate(time);
        const Eigen::Vector3d error =
            k == 0 ? Eigen::Vector3d(0.0, 0.0, omega.y()) : Eigen::Vector3d(0.0, omega.z(), 0.0);
        return Exp(Eigen::Vector3d(turning.amplitude_cam * std::sin(Turning::kOmega * time))) *
               Exp(Eigen::Vector3d(kSize_s * error));
      };
      const Eigen::Vector3d rate =
          Log(attitude(t - kStep_s).conjugate() * attitude(t + kStep_s)) / (2.0 * kStep_s);
      const Eigen::Vector3d faster = (rate - turning.Rate(t)) / kSize_s;
      EXPECT_LT((columns.col(k) + turning.q_gyro_cam * faster).norm(), 0.003 * faster.norm()) << t;
    }
  }
}

TEST(AttitudeRollingShutter, IsOfAttitudesAlone) {
  EffectSetup setup = Turning().Setup();
  setup.has_pixels = true;  // whose rows have their own times
  EXPECT_THAT(FindEffect("attitude_rolling_shutter")->shapes(setup), testing::IsEmpty());
}

}  // namespace
}  // namespace camgyro
