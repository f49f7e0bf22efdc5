// What every command does with a recording first: read it, take the user's guesses, get image
// motion.
#ifndef CAMGYRO_TOOLS_RECORDING_INPUT_H_
#define CAMGYRO_TOOLS_RECORDING_INPUT_H_

#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/start/focal_scan.h"
#include "frontend/track_recording.h"
#include "tools/progress_bar.h"

namespace camgyro {

// Names of the flags that OpenRecording obeys: guesses that win over the recording's own.
std::vector<std::string> GuessFlags();

Result<Recording> OpenRecording(const std::string& path);

// Tracks the pictures if the recording has neither tracks nor matches nor attitudes. Errors also if
// there are too few features. The summary is empty where nothing had to be tracked.
Result<TrackingSummary> EnsureImageMotion(ProgressBar* progress, Recording* recording);

// Rotations between frames at a trial focal length; a copy of the pairs lives in the function.
CameraRotationsAtFocal RotationsFrom(const Recording& recording);

// An estimator's refusal, with the file's own words where it declares stabilisation.
tl::unexpected<Error> Refusal(const Recording& recording, Error error);

// One line about what the recording holds.
std::string DescribeRecording(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_RECORDING_INPUT_H_
