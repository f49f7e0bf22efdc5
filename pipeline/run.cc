#include "pipeline/run.h"

#include <utility>
#include <vector>

#include "estimator/diagnosis/data_faults.h"
#include "estimator/diagnosis/model_check.h"
#include "estimator/reference/calibrate_with_ekf.h"
#include "frontend/camera_rotations.h"
#include "frontend/lens_from_matches.h"
#include "frontend/track_jumps.h"
#include "pipeline/track_noise.h"

namespace camgyro {

Result<TrackingSummary> EnsureImageMotion(const Progress& progress, Recording* recording) {
  if (recording->HasOnlyAttitudes()) return TrackingSummary{};
  Result<TrackingSummary> summary = TrackingSummary{};
  const bool tracked_elsewhere = !recording->tracks.empty();
  if (tracked_elsewhere) LeaveOutUntrackedFrames(recording);
  if (recording->tracks.empty() && recording->matches.empty()) {
    TrackingProgress tracking;
    if (progress) tracking = [&](double done) { progress("tracking", done); };
    summary = TrackRecording({}, nullptr, tracking, recording);
    if (!summary) return summary;
  } else if (Status enough = CheckImageMotion(*recording); !enough) {
    return tl::unexpected(enough.error());
  }
  DropRepeatedPictures(recording);
  if (tracked_elsewhere) summary->outlier_ratio = RemoveTrackJumps(recording).wrong_ratio();
  TakeLensFromMatches(recording);
  if (tracked_elsewhere && recording->match_noise == MatchNoise::kBothImages &&
      TrackNoiseAddsUp(*recording)) {
    recording->match_noise = MatchNoise::kSecondImage;
    summary->noise_adds_up = true;
  }
  return summary;
}

CameraRotationsAt RotationsFrom(const Recording& recording, size_t max_pairs) {
  return [pairs = PairsForRotations(recording, max_pairs)](
             const Recording& now, const std::vector<RotationTrial>& trials) {
    return CameraRotationsOf(now, pairs, trials);
  };
}

namespace {

void AddNotesOfTracks(const TrackingSummary& tracking, CalibrationReport* report) {
  if (!tracking.noise_adds_up) return;
  report->notes.push_back(
      "the errors of the tracks add up from frame to frame, as those of a tracker that re-anchors "
      "at every frame: pairs of frames follow one another");
}

}  // namespace

Result<CalibrationRun> RunCalibration(const CalibrateOptions& options, OnlineEstimator estimator,
                                      DeviceClass device, const Progress& progress,
                                      Recording* recording) {
  const Result<TrackingSummary> tracking = EnsureImageMotion(progress, recording);
  if (!tracking) return tl::unexpected(tracking.error());
  const CameraRotationsAt rotations_at = RotationsFrom(*recording);
  Result<CalibrationReport> report =
      estimator == OnlineEstimator::kPaperEkf
          ? CalibrateWithEkf(*recording, rotations_at, options, {})
          : CalibrateRecording(*recording, rotations_at, options, progress);
  if (!report) return tl::unexpected(Refusal(*recording, report.error()));
  AddNotesOfTracks(*tracking, &*report);
  if (estimator == OnlineEstimator::kWindow) {
    if (const auto doubt = CheckModel(*recording, options, device, &*report)) {
      report->doubts.push_back(*doubt);
    }
  }
  if (recording->declared_stabilisation) {
    report->doubts.push_back("the picture was stabilised electronically, says the file (" +
                             *recording->declared_stabilisation + ")");
  }
  return CalibrationRun{*tracking, *std::move(report)};
}

Result<DiagnosisRun> RunDiagnosis(const DiagnoseOptions& options, DeviceClass device,
                                  const Progress& progress, Recording* recording) {
  const Result<TrackingSummary> tracking = EnsureImageMotion(progress, recording);
  if (!tracking) return tl::unexpected(tracking.error());
  DiagnosisRun run{*tracking, Diagnose(RotationsFrom(*recording), options, recording, progress)};
  // What the loop says of the model is tested on unseen frames: it needs no doubt beside.
  for (auto* report : {&run.diagnosis.before, &run.diagnosis.after}) {
    if (!*report) continue;
    AddNotesOfTracks(*tracking, &**report);
    CheckModel(*recording, options.calibrate, device, &**report);
  }
  return run;
}

Error Refusal(const Recording& recording, Error error) {
  if (error.kind == ErrorKind::kCannotEstimate && recording.declared_stabilisation) {
    error.message = "the picture was stabilised electronically, says the file (" +
                    *recording.declared_stabilisation + "), and indeed: " + error.message;
  }
  return error;
}

}  // namespace camgyro
