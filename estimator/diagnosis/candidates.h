// What the catalogue offers beyond a model.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_CANDIDATES_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_CANDIDATES_H_

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/effects/catalogue.h"
#include "estimator/diagnosis/pair_scores.h"

namespace camgyro {

// A candidate: an effect in one shape.
struct Candidate {
  const EffectEntry* entry = nullptr;
  std::string shape;
  std::shared_ptr<const Effect> effect;
  int first = 0;  // column in the scores
  std::vector<int> columns() const {
    std::vector<int> c(static_cast<size_t>(effect->size()));
    for (size_t i = 0; i < c.size(); ++i) c[i] = first + static_cast<int>(i);
    return c;
  }
  // Instead of having parameters, it frees what pairs of frames have of their own.
  bool widens_prior() const { return effect->widens_prior(); }
  // It explains whatever changes from frame to frame: what other effects do, too. So it is asked
  // only where none of these is left to add.
  bool is_last_resort() const { return effect->frees_frame_times(); }
  // Between rivals that gain alike, the smaller one wins: parameters, or more than any effect has
  // of them for one that frees some in every pair.
  int complexity() const { return widens_prior() ? 1000 : effect->size(); }
};

// Effects that the model has not, or only in a shape with fewer parameters; without those whose
// shape is a time, which is searched (EffectEntry::step_at), and those that free the frames' times.
std::vector<Candidate> MissingEffects(const Calibration& model, const EffectSetup& setup);
// Those that do (Effect::frees_frame_times), which have a test of their own; none if the frames'
// times are free in the model.
std::vector<Candidate> MissingFrameTimes(const Calibration& model, const EffectSetup& setup);

// The model's effects and one more; another shape of the same effect takes its place, unless
// they add up. Values carry over.
void AddEffect(const Candidate& candidate, Calibration* calibration);

// Appends the names of the effects that the data show: those that the loop has added to the model
// it began with, and those that the start took into that one and the fit sees (IsSeen). The others
// are in the model since the user has named them, since devices usually have them, or since the
// start leaves something open, as of a gyro's clock that was found behind its stamps.
void NameEffects(const Calibration& begin, const Calibration& fit, std::vector<std::string>* names);

// 1 / sigma^2 of the priors: state, effects of the model (may be null), candidates.
Eigen::VectorXd PriorInformation(const Prior& prior, const EffectSet* model,
                                 const EffectSet& candidates);

// Pairs of effects, one of them in the model, that this motion cannot tell apart. scores_of:
// makes the scores of a calibration with candidates.
std::vector<std::vector<std::string>> Indistinguishable(
    const Calibration& fit, const EffectSetup& setup, const Prior& prior,
    const std::function<Scores(const Calibration&, std::shared_ptr<const EffectSet>)>& scores_of);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_CANDIDATES_H_
