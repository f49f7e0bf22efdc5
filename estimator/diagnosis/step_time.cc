#include "estimator/diagnosis/step_time.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "core/effects/catalogue.h"
#include "estimator/diagnosis/pair_scores.h"

namespace camgyro {
namespace {

// The calibration with another shape of its effect number `at`.
Calibration WithShape(const EffectSetup& setup, Calibration calibration, size_t at,
                      const std::string& shape) {
  auto set = std::make_shared<EffectSet>();
  const auto& items = calibration.effects->items();
  for (size_t i = 0; i < items.size(); ++i) {
    const auto& item = items[i];
    if (i == at) {
      set->Add(item.entry, shape, item.entry->make(setup, shape));
    } else {
      set->Add(item.entry, item.shape, item.effect);
    }
  }
  calibration.effects = set;
  return calibration;
}

// Rounded down: after the last frame there is no step, and no effect could be made of it.
std::string ShapeAt(double time_s) {
  char shape[40];
  std::snprintf(shape, sizeof shape, "%.4f", std::floor(1e4 * time_s) * 1e-4);
  return shape;
}

// Of a pair: chi2 with the step after it, between its frames, and before it.
struct PairCosts {
  double time_a_s, time_b_s;
  double after, between, before;

  double At(double step_s) const {
    return step_s > time_b_s ? after : step_s > time_a_s ? between : before;
  }
};

}  // namespace

bool PlaceDelaySteps(const Recording& recording, const EstimationInput& input,
                     const std::vector<TimedPair>& pairs, double reach_s, double noise,
                     const PairGraphOptions& options, Calibration* calibration) {
  if (calibration->effects == nullptr) return false;
  const EffectSetup setup = MakeEffectSetup(recording, *calibration);
  bool moved = false;
  for (size_t k = 0; k < calibration->effects->items().size(); ++k) {
    const auto& item = calibration->effects->items()[k];
    if (item.entry->name != "delay_step") continue;
    const double now_s = std::strtod(item.shape.c_str(), nullptr);
    std::vector<double> times_s;  // between two frames each
    for (size_t i = 1; i < setup.frames.size(); ++i) {
      const double time_s = 0.5 * (setup.frames[i - 1].stamp_s + setup.frames[i].stamp_s);
      if (std::abs(time_s - now_s) <= reach_s) times_s.push_back(time_s);
    }
    if (times_s.empty()) continue;
    const auto chi2 = [&](const TimedPair& pair, double step_s) {
      const Calibration with = WithShape(setup, *calibration, k, ShapeAt(step_s));
      const Scores scores = ComputeScores(input, {{pair}}, with, nullptr, noise, options);
      return scores.pairs.empty() ? 0.0 : scores.pairs.front().chi2;
    };
    const double first_s = setup.frames.front().stamp_s + 1e-3,
                 last_s = setup.frames.back().stamp_s;
    std::vector<PairCosts> costs;
    for (const TimedPair& pair : pairs) {
      if (pair.time_b_s < times_s.front() || pair.time_a_s > times_s.back()) continue;
      costs.push_back({pair.time_a_s, pair.time_b_s, chi2(pair, last_s),
                       chi2(pair, 0.5 * (pair.time_a_s + pair.time_b_s)), chi2(pair, first_s)});
    }
    double least = 0.0;
    size_t first = 0, last = 0;  // of the least
    for (size_t i = 0; i < times_s.size(); ++i) {
      double sum = 0.0;
      for (const PairCosts& pair : costs) sum += pair.At(times_s[i]);
      if (i == 0 || sum < least) {
        least = sum;
        first = last = i;
      } else if (sum == least && last + 1 == i) {
        last = i;
      }
    }
    const std::string shape = ShapeAt(times_s[(first + last) / 2]);
    if (shape == item.shape) continue;
    *calibration = WithShape(setup, std::move(*calibration), k, shape);
    moved = true;
  }
  return moved;
}

}  // namespace camgyro
