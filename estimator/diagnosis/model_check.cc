#include "estimator/diagnosis/model_check.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "core/format.h"
#include "estimator/diagnosis/candidates.h"
#include "estimator/diagnosis/pair_scores.h"
#include "estimator/diagnosis/score_test.h"
#include "estimator/diagnosis/shares.h"
#include "estimator/diagnosis/thresholds.h"
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
};

bool IsDeclared(const Recording& recording, const EffectEntry& entry) {
  const bool distortion =
      entry.name == "radial_distortion" || entry.name == "tangential_distortion";
  return distortion && recording.camera.distortion_model != DistortionModel::kNone;
}

// The effects of a class that this recording could show and the model has not.
std::vector<UsualColumns> UsualOf(const std::vector<Candidate>& candidates,
                                  const Recording& recording, const Calibration& model,
                                  DeviceClass device) {
  std::vector<UsualColumns> usual;
  for (const UsualEffect& u : UsualEffects()) {
    if (!(u.Sigma(device) > 0.0)) continue;
    if (model.effects && model.effects->Has(u.effect)) continue;
    for (const Candidate& candidate : candidates) {
      if (candidate.entry->name != u.effect || candidate.shape != u.shape) continue;
      if (IsDeclared(recording, *candidate.entry)) continue;
      usual.push_back({u.effect, candidate.columns(), u.Sigma(device)});
    }
  }
  return usual;
}

Tested Score(const Recording& recording, const CalibrateOptions& options, DeviceClass device,
             const CalibrationReport& report) {
  Tested t;
  const Calibration& model = report.calibration;
  t.candidates = MissingEffects(model, MakeEffectSetup(recording, model));
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

  const EstimationInput input = MakeEstimationInput(recording, SelectPairs(recording));
  Shares shares = MakeShares(recording, input);
  if (!recording.HasOnlyAttitudes()) {
    Thin(kMostFitPairs, &shares.fit);
    Thin(kMostFitPairs, &shares.choice);
  }
  const PairGraphOptions graph = GraphOptionsFor(recording, report.start, options);
  const auto scores_of = [&](const std::vector<PairBlock>& blocks) {
    return ComputeScores(input, blocks, model, set, report.quality.noise_px, graph);
  };
  const Scores fit = scores_of(shares.fit), choice = scores_of(shares.choice);
  if (fit.blocks.empty() || choice.blocks.empty()) return t;
  t.scores = MergeShares(fit, choice);
  t.prior = PriorInformation(report.prior, model.effects.get(), *set);
  return t;
}

void AddTotal(const Tested& t, double inflation, CalibrationReport* report) {
  Calibration& c = report->calibration;
  std::vector<int> columns;
  Eigen::VectorXd prior = t.prior;
  for (const UsualColumns& u : t.usual) {
    for (const int column : u.columns) {
      columns.push_back(column);
      prior[column] = 1.0 / (u.sigma * u.sigma);
    }
  }
  if (columns.empty()) return;
  const Projection p = ProjectModelOut(t.scores, columns, prior);
  // In units of each column's prior sigma, where the matrix is well-conditioned.
  Eigen::VectorXd sigma(p.score.size());
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    sigma[i] = 1.0 / std::sqrt(prior[columns[static_cast<size_t>(i)]]);
  }
  Eigen::MatrixXd information = sigma.asDiagonal() * p.information * sigma.asDiagonal() / inflation;
  information.diagonal().array() += 1.0;
  const Eigen::LLT<Eigen::MatrixXd> solver(information);
  const Eigen::VectorXd c_hat = -solver.solve(sigma.cwiseProduct(p.score) / inflation);
  const Eigen::MatrixXd C =
      solver.solve(Eigen::MatrixXd::Identity(information.rows(), information.cols())) +
      c_hat * c_hat.transpose();
  const Eigen::MatrixXd X = p.shift.topRows<kStateSize>() * sigma.asDiagonal();

  c.total_covariance = StateCovariance(c.covariance + X * C * X.transpose());
  Eigen::Index at = 0;
  for (const UsualColumns& u : t.usual) {
    const auto n = static_cast<Eigen::Index>(u.columns.size());
    const Eigen::MatrixXd X_u = X.middleCols(at, n);
    const StateVector variance = (X_u * C.block(at, at, n, n) * X_u.transpose()).diagonal();
    report->systematic.push_back({u.effect, variance.cwiseMax(0.0).cwiseSqrt()});
    at += n;
  }
}

// The most significant candidate, if it is so beyond doubt.
std::optional<std::string> Suspect(const Tested& t, const std::vector<ScoreTest>& alone,
                                   const Scatter& usual) {
  const Candidate* best = nullptr;
  double best_p = 1.0;
  for (size_t i = 0; i < t.candidates.size(); ++i) {
    if (alone[i].dof == 0) continue;
    const ScoreTest test = TestColumns(t.scores, t.candidates[i].columns(), t.prior, usual);
    if (test.dof > 0 && test.p_value < best_p) {
      best_p = test.p_value;
      best = &t.candidates[i];
    }
  }
  best_p *= static_cast<double>(t.candidates.size());
  if (best == nullptr || best_p > kNoDoubt) return std::nullopt;
  return Format(
      "the pictures show something that the model lacks (p = %.0e), first of all like %s: %s; "
      "camgyro diagnose finds out what it is, or name it in --effects",
      std::max(best_p, 1e-99), best->entry->name.c_str(), best->entry->explanation.c_str());
}

}  // namespace

std::optional<std::string> CheckModel(const Recording& recording, const CalibrateOptions& options,
                                      DeviceClass device, CalibrationReport* report) {
  if (!report->residual->facts().with_effects) return std::nullopt;
  if (!(report->quality.noise_px > 0.0)) return std::nullopt;
  const Tested t = Score(recording, options, device, *report);
  if (t.scores.blocks.size() < kLeastBlocks) return std::nullopt;
  std::vector<ScoreTest> alone;
  for (const Candidate& candidate : t.candidates) {
    alone.push_back(TestColumns(t.scores, candidate.columns(), t.prior));
  }
  const Scatter usual = UsualScatter(alone);
  report->device_class = DeviceClassName(device);
  AddTotal(t, std::max(1.0, usual.variance), report);
  return Suspect(t, alone, usual);
}

}  // namespace camgyro
