// The effects of the catalogue that the simulator can make, all absent by default. Causes and
// realistic sizes of each are in tools/scenarios/effect_NAME.yaml. Times t are seconds after the
// first gyro stamp, on the gyro clock.
#ifndef CAMGYRO_SIMULATION_EFFECTS_ALL_EFFECTS_H_
#define CAMGYRO_SIMULATION_EFFECTS_ALL_EFFECTS_H_

#include "simulation/effects/aspect_ratio.h"
#include "simulation/effects/attitude_rolling_shutter.h"
#include "simulation/effects/bias_drift.h"
#include "simulation/effects/clock_skew.h"
#include "simulation/effects/delay_step.h"
#include "simulation/effects/delay_wander.h"
#include "simulation/effects/electronic_stabilisation.h"
#include "simulation/effects/exposure_delay.h"
#include "simulation/effects/exposure_lowpass.h"
#include "simulation/effects/focal_drift.h"
#include "simulation/effects/frame_stamp_jitter.h"
#include "simulation/effects/gyro_axis_delay.h"
#include "simulation/effects/gyro_g_sensitivity.h"
#include "simulation/effects/gyro_lowpass.h"
#include "simulation/effects/gyro_misalignment.h"
#include "simulation/effects/gyro_saturation.h"
#include "simulation/effects/gyro_scale.h"
#include "simulation/effects/optical_stabilisation.h"
#include "simulation/effects/radial_distortion.h"
#include "simulation/effects/readout_direction.h"
#include "simulation/effects/readout_nonlinear.h"
#include "simulation/effects/tangential_distortion.h"
#include "simulation/effects/translation_acceleration.h"

namespace camgyro::simulation {

struct Effects {
  RadialDistortion radial_distortion;
  TangentialDistortion tangential_distortion;
  AspectRatio aspect_ratio;
  FocalDrift focal_drift;
  OpticalStabilisation optical_stabilisation;
  ClockSkew clock_skew;
  DelayStep delay_step;
  DelayWander delay_wander;
  FrameStampJitter frame_stamp_jitter;
  ReadoutDirection readout_direction;
  ReadoutNonlinear readout_nonlinear;
  GyroScale gyro_scale;
  GyroMisalignment gyro_misalignment;
  GyroLowpass gyro_lowpass;
  GyroAxisDelay gyro_axis_delay;
  GyroSaturation gyro_saturation;
  BiasDrift bias_drift;
  GyroGSensitivity gyro_g_sensitivity;
  ExposureLowpass exposure_lowpass;
  ExposureDelay exposure_delay;
  TranslationAcceleration translation_acceleration;
  AttitudeRollingShutter attitude_rolling_shutter;
  ElectronicStabilisation electronic_stabilisation;

  // Calls visit(effect) for each, in the catalogue's order.
  template <typename Visit>
  void ForEach(const Visit& visit) {
    VisitAll(*this, visit);
  }
  template <typename Visit>
  void ForEach(const Visit& visit) const {
    VisitAll(*this, visit);
  }

 private:
  template <typename Self, typename Visit>
  static void VisitAll(Self& self, const Visit& visit) {
    visit(self.radial_distortion);
    visit(self.tangential_distortion);
    visit(self.aspect_ratio);
    visit(self.focal_drift);
    visit(self.optical_stabilisation);
    visit(self.clock_skew);
    visit(self.delay_step);
    visit(self.delay_wander);
    visit(self.frame_stamp_jitter);
    visit(self.readout_direction);
    visit(self.readout_nonlinear);
    visit(self.gyro_scale);
    visit(self.gyro_misalignment);
    visit(self.gyro_lowpass);
    visit(self.gyro_axis_delay);
    visit(self.gyro_saturation);
    visit(self.bias_drift);
    visit(self.gyro_g_sensitivity);
    visit(self.exposure_lowpass);
    visit(self.exposure_delay);
    visit(self.translation_acceleration);
    visit(self.attitude_rolling_shutter);
    visit(self.electronic_stabilisation);
  }
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_ALL_EFFECTS_H_
