#include "estimator/diagnosis/candidates.h"

#include <algorithm>
#include <cmath>

#include "estimator/astray.h"
#include "estimator/diagnosis/score_test.h"
#include "estimator/diagnosis/thresholds.h"

namespace camgyro {
namespace {

bool IsOneSided(const Effect& effect) {
  return effect.size() == 1 && effect.parameters()[0].plausible_min == 0.0;
}

}  // namespace

std::vector<Candidate> MissingEffects(const Calibration& model, const EffectSetup& setup) {
  std::vector<Candidate> candidates;
  for (const EffectEntry& entry : EffectCatalogue()) {
    int present_size = -1;
    if (model.effects) {
      for (const auto& item : model.effects->items()) {
        if (item.entry == &entry) present_size = item.effect->size();
      }
    }
    for (const std::string& shape : entry.shapes(setup)) {
      std::shared_ptr<const Effect> effect = entry.make(setup, shape);
      // Frames' own times have a test of their own.
      if (effect == nullptr || effect->frees_frame_times()) continue;
      if (effect->size() > present_size) {
        candidates.push_back({&entry, shape, std::move(effect), 0});
      }
    }
  }
  return candidates;
}

std::vector<Candidate> MissingFrameTimes(const Calibration& model, const EffectSetup& setup) {
  std::vector<Candidate> candidates;
  if (model.pair_effects().frame_time_spread_s() > 0.0) return candidates;
  for (const EffectEntry& entry : EffectCatalogue()) {
    for (const std::string& shape : entry.shapes(setup)) {
      std::shared_ptr<const Effect> effect = entry.make(setup, shape);
      if (effect == nullptr || !effect->frees_frame_times()) continue;
      candidates.push_back({&entry, shape, std::move(effect), 0});
    }
  }
  return candidates;
}

void AddEffect(const Candidate& candidate, Calibration* calibration) {
  auto set = std::make_shared<EffectSet>();
  std::vector<double> values;
  if (calibration->effects) {
    for (const auto& item : calibration->effects->items()) {
      if (item.entry == candidate.entry && !item.entry->adds_up) continue;
      set->Add(item);
      for (int k = 0; k < item.effect->size(); ++k) {
        values.push_back(calibration->effect_values[item.first + k]);
      }
    }
  }
  set->Add(candidate.entry, candidate.shape, candidate.effect);
  values.resize(static_cast<size_t>(set->size()), 0.0);
  calibration->effects = set;
  calibration->effect_values =
      Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  calibration->effect_covariance = Eigen::MatrixXd::Zero(set->size(), set->size());
}

void NameEffects(const Calibration& begin, const Calibration& fit,
                 std::vector<std::string>* names) {
  if (!fit.effects) return;
  for (const EffectSet::Item& item : fit.effects->items()) {
    const bool found = item.entry->found_at_start && item.usual_sigma == 0.0 && IsSeen(item, fit);
    const auto is_same = [&](const EffectSet::Item& other) {
      return other.entry == item.entry && (other.shape == item.shape || other.entry->shape_by_fit);
    };
    if (!found && begin.effects &&
        std::any_of(begin.effects->items().begin(), begin.effects->items().end(), is_same)) {
      continue;
    }
    const bool known = std::count(names->begin(), names->end(), item.entry->name) > 0;
    if (!known || item.entry->adds_up) names->push_back(item.entry->name);
  }
}

Eigen::VectorXd PriorInformation(const Prior& prior, const EffectSet* model,
                                 const EffectSet& candidates) {
  const int present = model != nullptr ? model->size() : 0;
  Eigen::VectorXd information(kStateSize + present + candidates.size());
  information.head<kStateSize>() = prior.sigma.cwiseAbs2().cwiseInverse();
  for (int i = 0; i < present; ++i) {
    information[kStateSize + i] = std::pow(model->parameter(i).spread, -2.0);
  }
  for (int i = 0; i < candidates.size(); ++i) {
    information[kStateSize + present + i] = std::pow(candidates.parameter(i).spread, -2.0);
  }
  return information;
}

std::vector<std::vector<std::string>> Indistinguishable(
    const Calibration& fit, const EffectSetup& setup, const Prior& prior,
    const std::function<Scores(const Calibration&, std::shared_ptr<const EffectSet>)>& scores_of) {
  std::vector<std::vector<std::string>> aliases;
  if (!fit.effects) return aliases;
  auto set = std::make_shared<EffectSet>();
  std::vector<Candidate> all;
  for (const auto& item : fit.effects->items()) {
    all.push_back({item.entry, item.shape, item.effect, 0});
  }
  const size_t in_model = all.size();
  for (const Candidate& candidate : MissingEffects(fit, setup)) {
    if (!fit.effects->Has(candidate.entry->name)) all.push_back(candidate);
  }
  for (Candidate& candidate : all) {
    candidate.first = kStateSize + set->size();
    set->Add(candidate.entry, candidate.shape, candidate.effect);
  }
  // Scores at the fit, but with the effects as candidates, so that they are not projected out:
  // the derivatives hardly depend on where they are taken.
  Calibration plain = fit;
  plain.effects = nullptr;
  plain.effect_values.resize(0);
  plain.lens = fit.FullLens();
  const Scores scores = scores_of(plain, set);
  if (scores.blocks.size() < kLeastBlocks) return aliases;
  const Eigen::VectorXd information = PriorInformation(prior, nullptr, *set);
  for (size_t i = 0; i < in_model; ++i) {
    for (size_t j = i + 1; j < all.size(); ++j) {
      if (all[i].columns().empty() || all[j].columns().empty()) continue;
      // A flexible curve contains simpler effects: that is no alias of the motion.
      if (all[j].columns().size() > kAliasFactor * all[i].columns().size() + kAliasMore) continue;
      const double alias = AliasOf(scores, all[i].columns(), all[j].columns(), information);
      // Parameters that both begin at zero: their signs tell.
      const bool opposite = alias < 0.0 && IsOneSided(*all[i].effect) && IsOneSided(*all[j].effect);
      if (std::abs(alias) > kAliasLimit && !opposite) {
        aliases.push_back({all[i].entry->name, all[j].entry->name});
      }
    }
  }
  return aliases;
}

}  // namespace camgyro
