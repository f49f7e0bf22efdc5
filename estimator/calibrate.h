// The main job: start, online pass, refinement, and an honest account of what came out.
#ifndef CAMGYRO_ESTIMATOR_CALIBRATE_H_
#define CAMGYRO_ESTIMATOR_CALIBRATE_H_

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/stage_clock.h"
#include "estimator/start/find_start.h"
#include "estimator/start/focal_scan.h"
#include "estimator/starting_point.h"
#include "estimator/window/refinement.h"
#include "estimator/window/sliding_window.h"

namespace camgyro {

// Called now and then with the stage ("start", "window", "refinement") and its done share 0..1.
using Progress = std::function<void(const std::string& stage, double done)>;

struct CalibrateOptions {
  bool refine = true;   // false: the online estimate is the result
  std::string effects;  // of the catalogue, to fit as well, not with transfers; see MakeEffects
  StartOptions start;
  // What was found before (diagnosis): a start that is not searched again, and values with effects
  // to begin from.
  std::optional<StartResult> given_start;
  std::optional<Calibration> from;
  bool online = true;  // false: no sliding window, the refinement alone
  // Where the estimate goes astray, online or in the end, another calibration is made with an
  // effect of the catalogue that leads fits so far (EffectEntry::leads_astray: the lens's
  // distortion, its stabiliser), and taken if the data bear it out.
  bool try_what_leads_astray = true;
  // A lens that the start finds to follow the camera's turns is part of the model.
  bool take_stabiliser = true;
  // Frames that no pair of the refinement has get times of their own, too, where frames have such
  // (TimesOfAllFrames).
  bool times_between = true;
  FocalScanOptions focal_scan;
  SlidingWindowOptions window;  // its graph is that of the refinement, too
  RefinementOptions refinement;
  // The refinement takes no more pairs: of longer recordings, the most informative ones
  // (InformativePairs). Five minutes of neighbours at 30 frames/s.
  size_t most_refined_pairs = 9000;
  // Nor so many that they and the recording take more memory than that, about (RefinementBytes,
  // BytesOf): a gibibyte less what a program holds without a recording, and for what the sum does
  // not count (the online estimates, 75 MB in an hour, and the fits of the halves). But always what
  // is told by this many.
  double most_bytes = 750e6;
  double least_refined_bytes = 100e6;
};

// What an effect that nobody has declared has in the error of each parameter: if it were known, the
// squared total sigma would be smaller by the square of this.
struct EffectShare {
  std::string effect;
  StateVector sigma = StateVector::Zero();
};

struct CalibrationReport {
  Calibration calibration;  // the result
  Prior prior;
  // The online pass alone; absent for recordings of attitudes.
  std::optional<Calibration> online;
  std::vector<WindowUpdate> trace;  // one per solved window
  int pairs_used_online = 0;

  const PairResidual* residual = &ByPlane();  // that was chosen for matches
  StartResult start;
  FitQuality quality;
  // Each half of the recording under the fit of the other half. The result itself uses all frames.
  // Absent for short recordings and for attitudes.
  std::optional<UnseenFit> unseen;
  // Disagreement of the fits of the two halves, chi-square per parameter; 0: not tested (short).
  // Beyond its 99.9 % quantile the covariance is multiplied by it, and a doubt says so.
  double halves_chi2 = 0.0;
  double noise_over_smooth = 0.0;  // of the fit (estimator/astray.h); 0: not known
  int skipped_pairs = 0;
  int moving_tracks = 0;  // left out of the refinement (estimator/moving_tracks.h)
  // With frame_stamp_jitter: the frames' own times, by nanoseconds after the first gyro stamp.
  std::vector<FrameOffset> frame_times;
  std::map<int64_t, double> noise_factors;  // Refined::noise_factors
  bool converged = false;
  // Where calibration.total_covariance comes from (estimator/diagnosis/model_check.h).
  std::string device_class;
  std::vector<EffectShare> systematic;

  std::vector<std::string> notes;   // what a user should know
  std::vector<std::string> doubts;  // reasons not to believe a number
  std::vector<StageTime> times;
};

// Calibrates a recording that has image motion (tracks, matches) or attitudes; pictures were
// tracked before. `rotations_at`: camera rotations between frames at a trial focal length, found
// from the pictures alone (frontend/two_view_rotation.h); not called for attitudes. Errors:
// kCannotEstimate with the reason where the data do not determine a calibration.
Result<CalibrationReport> CalibrateRecording(const Recording& recording,
                                             const CameraRotationsAt& rotations_at,
                                             const CalibrateOptions& options,
                                             const Progress& progress = nullptr);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_CALIBRATE_H_
