// What devices of a class usually have: the table, and what MakeEffects makes of it.
#include "core/effects/device_class.h"

#include <gmock/gmock.h>

#include <memory>
#include <string>

#include "core/effects/catalogue.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

// Ten seconds of a camera, a gyro and an accelerometer.
EffectSetup TenSeconds() {
  EffectSetup setup;
  setup.size_px = {720.0, 480.0};
  SensorSamples gyro;
  for (int i = 0; i < 300; ++i) {
    setup.frames.push_back(FrameTime(i / 30.0, 0.005 + 0.002 * (i % 3)));
    gyro.times_s.push_back(i / 30.0);
  }
  gyro.values = Eigen::Matrix3Xd::Random(3, 300);
  setup.gyro = std::make_shared<SensorSamples>(gyro);
  setup.accel = std::make_shared<SensorSamples>(
      SensorSamples{gyro.times_s, 9.8 * Eigen::Matrix3Xd::Random(3, 300)});
  return setup;
}

// Every row of the table is an effect that exists, in a shape that exists, with a size that is less
// than what the catalogue calls plausible.
TEST(DeviceClass, TheTableNamesEffectsOfTheCatalogue) {
  const EffectSetup setup = TenSeconds();
  for (const UsualEffect& usual : UsualEffects()) {
    const EffectEntry* entry = FindEffect(usual.effect);
    ASSERT_NE(entry, nullptr) << usual.effect;
    const auto effect = entry->make(setup, usual.shape);
    EXPECT_GT(std::string(usual.source).size(), 10u);
    if (effect == nullptr) continue;  // this setup's gyro is too slow for derivatives
    for (const EffectParameter& p : effect->parameters()) {
      for (const double sigma : usual.sigma) {
        EXPECT_GT(sigma, 0.0) << usual.effect;
        EXPECT_LE(3.0 * sigma, 3.0 * p.spread) << usual.effect << " " << p.name;
        EXPECT_LE(2.0 * sigma, p.plausible_max) << usual.effect << " " << p.name;
      }
    }
  }
  for (const auto device :
       {DeviceClass::kPhone, DeviceClass::kActionCamera, DeviceClass::kIndustrial}) {
    EXPECT_EQ(DeviceClassOf(DeviceClassName(device)).value(), device);
  }
  EXPECT_FALSE(DeviceClassOf("toaster").has_value());
}

// Of the item: the standard deviation of its parameters' prior.
double PriorSigma(const EffectSet& set, const std::string& name) {
  for (const EffectSet::Item& item : set.items()) {
    if (item.entry->name == name) return set.parameter(item.first).spread;
  }
  ADD_FAILURE() << "no " << name;
  return 0.0;
}

TEST(DeviceClass, UsualStandsForWhatTheClassHas) {
  const Result<EffectSet> phone = MakeEffects("usual", TenSeconds());
  const Result<EffectSet> industrial = MakeEffects("usual:industrial", TenSeconds());
  ASSERT_TRUE(phone && industrial);
  EXPECT_EQ(PriorSigma(*phone, "gyro_scale"), 0.01);
  EXPECT_EQ(PriorSigma(*industrial, "gyro_scale"), 0.004);
  for (const UsualEffect& usual : UsualEffects()) {
    const bool makes = FindEffect(usual.effect)->make(TenSeconds(), usual.shape) != nullptr;
    EXPECT_TRUE(!makes || phone->Has(usual.effect)) << usual.effect;
  }
  EXPECT_FALSE(phone->Has("delay_step"));
  const Result<EffectSet> toaster = MakeEffects("usual:toaster", TenSeconds());
  ASSERT_FALSE(toaster);
  EXPECT_THAT(toaster.error().message, HasSubstr("phone, action or industrial"));
}

TEST(DeviceClass, WhatIsNamedOrDeclaredIsNotUsual) {
  const Result<EffectSet> set = MakeEffects("usual,gyro_scale", TenSeconds());
  ASSERT_TRUE(set);
  int scales = 0;
  for (const EffectSet::Item& item : set->items()) scales += item.entry->name == "gyro_scale";
  EXPECT_EQ(scales, 1);
  EXPECT_GT(PriorSigma(*set, "gyro_scale"), 0.01);  // free, as without "usual"
  // A lens may be any lens, as without "usual".
  EXPECT_EQ(PriorSigma(*set, "radial_distortion"),
            PriorSigma(MakeEffects("radial_distortion:radtan", TenSeconds()).value(),
                       "radial_distortion"));
  EffectSetup declared = TenSeconds();
  declared.distortion_model = DistortionModel::kRadTan;
  EXPECT_FALSE(MakeEffects("usual", declared)->Has("radial_distortion"));
  EXPECT_TRUE(MakeEffects("usual", declared)->Has("aspect_ratio"));
  EffectSetup skewed = TenSeconds();  // found by the start: larger than usual
  skewed.clock_skew = 0.01;
  EXPECT_FALSE(MakeEffects("usual", skewed)->Has("clock_skew"));
}

}  // namespace
}  // namespace camgyro
