// The search of the frames' own times in a PairGraph.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "estimator/window/local_equations.h"
#include "estimator/window/pair_blocks.h"
#include "estimator/window/pair_graph.h"
#include "factors/robust.h"

namespace camgyro {
namespace {

// Of a pair that has lost its rays, which no choice is made for.
constexpr double kNoResiduals = 1e12;

// What a pair costs for either time of its first and of its second frame.
struct PairCosts {
  std::array<std::array<double, 2>, 2> of{};
  bool follows = false;  // its first frame is the second one of the pair before
};

// Which of the two times each pair's frames take so that all cost least together; the first where
// both cost the same. (Dynamic programming along the chain.)
std::vector<std::array<size_t, 2>> LeastOfChain(const std::vector<PairCosts>& pairs) {
  using Two = std::array<double, 2>;
  const auto least = [](const Two& costs) { return static_cast<size_t>(costs[1] < costs[0]); };
  std::vector<Two> sums(pairs.size());                     // up to each pair, by its second frame
  std::vector<std::array<size_t, 2>> first(pairs.size());  // the best of its first frame, likewise
  for (size_t i = 0; i < pairs.size(); ++i) {
    Two before{};
    if (pairs[i].follows) before = sums[i - 1];
    for (size_t b = 0; b < 2; ++b) {
      const Two ways = {before[0] + pairs[i].of[0].at(b), before[1] + pairs[i].of[1].at(b)};
      first[i].at(b) = least(ways);
      sums[i].at(b) = ways.at(first[i].at(b));
    }
  }
  std::vector<std::array<size_t, 2>> chosen(pairs.size());
  for (size_t i = pairs.size(); i-- > 0;) {
    const bool followed = i + 1 < pairs.size() && pairs[i + 1].follows;
    const size_t second = followed ? chosen[i + 1][0] : least(sums[i]);
    chosen[i] = {first[i].at(second), second};
  }
  return chosen;
}

}  // namespace

double PairGraph::CostOfTimes(int64_t id, const Pair& pair,
                              const std::vector<double>& residuals) const {
  double cost = 0.0;
  for (const double r : residuals) {
    cost += std::pow(Robustify(r, pair.measurement->robust_threshold).value, 2);
  }
  cost += graph_.value(BendBlock(id)).cwiseQuotient(pair.bend_sigma_rad).squaredNorm();
  for (const int64_t frame : pair.frame_times) {
    cost += PriorCost(graph_.value(FrameTimeBlock(frame))[0], *frame_time_spread_s_);
  }
  return cost;
}

void PairGraph::DescendWithoutLoss(int64_t id, Pair* pair, PairBearings* bearings) {
  // Noise that is taken for so many times larger makes matches right that are 28 px off at 0.5 px:
  // 20 ms of a turn by 2 rad/s.
  constexpr double kWidest = 16.0;
  constexpr int kSteps = 2;  // at each width
  const double sigma = pair->measurement->sigma;
  LocalEquations equations;
  for (const int64_t frame : pair->frame_times) {
    equations.AddBlock(FrameTimeBlock(frame), graph_.block(FrameTimeBlock(frame)));
  }
  for (const BlockId& block : {DirectionBlock(id), BendBlock(id)}) {
    equations.AddBlock(block, graph_.block(block));
  }
  for (double width = kWidest; width >= 1.0; width *= 0.5) {
    SetSigma(id, width * sigma);
    // The direction, of these times.
    if (width == kWidest) Residuals(id, /*search=*/true, 0.0, bearings);
    for (int step = 0; step < kSteps; ++step) {
      equations.Begin();
      equations.AddAfresh(graph_, graph_.factors().at(pair->factor));
      equations.Add(graph_, graph_.factors().at(pair->bend_prior));
      for (const int64_t frame : pair->frame_times) {
        const double offset_s = graph_.value(FrameTimeBlock(frame))[0];
        const double information =
            std::pow(width * PriorSpread(offset_s, *frame_time_spread_s_), -2);
        equations.AddTo(FrameTimeBlock(frame), information, information * offset_s);
      }
      equations.Step(&graph_);
    }
  }
  SetSigma(id, sigma);
}

double PairGraph::RightShare(int64_t id, PairBearings* bearings) {
  const std::vector<double> residuals = Residuals(id, /*search=*/false, 0.0, bearings);
  const auto right = std::count_if(residuals.begin(), residuals.end(), [&](double r) {
    return std::abs(r) <= options_.inlier_sigmas();
  });
  return residuals.empty() ? 0.0
                           : static_cast<double>(right) / static_cast<double>(residuals.size());
}

bool PairGraph::SearchFrameTimesOf(int64_t id, const std::vector<int64_t>& touched,
                                   double right_share) {
  // [sigmas^2] A solve ends within less of the minimum.
  constexpr double kBetter = 1.0;
  // Where descents begin, in spreads from where the times are now.
  constexpr std::array<double, 3> kStarts = {0.0, -2.5, 2.5};
  const double spread_s = std::max(*frame_time_spread_s_, kSearchedSpreadS);
  PairBearings bearings;
  if (RightShare(id, &bearings) >= right_share) return true;
  Pair& pair = pairs_.at(id);
  std::vector<BlockId> own = {FrameTimeBlock(pair.frame_times[0]),
                              FrameTimeBlock(pair.frame_times[1])};
  for (const int64_t one : touched) {
    own.push_back(DirectionBlock(one));
    own.push_back(BendBlock(one));
  }
  const auto cost = [&] {
    double sum = 0.0;
    for (const int64_t one : touched) {
      const std::vector<double> now = Residuals(one, /*search=*/true, 0.0, &bearings);
      if (now.empty()) return std::numeric_limits<double>::infinity();
      sum += CostOfTimes(one, pairs_.at(one), now);
    }
    return sum;
  };
  const auto values = [&] {
    std::vector<Eigen::VectorXd> all;
    for (const BlockId& block : own) all.emplace_back(graph_.value(block));
    return all;
  };
  const auto set = [&](const std::vector<Eigen::VectorXd>& all) {
    for (size_t i = 0; i < own.size(); ++i) graph_.value(own[i]) = all[i];
  };
  double least = cost() - kBetter;
  const std::vector<Eigen::VectorXd> before = values();
  std::vector<Eigen::VectorXd> best = before;
  bool right = false, found = false;
  for (size_t k = 0; k < kStarts.size() * kStarts.size() && !right; ++k) {
    set(before);
    graph_.value(own[0])[0] += kStarts.at(k % kStarts.size()) * spread_s;
    graph_.value(own[1])[0] += kStarts.at(k / kStarts.size()) * spread_s;
    DescendWithoutLoss(id, &pair, &bearings);
    const double here = cost();
    if (!(here < least)) continue;
    least = here;
    best = values();
    found = true;
    right = RightShare(id, &bearings) >= right_share;
  }
  set(best);
  return found;
}

void PairGraph::TakeTimesOfPairsAlone(const std::vector<double>& shares, double right_share,
                                      const TimesAlone& alone) {
  std::vector<std::optional<PairTimes>> found(pairs_.size());
  ForAllPairs([&](size_t i, int64_t id, PairBearings*) {
    if (shares[i] >= right_share) {
      found[i] = FrameTimesOf(pairs_.at(id));
    } else {
      PairTimes times;
      if (alone(id, &times)) found[i] = times;
    }
  });
  std::vector<PairTimes> all;
  for (const auto& times : found) {
    if (times) all.push_back(*times);
  }
  struct Choice {
    std::array<double, 2> times_s;  // as it was; the likely one
    bool odd = false;               // along its chain
  };
  std::map<int64_t, Choice> frames;
  for (const auto& [id, pair] : pairs_) {
    for (const int64_t frame : pair.frame_times) {
      const double now_s = graph_.value(FrameTimeBlock(frame))[0];
      frames.emplace(frame, Choice{{now_s, now_s}, false});
    }
    frames.at(pair.frame_times[1]).odd = !frames.at(pair.frame_times[0]).odd;
  }
  // Which frames are late is chosen with all of them.
  const FrameTimeLaw law = MostLikelyLaw(all);
  for (const FrameOffset& frame : OffsetsOf(all, *frame_time_spread_s_, law.late)) {
    frames.at(frame.frame).times_s[1] = frame.offset_s;
  }

  // Every pair with either time of both of its frames.
  struct Fitted {
    Eigen::VectorXd direction, bend;
  };
  std::vector<std::array<std::array<Fitted, 2>, 2>> fitted(pairs_.size());
  std::vector<PairCosts> costs(pairs_.size());
  for (const auto& [even, odd] : {std::pair<size_t, size_t>(0, 0), {1, 1}, {0, 1}, {1, 0}}) {
    for (const auto& [number, frame] : frames) {
      graph_.value(FrameTimeBlock(number))[0] = frame.times_s.at(frame.odd ? odd : even);
    }
    const std::vector<std::vector<double>> residuals = AllResiduals(/*search=*/true);
    size_t i = 0;
    for (const auto& [id, pair] : pairs_) {
      const bool first_odd = frames.at(pair.frame_times[0]).odd;
      const size_t a = first_odd ? odd : even, b = first_odd ? even : odd;
      fitted[i].at(a).at(b) = {graph_.value(DirectionBlock(id)), graph_.value(BendBlock(id))};
      costs[i].of.at(a).at(b) =
          residuals[i].empty() ? kNoResiduals : CostOfTimes(id, pair, residuals[i]);
      ++i;
    }
  }
  size_t i = 0;
  int64_t last = 0;
  for (const auto& [id, pair] : pairs_) {
    costs[i].follows = i > 0 && pair.frame_times[0] == last;
    last = pair.frame_times[1];
    ++i;
  }
  const std::vector<std::array<size_t, 2>> chosen = LeastOfChain(costs);
  i = 0;
  for (const auto& [id, pair] : pairs_) {
    const Fitted& own = fitted[i].at(chosen[i][0]).at(chosen[i][1]);
    graph_.value(DirectionBlock(id)) = own.direction;
    graph_.value(BendBlock(id)) = own.bend;
    for (size_t k = 0; k < 2; ++k) {
      const int64_t frame = pair.frame_times[k];
      graph_.value(FrameTimeBlock(frame))[0] = frames.at(frame).times_s.at(chosen[i].at(k));
    }
    ++i;
  }
}

void PairGraph::SearchFrameTimes(const TimesAlone& alone) {
  // Of the share that pairs usually have: where so many matches are right, the times are as well.
  constexpr double kSurelyRight = 0.93;
  // Of the share when a search was in vain: it would be again. Both save time only.
  constexpr double kHardlyWorse = 0.9;
  if (!has_frame_times() || !residual().facts().has_direction) return;
  std::vector<double> shares(pairs_.size());
  const auto find_shares = [&] {
    ForAllPairs([&](size_t i, int64_t id, PairBearings* bearings) {
      shares[i] = RightShare(id, bearings);
    });
  };
  find_shares();
  std::vector<double> sorted = shares;
  const double right_share = kSurelyRight * MedianInPlace(&sorted);
  if (alone && *std::min_element(shares.begin(), shares.end()) < right_share) {
    TakeTimesOfPairsAlone(shares, right_share, alone);
    find_shares();
  }

  std::map<int64_t, std::vector<int64_t>> pairs_of_frames;
  for (const auto& [id, pair] : pairs_) {
    for (const int64_t frame : pair.frame_times) pairs_of_frames[frame].push_back(id);
  }
  // Searches that know a frame in common follow each other; others go beside each other.
  struct Search {
    int64_t id = 0;
    double share = 0.0;
    std::vector<int64_t> touched;  // pairs with a frame of this one
    bool found = false;
  };
  std::vector<std::vector<Search>> turns;
  std::map<int64_t, size_t> next_turn;  // of frames
  size_t i = 0;
  for (const auto& [id, pair] : pairs_) {
    const double share = shares[i++];
    const auto in_vain = searched_in_vain_.find(id);
    if (share >= right_share ||
        (in_vain != searched_in_vain_.end() && share >= kHardlyWorse * in_vain->second)) {
      continue;
    }
    std::set<int64_t> touched, known;
    for (const int64_t frame : pair.frame_times) {
      touched.insert(pairs_of_frames[frame].begin(), pairs_of_frames[frame].end());
    }
    for (const int64_t other : touched) {
      const std::vector<int64_t>& frames = pairs_.at(other).frame_times;
      known.insert(frames.begin(), frames.end());
    }
    size_t turn = 0;
    for (const int64_t frame : known) turn = std::max(turn, next_turn[frame]);
    for (const int64_t frame : known) next_turn[frame] = turn + 1;
    if (turn == turns.size()) turns.emplace_back();
    turns[turn].push_back({id, share, {touched.begin(), touched.end()}});
  }
  for (std::vector<Search>& turn : turns) {
    ParallelFor(turn.size(), [&](size_t k) {
      turn[k].found = SearchFrameTimesOf(turn[k].id, turn[k].touched, right_share);
    });
    for (const Search& search : turn) {
      if (!search.found) searched_in_vain_[search.id] = search.share;
    }
  }
  // What was found has moved frames: which of them are late is asked of all of them anew.
  SetLateFrames(MostLikelyLaw(FrameTimes()).late);
}

}  // namespace camgyro
