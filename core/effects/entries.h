// Declarations of the catalogue's entries; one per file of this folder. Only catalogue.cc needs it.
#ifndef CAMGYRO_CORE_EFFECTS_ENTRIES_H_
#define CAMGYRO_CORE_EFFECTS_ENTRIES_H_

#include "core/effects/effect.h"

namespace camgyro {

EffectEntry RadialDistortionEntry();
EffectEntry TangentialDistortionEntry();
EffectEntry AspectRatioEntry();
EffectEntry FocalDriftEntry();
EffectEntry OpticalStabilisationEntry();
EffectEntry ClockSkewEntry();
EffectEntry DelayStepEntry();
EffectEntry DelayWanderEntry();
EffectEntry FrameStampJitterEntry();
EffectEntry ReadoutDirectionEntry();
EffectEntry ReadoutNonlinearEntry();
EffectEntry GyroScaleEntry();
EffectEntry GyroMisalignmentEntry();
EffectEntry GyroLowpassEntry();
EffectEntry GyroAxisDelayEntry();
EffectEntry GyroSaturationEntry();
EffectEntry BiasDriftEntry();
EffectEntry GyroGSensitivityEntry();
EffectEntry ExposureLowpassEntry();
EffectEntry ExposureDelayEntry();
EffectEntry TranslationAccelerationEntry();
EffectEntry AttitudeRollingShutterEntry();
EffectEntry ElectronicStabilisationEntry();

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_ENTRIES_H_
