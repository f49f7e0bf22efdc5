// The closed loop: fit, find what is left in frames that the fit has not seen, name the effect that
// explains it, add it, and report the error before and after (docs/architecture.md).
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_DIAGNOSE_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_DIAGNOSE_H_

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/calibrate.h"
#include "estimator/diagnosis/data_faults.h"
#include "estimator/diagnosis/score_test.h"
#include "estimator/diagnosis/shares.h"
#include "estimator/diagnosis/structure.h"

namespace camgyro {

struct DiagnoseOptions {
  CalibrateOptions calibrate;
  int max_rounds = 6;
  double significance = 0.01;  // of a round, all candidates together
  int max_rivals = 3;          // that are refitted and compared in a round
};

// What one candidate has to say in a round.
struct CandidateResult {
  std::string name, shape;
  int parameters = 0;
  double statistic = 0.0;    // chi-square over its inflation
  double p_value = 1.0;      // of this candidate alone
  bool significant = false;  // by the score test, all candidates of the round together
  double inflation = 1.0;
  // Fall of chi2 in one share by one step in the other (mean of both ways); in the choice share by
  // the refit, if `refitted`.
  Gain gain;
  bool refitted = false;
  // Of a right effect with this statistic, which is of both shares: half of it, with the noise of a
  // gain, 2 sqrt(gain).
  Gain ExpectedGain() const;
  // Although its score is not significant or gains nothing: where the model is far off, it says
  // little.
  bool tried_anyway = false;
  std::string rejected;  // why not, empty if it could be chosen
  std::vector<EffectParameter> parameter_info;
  Eigen::VectorXd estimate, sigma;    // of the refit, else of the score test
  Eigen::VectorXd start;              // one step in the fit share: where a refit begins
  double start_delay_change_s = 0.0;  // and of t_d there (FindLargeStep)
};

// How frames that neither fit nor choice has seen fit, all with the same noise.
struct ReportShare {
  int pairs = 0, residuals = 0;
  double rms_px = 0.0;  // attitudes: rad
  double chi2 = 0.0;    // per residual
};

struct DiagnosisRound {
  std::vector<CandidateResult> candidates;         // best first
  std::string added, shape;                        // empty: nothing
  std::string withdrawn;                           // why not, after all; empty: it stays
  ReportShare before, after;                       // alike if nothing was added
  Gain report_gain;                                // fall of chi2 in the report share
  double expected_gain = 0.0;                      // there, if the fit with the effect is right
  StateVector shift_sigmas = StateVector::Zero();  // of each parameter, in its sigmas before
};

struct Diagnosis {
  std::optional<CalibrationReport> before;  // as calibrate has it; absent if it was refused
  std::optional<CalibrationReport> after;   // with the effects; absent if none was added
  // Why there is no calibration, with the kind of the refusal.
  std::optional<Error> refusal;
  std::vector<DataFault> faults;
  std::vector<DiagnosisRound> rounds;
  std::vector<std::string> effects;  // added, in this order; and faults of the catalogue
  std::vector<std::vector<std::string>> indistinguishable;
  std::vector<StructureMap> maps_before, maps_after;
  bool unexplained_structure = false;
  std::vector<std::string> where;  // the maps that show it, most significant first
  std::string not_tested;          // why nothing was tested, empty if it was
  int fit_pairs = 0, choice_pairs = 0, report_pairs = 0;
  double block_s = 0.0;
  bool report_shares_tracks = false;
  std::vector<StageTime>
      times;  // of the calibration before, the loop, and that of all frames after

  const CalibrationReport& result() const { return after ? *after : *before; }
};

// Never an error for data that are sound: a recording that cannot be calibrated has `refusal` set,
// and `effects` say why where that can be said. Where a gyro in another unit or with mirrored axes
// is all that is wrong, the recording is repaired, and the diagnosis says so (gyro_unit, ...).
Diagnosis Diagnose(const CameraRotationsAt& rotations_at, const DiagnoseOptions& options,
                   Recording* recording, const Progress& progress = nullptr);

// The loop alone, from a calibration as the plain model has it: fills rounds, effects, maps and
// indistinguishable of the result, and returns the fit share's calibration with the effects.
struct LoopInput {
  const Recording* recording = nullptr;
  Calibration fit;    // as the plain model has it
  Calibration start;  // where it all began
  StartResult found;  // and what was found there
  Prior prior;
  PairGraphOptions graph;
  double noise = 1.0;                       // first guess [px], attitudes [rad]
  std::map<int64_t, double> noise_factors;  // of the pairs that `fit` has used
};
Result<Calibration> FindEffects(const LoopInput& input, const DiagnoseOptions& options,
                                const Progress& progress, Diagnosis* diagnosis);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_DIAGNOSE_H_
