// The shift of a stabilised lens that a device logged, from tables.
#ifndef CAMGYRO_FRONTEND_READERS_LENS_SHIFT_H_
#define CAMGYRO_FRONTEND_READERS_LENS_SHIFT_H_

#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Puts the samples of `file` into the recording, whose frames stand, in order and once: loggers
// write those of each frame, some of them twice. A note says how far the lens goes. A log that says
// nothing of more than a twentieth of the frames, or has a lens that does not move, is left out,
// with a note. Errors: fewer than two samples, stamps that cannot be nanoseconds, shifts that are
// not finite or larger than the picture.
Status SetLensShift(const std::string& file, std::vector<LensSample> samples, Recording* recording);

// cam0/lens_shift.csv: #timestamp [ns],shift_x [px],shift_y [px]
Status ReadLensShift(const std::string& file, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_LENS_SHIFT_H_
