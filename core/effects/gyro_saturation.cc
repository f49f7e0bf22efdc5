// Samples at the gyro's full scale.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {

// No parameters: estimator/diagnosis/ finds the samples at the rail and leaves out the pairs of
// frames that need them.
EffectEntry GyroSaturationEntry() {
  return WithoutShape({"gyro_saturation", ModelPart::kRate,
                       "the rotation was faster than the gyro's full scale: samples stay at the "
                       "rail",
                       "set a larger full scale, or turn more slowly; pairs of frames that need "
                       "such samples are left out"});
}

}  // namespace camgyro
