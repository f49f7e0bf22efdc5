#include "estimator/diagnosis/model_check.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "core/format.h"
#include "core/linear_algebra.h"
#include "estimator/diagnosis/candidates.h"
#include "estimator/diagnosis/gain_rule.h"
#include "estimator/diagnosis/pair_scores.h"
#include "estimator/diagnosis/score_test.h"
#include "estimator/diagnosis/shares.h"
#include "estimator/diagnosis/thresholds.h"
#include "estimator/diagnosis/unseen_parallax.h"
#include "estimator/halves.h"
#include "estimator/starting_point.h"
#include "estimator/window/estimation_input.h"

namespace camgyro {
namespace {

// Columns of the scores that belong to an effect which devices of a class usually show.
struct UsualColumns {
  std::string effect;
  std::vector<int> columns;
  double sigma = 0.0;
};

struct Tested {
  std::vector<Candidate> candidates;  // with their columns
  std::vector<UsualColumns> usual;
  Scores scores;
  Eigen::VectorXd prior;  // information of all columns, candidates with their weak priors
  double unseen_parallax_rad_s = 0.0;
};

// There are stretches enough to see how the scores scatter. Without, noise is all that is known of
// what they say.
bool Scatters(const Tested& t) { return t.scores.blocks.size() >= kLeastBlocks; }

// The effects of a class that this recording could show and the model has not.
std::vector<UsualColumns> UsualOf(const std::vector<Candidate>& candidates,
                                  const Recording& recording, const Calibration& model,
                                  DeviceClass device) {
  std::vector<UsualColumns> usual;
  for (const UsualEffect& u : UsualEffects()) {
    if (!(u.Sigma(device) > 0.0)) continue;
    if (IsDeclared(u, recording.camera.distortion_model)) continue;
    if (model.effects && model.effects->Has(u.effect)) continue;
    for (const Candidate& candidate : candidates) {
      if (candidate.entry->name != u.effect || candidate.shape != u.shape) continue;
      usual.push_back({u.effect, candidate.columns(), u.Sigma(device)});
    }
  }
  return usual;
}

Tested Score(const Recording& recording, const CalibrateOptions& options, DeviceClass device,
             const CalibrationReport& report) {
  Tested t;
  const Calibration& model = report.calibration;
  EffectSetup setup = MakeEffectSetup(recording, model);
  TellOfStabiliser(report.start, &setup);
  t.candidates = MissingEffects(model, setup);
  auto set = std::make_shared<EffectSet>();
  const int first = kStateSize + static_cast<int>(model.effect_values.size());
  std::vector<Candidate> with_columns;
  for (Candidate& candidate : t.candidates) {
    if (candidate.effect->size() == 0) continue;
    candidate.first = first + set->size();
    set->Add(candidate.entry, candidate.shape, candidate.effect);
    with_columns.push_back(candidate);
  }
  t.candidates = std::move(with_columns);
  t.usual = UsualOf(t.candidates, recording, model, device);

  EstimationInput input = OutlineOf(recording, SelectPairsToTest(recording));
  TakeNoiseFactors(report.noise_factors, &input.pairs);
  const Shares shares =
      MakeShares(recording, input, {kMostFitPairs, kMostFitPairs, 0, /*with_report=*/false});
  const PairGraphOptions graph = GraphOptionsFor(recording, report.start, options.window.graph);
  const auto scores_of = [&](const std::vector<PairBlock>& blocks) {
    return ComputeScores(input, blocks, model, set, report.quality.noise_px, graph);
  };
  t.scores = MergeShares(scores_of(shares.fit), scores_of(shares.choice));
  if (!Scatters(t)) {  // one stretch, of all pairs
    AddMatches(recording, &input.pairs);
    t.scores = scores_of({input.pairs});
  }
  t.prior = PriorInformation(report.prior, model.effects.get(), *set);
  t.unseen_parallax_rad_s = UnseenParallax(Scatters(t) ? Joined(shares.fit) : input.pairs, model,
                                           report.quality.noise_px, graph);
  return t;
}

// What the effects of the class may be, given the residuals: columns of the scores, in units of
// their usual sizes, and how far they pull the state.
struct Usual {
  std::vector<int> columns;
  Eigen::VectorXd prior, sigma;  // information of all columns; usual sizes of `columns`
  Eigen::VectorXd c_hat;         // the effects, given the residuals
  Eigen::MatrixXd C;             // their mean square
  Eigen::MatrixXd X = Eigen::MatrixXd(kStateSize, 0);  // state x columns
};

Eigen::MatrixXd ShiftOfState(const Scores& scores, const Usual& u) {
  return ProjectModelOut(scores, u.columns, u.prior).shift.topRows<kStateSize>() *
         u.sigma.asDiagonal();
}

Usual UsualGiven(const Tested& t, double inflation) {
  Usual u;
  u.prior = t.prior;
  for (const UsualColumns& effect : t.usual) {
    for (const int column : effect.columns) {
      u.columns.push_back(column);
      u.prior[column] = 1.0 / (effect.sigma * effect.sigma);
    }
  }
  if (u.columns.empty()) return u;
  const Projection p = ProjectModelOut(t.scores, u.columns, u.prior);
  u.sigma.resize(p.score.size());
  for (Eigen::Index i = 0; i < u.sigma.size(); ++i) {
    u.sigma[i] = 1.0 / std::sqrt(u.prior[u.columns[static_cast<size_t>(i)]]);
  }
  Eigen::MatrixXd information =
      u.sigma.asDiagonal() * p.information * u.sigma.asDiagonal() / inflation;
  information.diagonal().array() += 1.0;
  const SymmetricSolver solver(information);
  u.c_hat = -solver.Solve(u.sigma.cwiseProduct(p.score) / inflation);
  u.C = solver.Inverse() + u.c_hat * u.c_hat.transpose();
  u.X = p.shift.topRows<kStateSize>() * u.sigma.asDiagonal();
  return u;
}

// Where the halves of a recording disagree, the covariance was multiplied. What usual effects make
// of the disagreement is in the total anyway, and is taken out of the noise. Not where the motion
// left something undetermined: a fit that has run away is not near the point of these derivatives.
void ExplainHalves(const Tested& t, const Usual& u, CalibrationReport* report) {
  Calibration& c = report->calibration;
  const double chi2 = report->halves_chi2;
  if (!(chi2 > kHalvesLimit)) return;
  if (std::find(c.determined.begin(), c.determined.end(), false) != c.determined.end()) return;
  Scores first, second;
  first.num_model = second.num_model = t.scores.num_model;
  const auto middle = t.scores.blocks.begin() + static_cast<long>(t.scores.blocks.size() / 2);
  first.blocks.assign(t.scores.blocks.begin(), middle);
  second.blocks.assign(middle, t.scores.blocks.end());
  const Eigen::MatrixXd apart = ShiftOfState(first, u) - ShiftOfState(second, u);
  // Each half has twice the whole's covariance, and their difference four times.
  const StateVector scale = c.sigma().cwiseInverse() * std::sqrt(chi2 / 4.0);
  const StateCovariance noise =
      scale.asDiagonal() * (4.0 / chi2) * c.covariance * scale.asDiagonal();
  const StateCovariance by_effects =
      scale.asDiagonal() * apart * u.C * apart.transpose() * scale.asDiagonal();
  const double expected = 1.0 + SymmetricSolver(noise).Solve(by_effects).trace() / kStateSize;
  const double left = std::max(1.0, chi2 / expected);
  c.covariance *= left / chi2;
  c.effect_covariance *= left / chi2;
  auto& doubts = report->doubts;
  doubts.erase(std::remove_if(doubts.begin(), doubts.end(),
                              [](const std::string& d) { return d.rfind(kHalvesDoubt, 0) == 0; }),
               doubts.end());
  const std::string found = Format(
      "%s (chi2 per parameter %.0f instead of 1, where effects of a "
      "usual device make %.0f",
      kHalvesDoubt, chi2, expected);
  if (std::sqrt(left) > kLeastFactorSaid) {
    doubts.push_back(found + Format("); all sigmas are multiplied by %.1f", std::sqrt(left)));
  } else {
    report->notes.push_back(found + "): see the error in all");
  }
}

// Parallax may hide more than the noise of the gyro's bias: a note says so.
bool HidesTurns(const Tested& t, const Calibration& c) {
  return t.unseen_parallax_rad_s > kUnseenSaid * c.sigma().segment<3>(kStateBias).maxCoeff();
}

// From the calibration to the fit of these data alone, as far as that is more than their noise
// makes: the positive part of James and Stein's estimator of the mean of a Gaussian vector, whose
// inverse covariance is the information of the data.
StateVector StepToOwnFit(const Tested& t, double inflation) {
  const Eigen::VectorXd step = StepOf(t.scores, {}, t.prior);
  double chi2 = 0.0;
  for (const BlockScore& block : t.scores.blocks) chi2 -= block.g.dot(step) / inflation;
  const double noise = static_cast<double>(t.scores.num_model);
  return std::max(0.0, 1.0 - noise / std::max(noise, chi2)) * step.head<kStateSize>();
}

// own_fit: from the calibration to where a fit of these data is.
void AddTotal(const Tested& t, const Usual& u, const StateVector& own_fit,
              CalibrationReport* report) {
  Calibration& c = report->calibration;
  const StateVector by_effects = u.X * u.c_hat;
  const StateVector off = by_effects - own_fit;
  c.total_covariance = StateCovariance(c.covariance + u.X * u.C * u.X.transpose() +
                                       off * off.transpose() - by_effects * by_effects.transpose());
  Eigen::Index at = 0;
  for (const UsualColumns& effect : t.usual) {
    const auto n = static_cast<Eigen::Index>(effect.columns.size());
    // What would go if the effect were known: effects that the data confuse with it do not remain
    // as they were.
    const Eigen::MatrixXd XC = u.X * u.C.middleCols(at, n);
    const StateVector variance =
        (XC * SymmetricSolver(u.C.block(at, at, n, n)).Solve(XC.transpose())).diagonal();
    report->systematic.push_back({effect.effect, variance.cwiseMax(0.0).cwiseSqrt()});
    at += n;
  }
  const Eigen::Matrix<double, 3, 2> across =
      t.unseen_parallax_rad_s * c.q_gyro_cam.toRotationMatrix().leftCols<2>();
  StateCovariance of_bias = StateCovariance::Zero();
  of_bias.block<3, 3>(kStateBias, kStateBias) = across * across.transpose();
  *c.total_covariance += of_bias;
  report->systematic.push_back({kUnseenParallax, of_bias.diagonal().cwiseSqrt()});
  if (HidesTurns(t, c)) {
    report->notes.push_back(Format(
        "what the pictures show is so far, or so equally far, that a step sideways looks like "
        "a turn: the gyro's bias may be off by %.2g deg/s",
        t.unseen_parallax_rad_s * 180.0 / M_PI));
  }
}

// What was fitted with the usual size of a class as its prior (EffectSet::Item::usual_sigma) and is
// larger beyond doubt: it may stand for something that the model lacks.
void DoubtUnusualSizes(CalibrationReport* report) {
  const Calibration& c = report->calibration;
  if (c.effects == nullptr) return;
  std::string unusual;
  for (const EffectSet::Item& item : c.effects->items()) {
    if (!(item.usual_sigma > 0.0)) continue;
    const double dof = item.effect->size();
    const double chi2 = c.effect_values.segment(item.first, item.effect->size()).squaredNorm() /
                        (item.usual_sigma * item.usual_sigma);
    if (ChiSquareTail(chi2, dof) * static_cast<double>(c.effects->items().size()) > kNoDoubt) {
      continue;
    }
    unusual += Format("%s %s (%.1f times)", unusual.empty() ? "" : ",", item.entry->name.c_str(),
                      std::sqrt(chi2 / dof));
  }
  if (unusual.empty()) return;
  report->doubts.push_back(
      "larger than usual for the class of the device:" + unusual +
      "; it may stand for something that the model lacks, and pull other parameters with it");
}

// Do the stretches bear a candidate out, every second one by the others' step?
bool StretchesBearOut(const Tested& t, const Candidate& candidate, const ScoreTest& test) {
  Scores even, odd;
  even.num_model = odd.num_model = t.scores.num_model;
  for (size_t i = 0; i < t.scores.blocks.size(); ++i) {
    (i % 2 == 0 ? even : odd).blocks.push_back(t.scores.blocks[i]);
  }
  CandidateResult result;
  result.statistic = test.statistic;
  result.p_value = test.p_value;
  result.inflation = test.inflation;
  std::vector<double> gain = GainAcross(even, odd, candidate.columns(), t.prior);
  const std::vector<double> without = GainAcross(even, odd, {}, t.prior);
  for (size_t i = 0; i < gain.size(); ++i) gain[i] -= without[i];
  result.gain = SumOf(gain);
  return GainBearsOut(result, static_cast<double>(t.candidates.size()));
}

// The most significant candidate, if it is so beyond doubt. What parallax hides in far things pulls
// all stretches together, so that p alone doubts what is right (handheld, 30 to 300 m): there the
// stretches have to bear the candidate out as well. (Not elsewhere: a delay that jitters from
// second to second, as of tablet-attitude, is one that other stretches do not know.)
std::optional<std::string> Suspect(const Tested& t, const Calibration& model,
                                   const std::vector<ScoreTest>& alone, const Scatter& usual) {
  const bool hides_turns = HidesTurns(t, model);
  const Candidate* best = nullptr;
  double best_p = kNoDoubt / static_cast<double>(t.candidates.size());
  for (size_t i = 0; i < t.candidates.size(); ++i) {
    if (alone[i].dof == 0) continue;
    const ScoreTest test = TestColumns(t.scores, t.candidates[i].columns(), t.prior, usual);
    if (test.dof > 0 && test.p_value < best_p &&
        (!hides_turns || StretchesBearOut(t, t.candidates[i], test))) {
      best_p = test.p_value;
      best = &t.candidates[i];
    }
  }
  if (best == nullptr) return std::nullopt;
  best_p *= static_cast<double>(t.candidates.size());
  // An effect that is fitted already can only be of another shape.
  const bool is_fitted = model.effects && model.effects->Has(best->entry->name);
  const std::string like = is_fitted ? Format("%s of another shape than is fitted (%s)",
                                              best->entry->name.c_str(), best->shape.c_str())
                                     : best->entry->name + ": " + best->entry->explanation;
  const bool has_usual =
      model.effects && std::any_of(model.effects->items().begin(), model.effects->items().end(),
                                   [](const auto& item) { return item.usual_sigma > 0.0; });
  return Format(
      "the pictures show something that the model lacks (p = %.0e), first of all like %s; "
      "camgyro diagnose finds out what it is%s",
      std::max(best_p, 1e-99), like.c_str(),
      has_usual ? ", or name it in --effects"
                : "; --effects=usual fits all that such devices usually have");
}

}  // namespace

std::optional<std::string> CheckModel(const Recording& recording, const CalibrateOptions& options,
                                      DeviceClass device, CalibrationReport* report,
                                      FittedTo fitted_to) {
  if (!report->residual->facts().with_effects) return std::nullopt;
  if (!(report->quality.noise_px > 0.0)) return std::nullopt;
  const Tested t = Score(recording, options, device, *report);
  if (t.scores.blocks.empty()) return std::nullopt;
  std::vector<ScoreTest> alone;
  for (const Candidate& candidate : t.candidates) {
    alone.push_back(TestColumns(t.scores, candidate.columns(), t.prior));
  }
  const Scatter usual = UsualScatter(alone);
  report->device_class = DeviceClassName(device);
  const double inflation = std::max(1.0, usual.variance);
  const Usual effects = UsualGiven(t, inflation);
  if (Scatters(t) && !effects.columns.empty()) ExplainHalves(t, effects, report);
  const bool fitted = fitted_to == FittedTo::kTheseData;
  AddTotal(t, effects, fitted ? StateVector(StateVector::Zero()) : StepToOwnFit(t, inflation),
           report);
  DoubtUnusualSizes(report);
  return Suspect(t, report->calibration, alone, usual);
}

}  // namespace camgyro
