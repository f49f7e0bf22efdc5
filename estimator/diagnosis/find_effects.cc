// The loop: score every candidate in frames that the fit has not seen, refit the close rivals,
// choose by unseen gain, report on frames that neither has seen.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "estimator/astray.h"
#include "estimator/diagnosis/candidates.h"
#include "estimator/diagnosis/contest.h"
#include "estimator/diagnosis/diagnose.h"
#include "estimator/diagnosis/frame_time_test.h"
#include "estimator/diagnosis/gain_rule.h"
#include "estimator/diagnosis/shared_fits.h"
#include "estimator/diagnosis/step_search.h"
#include "estimator/diagnosis/step_time.h"
#include "estimator/diagnosis/thresholds.h"
#include "estimator/starting_point.h"

namespace camgyro {
namespace {

ReportShare Summarise(const Scores& scores, double noise) {
  ReportShare share;
  for (const BlockScore& block : scores.blocks) {
    share.pairs += block.pairs;
    share.residuals += block.residuals;
  }
  if (share.residuals > 0) {
    share.chi2 = Chi2Of(scores) / share.residuals;
    share.rms_px = noise * std::sqrt(share.chi2);
  }
  return share;
}

CandidateResult MakeResult(const Candidate& candidate, const ScoreTest& test, const Gain& gain) {
  CandidateResult r;
  r.name = candidate.entry->name;
  r.shape = candidate.shape;
  r.parameters = candidate.effect->size();
  r.statistic = test.statistic;
  r.p_value = test.dof > 0 ? test.p_value : 1.0;
  r.inflation = test.inflation;
  r.gain = gain;
  r.parameter_info = candidate.effect->parameters();
  r.estimate = test.estimate;
  if (test.covariance.rows() == test.estimate.size()) {
    r.sigma = test.covariance.diagonal().cwiseSqrt();
  }
  return r;
}

// What a round tests its candidates with.
struct RoundScores {
  EffectSetup setup;
  std::vector<Candidate> candidates;
  Scores fit, choice;
  // Significance is by both shares: what was fitted is projected out of the scores, which makes
  // those of the fit's own frames as good as unseen ones.
  Scores both;
  Eigen::VectorXd prior;  // information, of all columns
};

// Candidates with parameters in the catalogue's order. `usual` becomes what their scatters have in
// common.
std::vector<Contestant> TestCandidates(const RoundScores& round, Scatter* usual) {
  std::vector<ScoreTest> alone;
  for (const Candidate& candidate : round.candidates) {
    if (candidate.widens_prior()) continue;
    alone.push_back(TestColumns(round.both, candidate.columns(), round.prior));
  }
  *usual = UsualScatter(alone);
  const std::vector<double> without = GainAcross(round.fit, round.choice, {}, round.prior);
  std::vector<Contestant> all;
  for (const Candidate& candidate : round.candidates) {
    if (candidate.widens_prior()) continue;
    const ScoreTest test = TestColumns(round.both, candidate.columns(), round.prior, *usual);
    std::vector<double> gain =
        GainAcross(round.fit, round.choice, candidate.columns(), round.prior);
    for (size_t i = 0; i < gain.size(); ++i) gain[i] -= without[i];
    all.push_back({MakeResult(candidate, test, SumOf(gain)), candidate});
    all.back().result.start = StepOf(round.fit, candidate.columns(), round.prior)
                                  .segment(candidate.first, candidate.effect->size());
  }
  return all;
}

// Effects whose shape is the time of a step.
void AddSteps(const RoundScores& round, double block_s, const Scatter& usual,
              std::vector<Contestant>* all) {
  for (const EffectEntry& entry : EffectCatalogue()) {
    if (!entry.step_at) continue;
    const StepSearch found =
        SearchDelayStep(round.both, round.prior, kStepMarginBlocks * block_s, usual);
    if (found.test.dof == 0) continue;
    // Between two frames: a step shows from its first frame on.
    const ShapedEffect step = entry.step_at(round.setup, found.time_s - 1e-3);
    if (step.effect == nullptr) continue;
    const Candidate candidate{&entry, step.shape, step.effect, 0};
    // The gain on unseen frames is known by refit only. Here, what the statistic lets expect, in
    // the units of chi2 as all gains are.
    const double inflation = std::max(1.0, found.test.inflation);
    Gain gain;
    gain.sum = (found.test.statistic - 1.0) * inflation;
    gain.sigma = std::sqrt(2.0 + 4.0 * found.test.statistic) / 2.0 * inflation;
    all->push_back({MakeResult(candidate, found.test, gain), candidate});
    all->back().result.start = found.test.estimate;
  }
}

// Effects that widen the prior of what every pair has of its own.
void AddWidened(const RoundScores& round, std::vector<Contestant>* all) {
  for (const Candidate& candidate : round.candidates) {
    if (!candidate.widens_prior()) continue;
    ScoreTest test;
    test.estimate.resize(0);
    test.dof = 1;
    const Gain gain = SumOf(LatentGain(round.choice));
    test.statistic = std::max(0.0, gain.sum);
    // No parameter was fitted: by Markov's inequality a likelihood ratio exceeds x with a
    // probability below 1/x under the narrow prior.
    test.p_value = std::exp(-0.5 * test.statistic);
    all->push_back({MakeResult(candidate, test, gain), candidate});
  }
}

// Frames' own times. What they gain is known by refit only.
void AddFrameTimes(const SharedFits& fits, const Refined& now, const RoundScores& round,
                   std::vector<Contestant>* all) {
  if (!fits.in().graph.residual->facts().with_frame_times) return;
  if (fits.in().recording->HasOnlyAttitudes()) return;
  const std::vector<Candidate> missing = MissingFrameTimes(now.calibration, round.setup);
  if (missing.empty()) return;
  std::vector<TimedPair> far = Joined(fits.shares().fit);
  const std::vector<TimedPair> choice = Joined(fits.shares().choice);
  far.insert(far.end(), choice.begin(), choice.end());
  const auto halves = [&](const std::vector<TimedPair>& pairs, SplitOfMatches split) {
    return ScoreHalves(fits.input(), pairs, now.calibration, now.quality.noise_px, fits.in().graph,
                       split);
  };
  const FrameTimeTest found = TestFrameTimes(halves(fits.near_pairs(), SplitOfMatches::kSides),
                                             halves(far, SplitOfMatches::kEveryOther),
                                             round.prior.head(round.fit.num_model));
  ScoreTest test;
  test.dof = 1;
  test.statistic = std::pow(std::max(0.0, found.times.sigmas), 2);
  test.p_value = found.times.p_value;
  test.estimate = Eigen::VectorXd::Constant(1, found.spread.value_s);
  test.covariance = Eigen::MatrixXd::Constant(1, 1, std::pow(found.spread.sigma_s, 2));
  for (const Candidate& candidate : missing) {
    all->push_back({MakeResult(candidate, test, {}), candidate});
    all->back().result.start = test.estimate;
    if (!found.is_of_times()) all->back().result.rejected = "not times of the frames' own";
  }
}

// A sign that the effect cannot have: of a parameter whose range begins at zero, below it. Two
// effects may be of opposite signs of one column (gyro_lowpass, exposure_lowpass): what is not
// refitted leaves its place to other rivals.
bool HasWrongSign(const CandidateResult& r) {
  return r.parameters == 1 && r.parameter_info[0].plausible_min == 0.0 && r.sigma.size() == 1 &&
         r.estimate[0] < -kImplausibleSigmas * r.sigma[0];
}

// Significance, all candidates together, and a gain beyond its own noise; best first.
void JudgeAndSort(double significance, std::vector<Contestant>* all) {
  const double tests = static_cast<double>(all->size());
  for (auto& [r, candidate] : *all) {
    r.significant = r.p_value * tests <= significance;
    if (!r.significant) {
      r.rejected = "not significant";
    } else if (candidate.is_last_resort()) {
      continue;
    } else if (HasWrongSign(r)) {
      r.rejected = r.parameter_info[0].name + " outside of what real devices show";
    } else if (!GainBearsOut(r, tests)) {
      r.rejected = "no gain on unseen frames beyond its noise";
    }
  }
  std::stable_sort(all->begin(), all->end(), [](const Contestant& a, const Contestant& b) {
    if (a.result.rejected.empty() != b.result.rejected.empty()) return a.result.rejected.empty();
    return a.result.gain.sum > b.result.gain.sum;
  });
}

class Loop {
 public:
  Loop(const LoopInput& in, const DiagnoseOptions& options, const Progress& progress)
      : in_(in), options_(options), progress_(progress), fits_(in, options) {}

  Result<Calibration> Run(Diagnosis* out) {
    if (!CountPairs(out)) return in_.fit;
    const Result<Refined> first = fits_.Fit(in_.fit, in_.noise);
    if (!first) return tl::unexpected(first.error());
    fit_ = *first;
    // After the last round that may add, one that looks at what is left.
    bool added = true;
    for (int round = 0; round <= options_.max_rounds && added; ++round) {
      DiagnosisRound result;
      added = Round(round, round < options_.max_rounds, &result);
      if (round == 0) out->maps_before = last_maps_;
      out->rounds.push_back(std::move(result));
    }
    out->maps_after = last_maps_;
    Conclude(out);
    return fit_.calibration;
  }

 private:
  // False if they are too few.
  bool CountPairs(Diagnosis* out) const {
    const Shares& shares = fits_.shares();
    out->block_s = shares.block_s;
    out->report_shares_tracks = shares.report_shares_tracks;
    out->fit_pairs = static_cast<int>(Joined(shares.fit).size());
    out->choice_pairs = static_cast<int>(Joined(shares.choice).size());
    out->report_pairs = static_cast<int>(Joined(shares.report).size());
    if (shares.choice.size() >= kLeastBlocks && out->fit_pairs >= kLeastFitPairs &&
        out->choice_pairs >= kLeastChoicePairs) {
      return true;
    }
    out->not_tested = "too short to test anything: " + std::to_string(out->fit_pairs) +
                      " pairs of frames to fit and " + std::to_string(out->choice_pairs) +
                      " to choose by, in " + std::to_string(shares.choice.size()) +
                      " stretches; at least " + std::to_string(kLeastFitPairs) + ", " +
                      std::to_string(kLeastChoicePairs) + " and " + std::to_string(kLeastBlocks) +
                      " are needed";
    return false;
  }

  void Conclude(Diagnosis* out) const {
    std::vector<std::pair<double, std::string>> where;
    for (const StructureMap& map : out->maps_after) {
      if (IsStructure(map, out->maps_after.size(), options_.significance)) {
        where.emplace_back(map.p_value, map.name);
      }
    }
    std::sort(where.begin(), where.end());
    for (const auto& entry : where) out->where.push_back(entry.second);
    out->unexplained_structure = !where.empty();
    out->indistinguishable = Indistinguishable(
        fit_.calibration, Setup(), in_.prior,
        [this](const Calibration& calibration, std::shared_ptr<const EffectSet> candidates) {
          return fits_.ScoresOf(fits_.shares().choice, calibration, std::move(candidates),
                                fit_.quality.noise_px);
        });
    NameEffects(in_.start, fit_.calibration, &out->effects);
  }

  EffectSetup Setup() const {
    EffectSetup setup = MakeEffectSetup(*in_.recording, fit_.calibration);
    TellOfStabiliser(in_.found, &setup);
    return setup;
  }

  // share: of the round. How many rounds follow, nobody knows: as many as there were, let us say.
  void Tell(int round, double share) const {
    if (progress_) progress_("diagnosis", 1.0 - std::pow(0.5, round + share));
  }

  RoundScores Score(EffectSetup setup) const {
    const Calibration& model = fit_.calibration;
    const double noise = fit_.quality.noise_px;
    RoundScores round;
    round.setup = std::move(setup);
    round.candidates = MissingEffects(model, round.setup);
    auto set = std::make_shared<EffectSet>();
    const int present = kStateSize + static_cast<int>(model.effect_values.size());
    for (Candidate& candidate : round.candidates) {
      candidate.first = present + set->size();
      set->Add(candidate.entry, candidate.shape, candidate.effect);
    }
    round.choice = fits_.ScoresOf(fits_.shares().choice, model, set, noise);
    round.fit = fits_.ScoresOf(fits_.shares().fit, model, set, noise);
    round.both = MergeShares(round.fit, round.choice);
    round.prior = PriorInformation(in_.prior, model.effects.get(), *set);
    return round;
  }

  // What is left over image, time, rates and so on.
  std::vector<StructureMap> Maps(const EffectSetup& setup) const {
    const Calibration& model = fit_.calibration;
    const StructureMaps maps(setup, model.bias_gyro_rad_s,
                             model.pair_effects().frame_time_spread_s() > 0.0);
    return maps.Evaluate(
        fits_.ScoresOf(fits_.map_pairs(), model, maps.set(), fit_.quality.noise_px),
        kStateSize + static_cast<int>(model.effect_values.size()),
        PriorInformation(in_.prior, model.effects.get(), *maps.set()));
  }

  // One round. True if an effect was added (fit_ has it then).
  bool Round(int round, bool may_add, DiagnosisRound* result) {
    const double noise = fit_.quality.noise_px;
    Tell(round, 0.1);
    EffectSetup setup = Setup();
    // Before the candidates, whose scores of an hour need not be beside those of the maps, 125 MB.
    last_maps_ = Maps(setup);
    Tell(round, 0.2);
    const RoundScores scores = Score(std::move(setup));
    result->before = result->after =
        Summarise(fits_.ScoresOf(fits_.shares().report, fit_.calibration, nullptr, noise), noise);
    const bool delay_moves = DelayMoves(last_maps_, options_.significance);
    Scatter usual;
    std::vector<Contestant> all = TestCandidates(scores, &usual);
    AddSteps(scores, fits_.shares().block_s, usual, &all);
    if (delay_moves) ReplaceByLargeStep(scores.setup, &all);
    AddWidened(scores, &all);
    AddFrameTimes(fits_, fit_, scores, &all);
    JudgeAndSort(options_.significance, &all);
    Tell(round, 0.4);

    bool added = false;
    if (may_add && !all.empty() &&
        (all.front().result.rejected.empty() || delay_moves ||
         (round == 0 && fits_.HasRunAway(fit_.calibration)))) {
      ContestSetting setting;
      setting.fits = &fits_;
      setting.now = &fit_;
      setting.choice = &scores.choice;
      setting.first_round = round == 0;
      setting.delay_moves = delay_moves;
      std::optional<ContestResult> contest = RunContest(setting, &all);
      if (!contest) contest = RunLastResort(setting, &all);
      if (contest) {
        Take(*contest, &all, result);
        added = true;
      }
    }
    for (Contestant& contestant : all) result->candidates.push_back(std::move(contestant.result));
    return added;
  }

  // In place of the linear search's step one that explains a good part of a misfit that comes and
  // goes, if there is one.
  void ReplaceByLargeStep(const EffectSetup& setup, std::vector<Contestant>* all) const {
    const auto found = FindLargeStep(fits_.input(), fits_.SeenBlocks(), fit_.calibration,
                                     fit_.quality.noise_px, in_.graph);
    if (!found || found->explained < kGoodPart) return;
    for (auto& [r, candidate] : *all) {
      if (!candidate.entry->step_at) continue;
      ShapedEffect step = candidate.entry->step_at(setup, found->time_s);
      candidate.shape = r.shape = step.shape;
      candidate.effect = std::move(step.effect);
      r.start = Eigen::VectorXd::Constant(1, found->step_s);
      r.start_delay_change_s = found->delay_s - fit_.calibration.delay_s;
    }
  }

  // Makes the winner's fit the present one, and it the first of all.
  void Take(const ContestResult& contest, std::vector<Contestant>* all, DiagnosisRound* result) {
    const double noise = fit_.quality.noise_px;
    const Calibration &was = fit_.calibration, &is = contest.fit.calibration;
    const CandidateResult& chosen = (*all)[contest.winner].result;
    result->added = chosen.name;
    result->shape = chosen.shape;
    result->shift_sigmas = Difference(is, was).cwiseQuotient(was.sigma());
    // Before and after in frames that nobody has seen, both with the noise before.
    const Scores before = fits_.ScoresOf(fits_.shares().report, was, nullptr, noise);
    const Scores after = fits_.ScoresOf(fits_.shares().report, is, nullptr, noise);
    result->before = Summarise(before, noise);
    result->after = Summarise(after, noise);
    result->report_gain = SumOf(Fall(before, after));
    result->expected_gain = ExpectedFall(after, was, is);
    fit_ = contest.fit;
    for (auto& [r, candidate] : *all) {
      if (&r != &chosen && candidate.is_last_resort() && r.rejected.empty()) {
        r.rejected = "asked when no other effect is left";
      }
    }
    const auto at = all->begin() + static_cast<std::ptrdiff_t>(contest.winner);
    std::rotate(all->begin(), at, at + 1);
  }

  const LoopInput& in_;
  const DiagnoseOptions& options_;
  const Progress& progress_;
  const SharedFits fits_;
  Refined fit_;
  std::vector<StructureMap> last_maps_;
};

}  // namespace

Result<Calibration> FindEffects(const LoopInput& input, const DiagnoseOptions& options,
                                const Progress& progress, Diagnosis* diagnosis) {
  return Loop(input, options, progress).Run(diagnosis);
}

}  // namespace camgyro
