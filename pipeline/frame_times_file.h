// frame_times.csv, which stands beside the calibration.yaml of a fit with frame_stamp_jitter
// (FrameTimesCsv in result_files.h writes it).
#ifndef CAMGYRO_PIPELINE_FRAME_TIMES_FILE_H_
#define CAMGYRO_PIPELINE_FRAME_TIMES_FILE_H_

#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/window/frame_times.h"

namespace camgyro {

// Gives the recording's frames the repaired stamps of frame_times.csv in the folder of this
// calibration.yaml, if there is one, with a note that says so. Frames that it does not list keep
// their stamps, and stamps remain strictly increasing. A file of which no stamp is one of the
// recording's frames is another recording's, and changes nothing. Errors: kBadInput with file and
// line.
Status ApplyFrameTimes(const std::string& calibration_path, Recording* recording);

// The same with what a fit has found (CalibrationReport::frame_times). The recording has a gyro.
void ApplyFrameTimes(const std::vector<FrameOffset>& frame_times, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_FRAME_TIMES_FILE_H_
