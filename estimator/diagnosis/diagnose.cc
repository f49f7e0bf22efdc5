#include "estimator/diagnosis/diagnose.h"

#include <Eigen/Core>
#include <algorithm>
#include <memory>
#include <utility>

#include "core/format.h"
#include "core/free_memory.h"
#include "core/usual_focal.h"
#include "estimator/astray.h"
#include "estimator/diagnosis/gain_rule.h"
#include "estimator/diagnosis/refused_start.h"
#include "estimator/diagnosis/step_time.h"
#include "estimator/diagnosis/thresholds.h"
#include "estimator/times_between.h"

namespace camgyro {
namespace {

// Rotations of the camera, whatever the recording has.
std::vector<CameraRotation> CameraRotationsIn(const Recording& recording,
                                              const CameraRotationsAt& rotations_at) {
  if (recording.HasOnlyAttitudes()) return NeighbourRotations(recording);
  return rotations_at(recording, {{FocalToBeginWith(recording.camera), {}}}).front();
}

// Part of a progress: a stage's share of the whole.
Progress Part(const Progress& progress, double from, double to) {
  return [=](const std::string& stage, double done) {
    if (progress) progress(stage, from + (to - from) * done);
  };
}

void AddUnique(const std::string& name, std::vector<std::string>* names) {
  if (std::find(names->begin(), names->end(), name) == names->end()) names->push_back(name);
}

// Effects that are in the model from the start on, as findings, where the fit sees them, too.
void AddFoundAtStart(const CalibrationReport& report, Diagnosis* diagnosis) {
  const Calibration& c = report.calibration;
  if (c.effects == nullptr) return;
  for (const EffectSet::Item& item : c.effects->items()) {
    if (!item.entry->found_at_start || item.usual_sigma > 0.0 || !IsSeen(item, c)) continue;
    diagnosis->faults.push_back(
        {item.entry->name, "found at the start: " + item.entry->explanation, item.entry->advice});
    AddUnique(item.entry->name, &diagnosis->effects);
  }
}

// As calibrate has it. If that is refused: is something of it other than its format says, which is
// repaired, or the picture without the fast rotation?
Result<CalibrationReport> CalibrateOrSayWhy(const CameraRotationsAt& rotations_at,
                                            const CalibrateOptions& options,
                                            const Progress& progress, Recording* recording,
                                            std::vector<DataFault>* faults) {
  // The loop finds what leads fits astray by itself, and shows what it gains in unseen frames.
  CalibrateOptions plain = options;
  plain.try_what_leads_astray = plain.take_stabiliser = false;
  plain.times_between = false;  // AddTimesBetween
  Result<CalibrationReport> report =
      CalibrateRecording(*recording, rotations_at, plain, Part(progress, 0.0, 1.0));
  if (report || report.error().kind != ErrorKind::kCannotEstimate) return report;
  if (const auto repaired = RepairRecording(rotations_at, options.start, recording)) {
    faults->push_back(*repaired);
    return CalibrateRecording(*recording, rotations_at, plain, progress);
  }
  const std::vector<CameraRotation> rotations = CameraRotationsIn(*recording, rotations_at);
  std::optional<std::string> found = FindElectronicStabilisation(*recording, rotations);
  if (recording->declared_stabilisation) {
    found = "the file says so (" + *recording->declared_stabilisation + ")" +
            (found ? ", and " + *found : "");
  }
  if (found) {
    const EffectEntry* entry = FindEffect("electronic_stabilisation");
    faults->push_back({entry->name, *found, entry->advice});
  }
  return report;
}

// Rows from bottom to top need no effect, but are named.
void AddReversedReadout(Diagnosis* diagnosis) {
  const Calibration& c = diagnosis->before->calibration;
  if (!c.determined[kStateReadout] || c.readout_s >= -kReversedSigmas * c.sigma()[kStateReadout]) {
    return;
  }
  const EffectEntry* entry = FindEffect("readout_direction");
  diagnosis->faults.push_back({entry->name,
                               "the readout time is negative: rows are read from bottom to top",
                               entry->advice});
  AddUnique(entry->name, &diagnosis->effects);
}

// All frames with the effects that were found.
void CalibrateWith(const Calibration& found, const LoopInput& input,
                   const CameraRotationsAt& rotations_at, const DiagnoseOptions& options,
                   const Progress& progress, Diagnosis* diagnosis) {
  const Recording& recording = *input.recording;
  CalibrateOptions with = options.calibrate;
  with.given_start = diagnosis->before->start;
  with.from = found;
  // Once all frames may be seen, those of the report, too.
  const EstimationInput all = OutlineOf(recording, SelectPairs(recording));
  PlaceDelaySteps(recording, all, all.pairs, kStepMarginBlocks * diagnosis->block_s, input.noise,
                  input.graph, &*with.from);
  with.online = false;
  Result<CalibrationReport> after =
      CalibrateRecording(recording, rotations_at, with, Part(progress, 0.0, 1.0));
  if (after) {
    diagnosis->after = *std::move(after);
  } else {
    diagnosis->before->doubts.push_back(
        "this calibration is without the effects: with them, the fit of all frames failed: " +
        after.error().message);
  }
}

// Without the effects of rounds that are withdrawn.
Calibration WithoutWithdrawn(const Calibration& found, const std::vector<DiagnosisRound>& rounds) {
  Calibration without = found;
  auto set = std::make_shared<EffectSet>();
  std::vector<double> values;
  for (const EffectSet::Item& item : found.effects->items()) {
    if (std::any_of(rounds.begin(), rounds.end(), [&](const DiagnosisRound& round) {
          return !round.withdrawn.empty() && round.added == item.entry->name &&
                 round.shape == item.shape;
        })) {
      continue;
    }
    set->Add(item);
    for (int k = 0; k < item.effect->size(); ++k) {
      values.push_back(found.effect_values[item.first + k]);
    }
  }
  without.effect_values =
      Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  without.effect_covariance.resize(0, 0);
  without.effects = set->empty() ? nullptr : std::move(set);
  return without;
}

void NameAllButWithdrawn(Diagnosis* diagnosis) {
  std::vector<std::string>& names = diagnosis->effects;
  for (const DiagnosisRound& round : diagnosis->rounds) {
    if (round.withdrawn.empty()) continue;
    names.erase(std::remove(names.begin(), names.end(), round.added), names.end());
  }
}

bool AddsAnEffect(const Diagnosis& diagnosis) {
  return std::any_of(
      diagnosis.rounds.begin(), diagnosis.rounds.end(),
      [](const DiagnosisRound& round) { return !round.added.empty() && round.withdrawn.empty(); });
}

// The result has them all the same: what chose them has four times the frames.
void DoubtWhatIsNotConfirmed(Diagnosis* diagnosis) {
  if (!diagnosis->after) return;
  for (const DiagnosisRound& round : diagnosis->rounds) {
    if (!IsUnconfirmed(round) || !round.withdrawn.empty()) continue;
    diagnosis->after->doubts.push_back(
        round.added +
        Format(" is not confirmed by frames that neither fit nor choice has seen (chi2 falls by "
               "%.0f ± %.0f, %.0f expected): it may stand for something else, and pull other "
               "parameters with it",
               round.report_gain.sum, round.report_gain.sigma, round.expected_gain));
  }
}

// Of the plain fit, where it is the result: the times of frames in between take as long as a fit,
// and one with effects finds them anew.
void AddTimesBetween(const Recording& recording, const DiagnoseOptions& options,
                     Diagnosis* diagnosis) {
  if (!diagnosis->before || diagnosis->after) return;
  CalibrationReport& report = *diagnosis->before;
  TakeTimesOfAllFrames(
      recording, GraphOptionsFor(recording, report.start, options.calibrate.window.graph), &report);
}

// All but the times of frames in between.
Diagnosis DiagnoseFits(const CameraRotationsAt& rotations_at, const DiagnoseOptions& options,
                       const Progress& progress, Recording* to_repair) {
  const Recording& recording = *to_repair;
  Diagnosis diagnosis;
  diagnosis.faults = FindDataFaults(recording);
  Result<CalibrationReport> before =
      CalibrateOrSayWhy(rotations_at, options.calibrate, progress, to_repair, &diagnosis.faults);
  for (const DataFault& fault : diagnosis.faults) {
    if (FindEffect(fault.name) != nullptr) AddUnique(fault.name, &diagnosis.effects);
  }
  if (!before) {
    diagnosis.refusal = before.error();
    return diagnosis;
  }
  diagnosis.before = *std::move(before);
  diagnosis.times = diagnosis.before->times;
  GiveBackFreeMemory();  // of the calibration, before the loop takes as much again

  const CalibrationReport& report = *diagnosis.before;
  LoopInput input;
  input.recording = &recording;
  input.found = report.start;
  input.prior = MakePrior(recording, report.start);
  input.fit = report.calibration;
  input.start = input.prior.mean;
  input.start.bias_gyro_rad_s = report.start.bias_gyro_rad_s;
  if (const Status added = AddStartEffects(recording, report.start, options.calibrate.effects,
                                           *report.residual, &input.start);
      !added) {
    diagnosis.not_tested = added.error().message;
    return diagnosis;
  }
  AddFoundAtStart(report, &diagnosis);
  input.graph = GraphOptionsFor(recording, report.start, options.calibrate.window.graph);
  input.noise = report.quality.noise_px;
  if (!(input.noise > 0.0)) {
    input.noise = recording.HasOnlyAttitudes() ? kFirstNoiseRad : kFirstNoisePx;
  }
  input.noise_factors = report.noise_factors;
  StageClock clock(&diagnosis.times);
  const Result<Calibration> found = FindEffects(input, options, progress, &diagnosis);
  clock.Finish("diagnosis");
  if (!found) {
    diagnosis.not_tested = found.error().message;
    return diagnosis;
  }
  AddReversedReadout(&diagnosis);
  if (found->effects && found->effects != report.calibration.effects) {
    CalibrateWith(*found, input, rotations_at, options, progress, &diagnosis);
    while (diagnosis.after && WithdrawByAllFrames(diagnosis.after->calibration,
                                                  options.significance, &diagnosis.rounds)) {
      NameAllButWithdrawn(&diagnosis);
      diagnosis.after.reset();
      if (AddsAnEffect(diagnosis)) {
        CalibrateWith(WithoutWithdrawn(*found, diagnosis.rounds), input, rotations_at, options,
                      progress, &diagnosis);
      }
    }
    DoubtWhatIsNotConfirmed(&diagnosis);
    clock.Finish("refinement with effects");
  }
  return diagnosis;
}

}  // namespace

Diagnosis Diagnose(const CameraRotationsAt& rotations_at, const DiagnoseOptions& options,
                   Recording* recording, const Progress& progress) {
  Diagnosis diagnosis = DiagnoseFits(rotations_at, options, progress, recording);
  AddTimesBetween(*recording, options, &diagnosis);
  return diagnosis;
}

}  // namespace camgyro
