// The one entrance from a recording to its calibration: image motion, start, online pass,
// refinement and halves, or the closed loop around them. What the command line, Python and tables
// of our own call; libcamgyro, which has no recording yet, shares its parts.
#ifndef CAMGYRO_PIPELINE_RUN_H_
#define CAMGYRO_PIPELINE_RUN_H_

#include <cstddef>

#include "core/effects/device_class.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/calibrate.h"
#include "estimator/diagnosis/diagnose.h"
#include "estimator/start/focal_scan.h"
#include "frontend/track_recording.h"

namespace camgyro {

// Tracks the pictures if the recording has neither tracks nor matches; attitudes are taken where
// there is nothing else. Frames that repeat a picture are left out, and wrong points of tracks that
// somebody else has made (RemoveTrackJumps); where the errors of those add up (TrackNoiseAddsUp),
// the recording's match_noise says so, and a strong lens that nothing declares is put into its
// camera (CameraGuess::division_lambda). `progress` gets the stage "tracking"; it may be null.
// Errors: of the files; kCannotEstimate with too few features or no motion. Where nothing had to be
// tracked, its time is zero.
Result<TrackingSummary> EnsureImageMotion(const Progress& progress, Recording* recording);

// Rotations between frames in some trials, from at most `max_pairs` pairs of frames. The function
// holds a copy of them: the recording may go, or come with other gyro samples.
CameraRotationsAt RotationsFrom(const Recording& recording, size_t max_pairs = 400);

// Which estimator goes along with the frames: ours, or the filter of Jia & Evans as published,
// without refinement, for comparison.
enum class OnlineEstimator { kWindow, kPaperEkf };

struct CalibrationRun {
  TrackingSummary tracking;
  CalibrationReport report;
};
// Calibrates a recording; its pictures are tracked first, and their tracks stay in it. Errors as
// EnsureImageMotion and CalibrateRecording. Where the file declares electronic stabilisation, a
// refusal or a doubt says so. The result's total error is that of `device` (CheckModel), but for
// the filter of the paper.
Result<CalibrationRun> RunCalibration(const CalibrateOptions& options, OnlineEstimator estimator,
                                      DeviceClass device, const Progress& progress,
                                      Recording* recording);

struct DiagnosisRun {
  TrackingSummary tracking;
  Diagnosis diagnosis;
};
// The closed loop in the same way. Errors as EnsureImageMotion.
Result<DiagnosisRun> RunDiagnosis(const DiagnoseOptions& options, DeviceClass device,
                                  const Progress& progress, Recording* recording);

// An estimator's refusal, with the file's own words where it declares stabilisation.
Error Refusal(const Recording& recording, Error error);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_RUN_H_
