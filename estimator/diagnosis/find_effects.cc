// The loop: score every candidate in frames that the fit has not seen, refit the close rivals,
// choose by unseen gain, report on frames that neither has seen.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/so3.h"
#include "estimator/diagnosis/candidates.h"
#include "estimator/diagnosis/diagnose.h"
#include "estimator/diagnosis/gain_rule.h"
#include "estimator/diagnosis/step_time.h"
#include "estimator/window/pair_view.h"

namespace camgyro {
namespace {

// Fall of chi2 by block; blocks that one of the two could not evaluate count nothing.
std::vector<double> Fall(const Scores& before, const Scores& after) {
  std::vector<double> fall;
  for (const BlockScore& b : before.blocks) {
    for (const BlockScore& a : after.blocks) {
      if (a.time_s == b.time_s && a.pairs == b.pairs) fall.push_back(b.chi2 - a.chi2);
    }
  }
  return fall;
}

double Chi2Of(const Scores& scores) {
  double chi2 = 0.0;
  for (const BlockScore& block : scores.blocks) chi2 += block.chi2;
  return chi2;
}

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

class Loop {
 public:
  Loop(const LoopInput& in, const DiagnoseOptions& options, const Progress& progress)
      : in_(in),
        options_(options),
        progress_(progress),
        input_(MakeEstimationInput(*in.recording, SelectPairs(*in.recording))),
        shares_(MakeShares(*in.recording, input_)) {
    const PairSelection near = SelectPairs(*in.recording, kNearGap);
    map_pairs_ = MakeShares(*in.recording, MakeEstimationInput(*in.recording, near)).choice;
    Thin(kMostFitPairs, &shares_.fit);
    Thin(kMostChoicePairs, &shares_.choice);
    Thin(kMostChoicePairs, &map_pairs_);
  }

  Result<Calibration> Run(Diagnosis* out) {
    out->block_s = shares_.block_s;
    out->report_shares_tracks = shares_.report_shares_tracks;
    out->fit_pairs = static_cast<int>(Joined(shares_.fit).size());
    out->choice_pairs = static_cast<int>(Joined(shares_.choice).size());
    out->report_pairs = static_cast<int>(Joined(shares_.report).size());
    if (shares_.choice.size() < 4 || out->fit_pairs < 25 || out->choice_pairs < 25) {
      out->not_tested = "too short to test anything: " + std::to_string(out->fit_pairs) +
                        " pairs of frames to fit and " + std::to_string(out->choice_pairs) +
                        " to choose by, in " + std::to_string(shares_.choice.size()) +
                        " stretches; at least 25, 25 and 4 are needed";
      return in_.fit;
    }
    const Result<Refined> first = Fit(in_.fit, in_.noise);
    if (!first) return tl::unexpected(first.error());
    fit_ = *first;
    for (int round = 0; round < options_.max_rounds; ++round) {
      Tell(round);
      DiagnosisRound result;
      const bool added = Round(round, &result);
      if (round == 0) out->maps_before = last_maps_;
      out->maps_after = last_maps_;
      out->rounds.push_back(std::move(result));
      if (!added) break;
    }
    if (!out->rounds.empty() && !out->rounds.back().added.empty()) {
      // The last round allowed has added something: what is left then was not looked at yet.
      DiagnosisRound rest;
      const int keep = options_.max_rounds;
      Round(keep, &rest, /*may_add=*/false);
      out->maps_after = last_maps_;
      out->rounds.push_back(std::move(rest));
    }
    std::vector<std::pair<double, std::string>> where;
    for (const StructureMap& map : out->maps_after) {
      if (IsStructure(map)) where.emplace_back(map.p_value, map.name);
    }
    std::sort(where.begin(), where.end());
    for (const auto& entry : where) out->where.push_back(entry.second);
    out->unexplained_structure = !where.empty();
    out->indistinguishable = Indistinguishable(
        fit_.calibration, MakeEffectSetup(*in_.recording, fit_.calibration), in_.prior,
        [this](const Calibration& calibration, std::shared_ptr<const EffectSet> candidates) {
          return ScoresOf(shares_.choice, calibration, std::move(candidates),
                          fit_.quality.noise_px);
        });
    if (fit_.calibration.effects) {
      for (const auto& item : fit_.calibration.effects->items()) {
        out->effects.push_back(item.entry->name);
      }
    }
    return fit_.calibration;
  }

 private:
  // Of the maps: what comes and goes within some frames is to be seen.
  static constexpr int kNearGap = 3;
  // Of recordings with pixels. A fit needs no more to tell effects apart: what it gets wrong within
  // its noise is projected out of the test. Time is spent on the refits.
  static constexpr size_t kMostFitPairs = 400, kMostChoicePairs = 800;
  static constexpr double kStrongMisfit = 0.02;  // gain of one effect over chi2

  // Leaves every n-th pair, so that at most `most` stay.
  void Thin(size_t most, std::vector<PairBlock>* blocks) const {
    const size_t stride = (Joined(*blocks).size() + most - 1) / most;
    if (stride < 2 || in_.recording->HasOnlyAttitudes()) return;
    size_t at = 0;
    for (PairBlock& block : *blocks) {
      PairBlock kept;
      for (TimedPair& pair : block) {
        if (at++ % stride == 0) kept.push_back(std::move(pair));
      }
      block = std::move(kept);
    }
  }

  void Tell(int round) const {
    if (progress_) progress_("diagnosis", std::min(0.99, (round + 0.2) / options_.max_rounds));
  }

  bool IsStructure(const StructureMap& map) const {
    const double tests = static_cast<double>(last_maps_.size());
    if (map.dof == 0) return false;
    if (map.name == "delay frame by frame") {
      // Its chi2 depends on the noise model to some percent: it must be larger by half.
      return map.statistic > 1.5 * map.dof && map.p_value < 1e-6;
    }
    // Noise changes with what is seen: up to 3.5 where nothing else is wrong (iphone-cards). Wrong
    // by more than the loss is 8.
    if (map.name == "misfit over time" && map.statistic < 4.0) return false;
    return map.p_value * tests < 0.1 * options_.significance;
  }

  Result<Refined> Fit(const Calibration& start, double noise) const {
    RefinementOptions refinement = options_.calibrate.refinement;
    refinement.graph = in_.graph;
    refinement.graph.sigma_px = noise;
    refinement.sigma_rad = noise;
    refinement.cluster_s = shares_.block_s;
    refinement.max_rounds = 4;
    return Refine(input_, Joined(shares_.fit), start, in_.prior, refinement);
  }

  Scores ScoresOf(const std::vector<PairBlock>& blocks, const Calibration& calibration,
                  std::shared_ptr<const EffectSet> candidates, double noise) const {
    return ComputeScores(input_, blocks, calibration, std::move(candidates), noise, in_.graph);
  }

  // One round. True if an effect was added (fit_ has it then).
  bool Round(int round, DiagnosisRound* result, bool may_add = true) {
    const Calibration& model = fit_.calibration;
    const double noise = fit_.quality.noise_px;
    const EffectSetup setup = MakeEffectSetup(*in_.recording, model);
    std::vector<Candidate> candidates = MissingEffects(model, setup);
    auto set = std::make_shared<EffectSet>();
    const int present = kStateSize + static_cast<int>(model.effect_values.size());
    for (Candidate& candidate : candidates) {
      candidate.first = present + set->size();
      set->Add(candidate.entry, candidate.shape, candidate.effect);
    }
    const Scores choice = ScoresOf(shares_.choice, model, set, noise);
    const Scores fit = ScoresOf(shares_.fit, model, set, noise);
    const Eigen::VectorXd prior = PriorInformation(in_.prior, model.effects.get(), *set);
    const StructureMaps maps(setup, model.bias_gyro_rad_s);
    last_maps_ = maps.Evaluate(ScoresOf(map_pairs_, model, maps.set(), noise), present,
                               PriorInformation(in_.prior, model.effects.get(), *maps.set()));
    result->before = result->after =
        Summarise(ScoresOf(shares_.report, model, nullptr, noise), noise);

    // Of each share by the other's step, by block; halved, to compare with a refit's gain in one.
    const auto gain_of_step = [&](const std::vector<int>& columns) {
      std::vector<double> gain = GainOfStep(choice, StepOf(fit, columns, prior));
      const std::vector<double> other = GainOfStep(fit, StepOf(choice, columns, prior));
      gain.insert(gain.end(), other.begin(), other.end());
      for (double& g : gain) g *= 0.5;
      return gain;
    };
    const std::vector<double> without = gain_of_step({});
    // Significance by both shares: what was fitted is projected out of the scores, which makes
    // those of the fit's own frames as good as unseen ones.
    const Scores both = MergeShares(fit, choice);
    std::vector<ScoreTest> alone;
    for (const Candidate& candidate : candidates) {
      alone.push_back(TestColumns(both, candidate.columns(), prior));
    }
    const Scatter usual = UsualScatter(alone);
    std::vector<std::pair<CandidateResult, Candidate>> all;
    for (const Candidate& candidate : candidates) {
      const ScoreTest test = TestColumns(both, candidate.columns(), prior, usual);
      std::vector<double> gain = gain_of_step(candidate.columns());
      for (size_t i = 0; i < gain.size(); ++i) gain[i] -= without[i];
      all.emplace_back(MakeResult(candidate, test, SumOf(gain)), candidate);
      all.back().first.start = StepOf(fit, candidate.columns(), prior)
                                   .segment(candidate.first, candidate.effect->size());
    }
    AddStepCandidate(setup, both, prior, usual, &all);
    if (DelayMoves()) ReplaceByLargeStep(setup, &all);
    AddTurnCandidate(setup, choice, &all);

    // Significance, all candidates together, and a gain beyond its own noise.
    const double tests = static_cast<double>(all.size());
    for (auto& [r, candidate] : all) {
      r.significant = r.p_value * tests <= options_.significance;
      if (!r.significant) {
        r.rejected = "not significant";
      } else if (!GainBearsOut(r, tests)) {
        r.rejected = "no gain on unseen frames beyond its noise";
      }
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
      if (a.first.rejected.empty() != b.first.rejected.empty()) return a.first.rejected.empty();
      return a.first.gain.sum > b.first.gain.sum;
    });
    bool added = false;
    if (may_add && !all.empty() &&
        (all.front().first.rejected.empty() || DelayMoves() ||
         (round == 0 && HasRunAway(fit_.calibration)))) {
      added = Contest(round, choice, noise, &all, result);
    }
    for (auto& entry : all) result->candidates.push_back(std::move(entry.first));
    return added;
  }

  CandidateResult MakeResult(const Candidate& candidate, const ScoreTest& test,
                             const Gain& gain) const {
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

  void AddStepCandidate(const EffectSetup& setup, const Scores& both, const Eigen::VectorXd& prior,
                        const Scatter& usual,
                        std::vector<std::pair<CandidateResult, Candidate>>* all) const {
    const EffectEntry* entry = FindEffect("delay_step");
    const StepSearch found = SearchDelayStep(both, prior, 1.5 * shares_.block_s, usual);
    if (found.test.dof == 0) return;
    // Between two frames: a step shows from its first frame on.
    const std::string shape = DelayStepShape(found.time_s - 1e-3);
    Candidate candidate{entry, shape, entry->make(setup, shape), 0};
    if (candidate.effect == nullptr) return;
    // The gain on unseen frames is known by refit only. Here, what the statistic lets expect, in
    // the units of chi2 as all gains are.
    const double inflation = std::max(1.0, found.test.inflation);
    Gain gain;
    gain.sum = (found.test.statistic - 1.0) * inflation;
    gain.sigma = std::sqrt(2.0 + 4.0 * found.test.statistic) / 2.0 * inflation;
    all->emplace_back(MakeResult(candidate, found.test, gain), candidate);
    all->back().first.start = found.test.estimate;
  }

  // In place of the linear search's step one that explains a good part of a misfit that comes and
  // goes, if there is one.
  void ReplaceByLargeStep(const EffectSetup& setup,
                          std::vector<std::pair<CandidateResult, Candidate>>* all) const {
    constexpr double kGoodPart = 0.3;
    std::vector<PairBlock> blocks;
    for (const auto* share : {&shares_.fit, &shares_.choice}) {
      std::copy_if(share->begin(), share->end(), std::back_inserter(blocks),
                   [](const PairBlock& block) { return !block.empty(); });
    }
    std::sort(blocks.begin(), blocks.end(), [](const PairBlock& a, const PairBlock& b) {
      return a.front().time_a_s < b.front().time_a_s;
    });
    const auto found =
        FindLargeStep(input_, blocks, fit_.calibration, fit_.quality.noise_px, in_.graph);
    if (!found || found->explained < kGoodPart) return;
    for (auto& [r, candidate] : *all) {
      if (r.name != "delay_step") continue;
      candidate.shape = r.shape = DelayStepShape(found->time_s);
      candidate.effect = candidate.entry->make(setup, r.shape);
      r.start = Eigen::VectorXd::Constant(1, found->step_s);
      r.start_delay_change_s = found->delay_s - fit_.calibration.delay_s;
    }
  }

  void AddTurnCandidate(const EffectSetup& setup, const Scores& choice,
                        std::vector<std::pair<CandidateResult, Candidate>>* all) const {
    const EffectEntry* entry = FindEffect("translation_acceleration");
    if (!setup.has_pixels ||
        (fit_.calibration.effects && fit_.calibration.effects->Has(entry->name))) {
      return;
    }
    Candidate candidate{entry, "turn", entry->make(setup, "turn"), 0};
    std::vector<double> gain(choice.blocks.size(), 0.0);
    for (const PairScore& pair : choice.pairs) {
      gain[static_cast<size_t>(pair.block)] += pair.turn_gain;
    }
    ScoreTest test;
    test.estimate.resize(0);
    test.dof = 1;
    const Gain sum = SumOf(gain);
    test.statistic = std::max(0.0, sum.sum);
    // No parameter was fitted: by Markov's inequality a likelihood ratio exceeds x with a
    // probability below 1/x under the narrow prior.
    test.p_value = std::exp(-0.5 * test.statistic);
    all->emplace_back(MakeResult(candidate, test, sum), candidate);
  }

  // Refits the close rivals and adds the best. `all` is sorted.
  bool Contest(int round, const Scores& choice, double noise,
               std::vector<std::pair<CandidateResult, Candidate>>* all, DiagnosisRound* result) {
    struct Rival {
      size_t at;
      Refined fit;
      std::vector<double> gain;
    };
    std::vector<Rival> rivals;
    const CandidateResult& front = all->front().first;
    const double best_gain = front.rejected.empty() ? front.gain.sum : 0.0;
    // Far from where the model belongs, a linear gain says little: then a distorting lens, which
    // throws the plain model off most, is tried in any case, and from where it all began. So is a
    // step of a delay that moves: where it leaves most matches beyond the loss, their scores
    // scatter, or are nothing.
    const bool astray =
        round == 0 && (best_gain > kStrongMisfit * Chi2Of(choice) || HasRunAway(fit_.calibration));
    for (size_t i = 0; i < all->size(); ++i) {
      auto& [r, candidate] = (*all)[i];
      const bool in_any_case =
          (astray && r.name == "radial_distortion") || (DelayMoves() && r.name == "delay_step");
      if (in_any_case && !r.rejected.empty()) {
        r.tried_anyway = true;
        r.rejected.clear();
      }
      if (!r.rejected.empty()) continue;
      if (candidate.effect->turn_sigma_rad_s() > 0.0) {
        // It frees three numbers per pair, whose gain the likelihood ratio has discounted: that one
        // stands, not the fall of chi2.
        Calibration turned = fit_.calibration;
        AddEffect(candidate, &turned);
        const Result<Refined> with_turn = Fit(turned, noise);
        if (!with_turn) continue;
        r.rejected = Implausible(with_turn->calibration);
        if (!r.rejected.empty()) continue;
        std::vector<double> gain(choice.blocks.size(), 0.0);
        for (const PairScore& pair : choice.pairs) {
          gain[static_cast<size_t>(pair.block)] += pair.turn_gain;
        }
        r.refitted = true;
        rivals.push_back({i, *with_turn, std::move(gain)});
        continue;
      }
      if (!in_any_case && (static_cast<int>(rivals.size()) >= options_.max_rivals ||
                           r.gain.sum < 0.25 * best_gain)) {
        r.rejected = "others gain more";
        continue;
      }
      Calibration start = fit_.calibration;
      AddEffect(candidate, &start);
      const int columns = candidate.effect->size();
      if (r.start.size() == columns) start.effect_values.tail(columns) = r.start;
      start.delay_s += r.start_delay_change_s;
      Result<Refined> fit = Fit(start, noise);
      if (astray) {
        Calibration anew = in_.start;
        AddEffect(candidate, &anew);
        const Result<Refined> other = Fit(anew, in_.noise);
        const auto rank = [&](const Refined& f) {
          return std::pair(!Implausible(f.calibration).empty(), FitChi2(f));
        };
        if (other && (!fit || rank(*other) < rank(*fit))) fit = other;
      }
      if (fit && r.name == "delay_step" && PlaceSteps(&fit->calibration)) {
        const Calibration placed = fit->calibration;
        r.shape = placed.effects->items().back().shape;
        fit = Fit(placed, noise);
      }
      if (fit) {
        fit = SettleEffects(*in_.recording, *std::move(fit),
                            [this](const Calibration& from, double px) { return Fit(from, px); });
      }
      if (!fit) {
        r.rejected = "the fit with it failed: " + fit.error().message;
        continue;
      }
      r.refitted = true;
      const Scores with = ScoresOf(shares_.choice, fit->calibration, nullptr, noise);
      Rival rival{i, *fit, Fall(choice, with)};
      r.gain = SumOf(rival.gain);
      const EffectSet::Item& item = fit->calibration.effects->items().back();
      r.estimate = fit->calibration.effect_values.segment(item.first, item.effect->size());
      r.sigma = fit->calibration.effect_covariance.diagonal()
                    .segment(item.first, item.effect->size())
                    .cwiseSqrt();
      r.rejected = Implausible(fit->calibration);
      if (r.rejected.empty() && !GainBearsOut(r, static_cast<double>(all->size()))) {
        r.rejected = "no gain on unseen frames beyond its noise";
      }
      // One that its score does not name is corrected for what could have been tried in its place:
      // a step in every stretch.
      const double chances =
          r.tried_anyway
              ? static_cast<double>(all->size() * (shares_.fit.size() + shares_.choice.size()))
              : 1.0;
      if (r.rejected.empty() && chances * PValueOfFit(fit->calibration, r.inflation, r.gain.sum) >
                                    options_.significance) {
        r.rejected = "not significant once fitted";
      }
      if (r.rejected.empty()) rivals.push_back(std::move(rival));
    }
    if (rivals.empty()) return false;
    const auto gain_of = [&](const Rival& rival) { return (*all)[rival.at].first.gain.sum; };
    const auto size_of = [&](const Rival& rival) {
      const bool turn = (*all)[rival.at].second.effect->turn_sigma_rad_s() > 0.0;
      return turn ? 1000 : (*all)[rival.at].first.parameters;
    };
    size_t winner = 0;
    for (size_t i = 1; i < rivals.size(); ++i) {
      if (gain_of(rivals[i]) > gain_of(rivals[winner])) winner = i;
    }
    // One with fewer parameters that is no worse beyond the noise of the difference.
    for (size_t i = 0; i < rivals.size(); ++i) {
      if (size_of(rivals[i]) >= size_of(rivals[winner]) ||
          rivals[i].gain.size() != rivals[winner].gain.size()) {
        continue;
      }
      std::vector<double> difference;
      for (size_t b = 0; b < rivals[i].gain.size(); ++b) {
        difference.push_back(rivals[winner].gain[b] - rivals[i].gain[b]);
      }
      const Gain behind = SumOf(difference);
      if (behind.sum < 2.0 * behind.sigma) winner = i;
    }
    for (size_t i = 0; i < rivals.size(); ++i) {
      if (i != winner) (*all)[rivals[i].at].first.rejected = "another explains more";
    }
    const Rival& best = rivals[winner];
    const CandidateResult& chosen = (*all)[best.at].first;
    result->added = chosen.name;
    result->shape = chosen.shape;
    result->shift_sigmas =
        Difference(best.fit.calibration, fit_.calibration).cwiseQuotient(fit_.calibration.sigma());
    // Before and after in frames that nobody has seen, both with the noise before.
    const Scores before = ScoresOf(shares_.report, fit_.calibration, nullptr, noise);
    const Scores after = ScoresOf(shares_.report, best.fit.calibration, nullptr, noise);
    result->before = Summarise(before, noise);
    result->after = Summarise(after, noise);
    result->report_gain = SumOf(Fall(before, after));
    fit_ = best.fit;
    std::rotate(all->begin(), all->begin() + static_cast<std::ptrdiff_t>(best.at),
                all->begin() + static_cast<std::ptrdiff_t>(best.at) + 1);
    return true;
  }

  // The linear search of a step is right to within a pair, or a gap between the shares.
  bool PlaceSteps(Calibration* calibration) const {
    std::vector<TimedPair> pairs = Joined(shares_.fit);
    const std::vector<TimedPair> choice = Joined(shares_.choice);
    pairs.insert(pairs.end(), choice.begin(), choice.end());
    return PlaceDelaySteps(*in_.recording, input_, pairs, 1.5 * shares_.block_s,
                           fit_.quality.noise_px, in_.graph, calibration);
  }

  // Of the last effect's parameters being all zero, by both shares: Wald's statistic of the fit
  // share and the gain in the choice share. If the best parameters are a of one and b of the other,
  // in sigmas, the two are a^2 and at most 2ab - a^2, so that their sum is bounded by a^2 + b^2,
  // chi2 with twice the parameters. The score extrapolates from zero, at derivatives of a model
  // that may be far off.
  static double PValueOfFit(const Calibration& calibration, double inflation, double gain) {
    const EffectSet::Item& item = calibration.effects->items().back();
    const int n = item.effect->size();
    const Eigen::VectorXd value = calibration.effect_values.segment(item.first, n);
    const Eigen::MatrixXd covariance =
        calibration.effect_covariance.block(item.first, item.first, n, n);
    const double statistic = value.dot(covariance.completeOrthogonalDecomposition().solve(value));
    return ChiSquareTail((statistic + std::max(0.0, gain)) / std::max(1.0, inflation), 2 * n);
  }

  bool DelayMoves() const {
    return std::any_of(last_maps_.begin(), last_maps_.end(), [this](const StructureMap& map) {
      // To try costs a scan and a refit; a walk loses less to the loss than a run.
      return (map.name == "delay over time" && IsStructure(map)) ||
             (map.name == "misfit over time" && map.statistic > 2.0 && map.p_value < 1e-3);
    });
  }

  // Why a fit cannot be right, by its last effect and by its focal length; empty: it can.
  std::string Implausible(const Calibration& c) const {
    const EffectSet::Item& item = c.effects->items().back();
    for (int k = 0; k < item.effect->size(); ++k) {
      const EffectParameter& p = item.effect->parameters()[static_cast<size_t>(k)];
      const double value = c.effect_values[item.first + k];
      const double sigma = std::sqrt(c.effect_covariance(item.first + k, item.first + k));
      if (value < p.plausible_min - 2.0 * sigma || value > p.plausible_max + 2.0 * sigma) {
        return p.name + " outside of what real devices show";
      }
    }
    if (std::abs(std::log(c.lens[kFocal] / in_.start.lens[kFocal])) > M_LN2) {
      return "the fit runs away with it";
    }
    return "";
  }

  // Focal length 15 % or centre 5 % of the diagonal from where it all began.
  bool HasRunAway(const Calibration& c) const {
    const LensParameters& start = in_.start.lens;
    return std::abs(c.lens[kFocal] / start[kFocal] - 1.0) > 0.15 ||
           std::hypot(c.lens[kCx] - start[kCx], c.lens[kCy] - start[kCy]) >
               0.05 * std::hypot(c.width_px, c.height_px);
  }

  double FitChi2(const Refined& fit) const { return fit.quality.rms_px; }

  const LoopInput& in_;
  const DiagnoseOptions& options_;
  const Progress& progress_;
  const EstimationInput input_;
  Shares shares_;
  std::vector<PairBlock> map_pairs_;  // the choice share's frames in pairs that are near
  Refined fit_;
  std::vector<StructureMap> last_maps_;
};

}  // namespace

Result<Calibration> FindEffects(const LoopInput& input, const DiagnoseOptions& options,
                                const Progress& progress, Diagnosis* diagnosis) {
  return Loop(input, options, progress).Run(diagnosis);
}

}  // namespace camgyro
