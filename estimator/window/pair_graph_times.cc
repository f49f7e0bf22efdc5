// The frames' own times in a PairGraph.
#include <glog/logging.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linear_algebra.h"
#include "estimator/window/local_equations.h"
#include "estimator/window/pair_blocks.h"
#include "estimator/window/pair_graph.h"
#include "factors/frame_time_prior.h"

namespace camgyro {

int64_t PairGraph::FrameNumber(double stamp_s) { return std::llround(1e9 * stamp_s); }

double PairGraph::RateMargin() const {
  // A time of its own is rarely off by more: of exponential latencies, one in a thousand.
  constexpr double kSpreads = 6.0;
  if (!has_frame_times()) return options_.rate_margin_s;
  return options_.rate_margin_s +
         std::max(kSpreads * *frame_time_spread_s_, options_.late_margin_s);
}

void PairGraph::AddFrameTimes(const TimedPair& timed, Pair* pair) {
  if (!has_frame_times()) return;
  for (const double stamp_s : {timed.time_a_s, timed.time_b_s}) {
    const int64_t number = FrameNumber(stamp_s);
    if (!graph_.Has(FrameTimeBlock(number))) {
      double own_time_s = 0.0;
      if (start_ != nullptr) {
        const auto known = start_->frame_times_s.find(number);
        if (known != start_->frame_times_s.end()) own_time_s = known->second;
      }
      graph_.AddBlock(FrameTimeBlock(number),
                      {Geometry::kEuclidean, Eigen::VectorXd::Constant(1, own_time_s), {}});
      const bool late = IsLate(own_time_s, *frame_time_spread_s_);
      if (late) late_frames_.insert(number);
      frame_time_priors_[number] = graph_.AddFactor(
          std::make_shared<FrameTimePrior>(late ? late_spread_s_ : frame_time_spread_s_),
          {FrameTimeBlock(number)});
    }
    pair->frame_times.push_back(number);
  }
}

PairTimes PairGraph::FrameTimesOf(const Pair& pair) const {
  const Factor& factor = graph_.factors().at(pair.factor);
  LocalEquations equations;
  for (const int64_t frame : pair.frame_times) {
    equations.AddBlock(FrameTimeBlock(frame), graph_.block(FrameTimeBlock(frame)));
  }
  for (const BlockId& id : factor.blocks) {
    if (id.kind == BlockKind::kRates || id.kind == BlockKind::kDirection ||
        id.kind == BlockKind::kBend) {
      equations.AddBlock(id, graph_.block(id));
    }
  }
  equations.Begin();
  equations.Add(graph_, factor);
  if (residual().facts().has_direction) {
    equations.Add(graph_, graph_.factors().at(pair.bend_prior));
  }
  for (const int64_t group : pair.groups) {
    equations.Add(graph_, graph_.factors().at(rates_.groups().at(group).factor));
  }
  const Eigen::Index rest = equations.g().size() - 2;
  Eigen::MatrixXd H_rest = equations.H().bottomRightCorner(rest, rest);
  H_rest.diagonal().array() += 1e-9;  // a direction that nothing determines
  const SymmetricSolver solver(H_rest);
  const Eigen::MatrixXd mixed = equations.H().bottomLeftCorner(rest, 2);
  PairTimes times;
  times.frame_a = pair.frame_times[0];
  times.frame_b = pair.frame_times[1];
  times.information = equations.H().topLeftCorner<2, 2>() - mixed.transpose() * solver.Solve(mixed);
  const double a = graph_.value(FrameTimeBlock(times.frame_a))[0];
  const double b = graph_.value(FrameTimeBlock(times.frame_b))[0];
  // The score at offsets of zero, from that where they are.
  times.score = equations.g().head<2>() -
                mixed.transpose() * solver.Solve(equations.g().tail(rest)) -
                times.information * Eigen::Vector2d(a, b);
  return times;
}

std::vector<PairTimes> PairGraph::FrameTimes(double inflation) const {
  std::vector<PairTimes> all;
  if (!has_frame_times()) return all;
  for (const auto& entry : pairs_) {
    all.push_back(FrameTimesOf(entry.second));
    all.back().score /= inflation;
    all.back().information /= inflation;
  }
  return all;
}

void PairGraph::SetLateFrames(LateFrames late) {
  for (auto& [frame, prior] : frame_time_priors_) {
    const bool is_late = late.count(frame) > 0;
    if (is_late == (late_frames_.count(frame) > 0)) continue;
    graph_.RemoveFactor(prior);
    prior = graph_.AddFactor(
        std::make_shared<FrameTimePrior>(is_late ? late_spread_s_ : frame_time_spread_s_),
        {FrameTimeBlock(frame)});
  }
  late_frames_ = std::move(late);
}

bool PairGraph::UpdateFrameTimes(double settled, std::vector<FrameOffset>* offsets) {
  if (!has_frame_times()) return true;
  constexpr double kNothingS = 1e-5;
  const std::vector<PairTimes> times = FrameTimes();
  const FrameTimeLaw law = MostLikelyLaw(times);
  const double before_s = *frame_time_spread_s_;
  *offsets = OffsetsOf(times, law);
  SetFrameTimeLaw(law);
  return std::abs(law.spread.value_s - before_s) < std::max(kNothingS, settled * before_s);
}

void PairGraph::SetFrameTimeLaw(const FrameTimeLaw& law) {
  CHECK(has_frame_times());
  const Spread& spread = law.spread;
  CHECK_GT(spread.value_s, 0.0);
  SetLateFrames(law.late);
  *frame_time_spread_s_ = spread.value_s;
  frame_time_spread_sigma_s_ = spread.sigma_s;
  graph_.value(kEffectsBlock)[effects_->frame_time_spread()] = spread.value_s;
  graph_.RemoveFactor(effects_prior_);
  AddEffectsPrior();
}

}  // namespace camgyro
