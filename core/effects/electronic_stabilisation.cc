// The picture was warped against the gyro before it was stored.
#include "core/effects/entries.h"
#include "core/effects/shapes.h"

namespace camgyro {

// No parameters: estimator/diagnosis/ recognises it and refuses.
EffectEntry ElectronicStabilisationEntry() {
  return WithoutShape({"electronic_stabilisation", ModelPart::kPicture,
                       "the picture was stabilised before it was stored: fast rotation is missing "
                       "from it",
                       "switch the electronic stabilisation off and record again; such a recording "
                       "cannot be calibrated"});
}

}  // namespace camgyro
