// The lens of a calibration that moves while the recording lasts.
#ifndef CAMGYRO_PIPELINE_MOVING_LENS_H_
#define CAMGYRO_PIPELINE_MOVING_LENS_H_

#include <string>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Puts into a calibration, read from a calibration.yaml and without effects, those of the file that
// move the lens over time: a stabilised lens, a focal length that drifts. They are made for
// `recording`, which has the stamps that the file was calibrated with. Those that are a constant
// part of the lens are in the file's `camera` already.
//
// Errors: as ReadEffects; kBadInput for an effect that this recording cannot have, as a lens whose
// log it lacks, or whose values are not those of its shape.
Status AddMovingLens(const std::string& file, const Recording& recording, Calibration* calibration);

// For programs that hold the lens still: kBadInput if the file lists a stabilised lens, or a fit
// has found one.
Status RefuseStabilisedLens(const std::string& file);
Status RefuseStabilisedLens(const Calibration& fit);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_MOVING_LENS_H_
