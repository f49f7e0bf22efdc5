// Feeds a recording to a calibrator in the order in which a phone's callbacks would come.
#ifndef CAMGYRO_EXAMPLES_FEED_H_
#define CAMGYRO_EXAMPLES_FEED_H_

#include <camgyro/calibrator.h>

#include <functional>

#include "core/recording.h"

// What the recording says of its camera, as the library's guess. False without a picture size.
bool GuessFrom(const camgyro::Recording& recording, camgyro::api::CameraGuess* guess);

// Before each frame everything inertial up to its stamp. `before_frame` is called with each frame's
// time after the first [s]; false ends the feeding. Returns false for pictures that cannot be read.
bool Feed(const camgyro::Recording& recording, camgyro::api::Calibrator* calibrator,
          const std::function<bool(double time_s)>& before_frame);

#endif  // CAMGYRO_EXAMPLES_FEED_H_
