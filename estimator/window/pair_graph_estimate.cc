// What a PairGraph says at its present state: residuals, the estimate, its covariance.
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/parallel.h"
#include "estimator/window/direction_search.h"
#include "estimator/window/pair_blocks.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_view.h"
#include "factors/robust.h"

namespace camgyro {

std::vector<double> PairGraph::Residuals(int64_t id, bool search, double least_gain,
                                         PairBearings* bearings) {
  const Pair& pair = pairs_.at(id);
  const PairMeasurement& m = *pair.measurement;
  std::vector<double> residuals =
      residual().Independent(pair.measurement, ParametersOf(id, pair), bearings);
  if (!search || !residual().facts().has_direction || residuals.empty()) return residuals;
  double cost = 0.0;
  for (const double r : residuals) {
    const double robust = Robustify(r, m.robust_threshold).value;
    cost += robust * robust;
  }
  DirectionEstimate found =
      FindDirection(*bearings, m.variance_a(), m.variance_b(), m.robust_threshold);
  cost += CostOfPointsBehind(*bearings, m.variance_a(), m.variance_b(), m.robust_threshold,
                             graph_.value(DirectionBlock(id)));
  if (!(found.cost < cost - least_gain)) return residuals;
  graph_.value(DirectionBlock(id)) = found.tau;
  graph_.value(BendBlock(id)).setZero();
  return std::move(found.residuals);
}

PairView PairGraph::ViewOf(const Pair& pair, const PairBearings& bearings) const {
  PairView view;
  view.measurement = *pair.measurement;
  view.bearings = bearings;
  view.bend_sigma_rad = pair.bend_sigma_rad;
  return view;
}

std::vector<double> PairGraph::ResidualsWithLeans(int64_t id, TrackLeans* leans) {
  Pair& pair = pairs_.at(id);
  const int64_t linearisation = pair.kept ? pair.kept->number() : 0;
  if (linearisation == 0 || pair.last.linearisation != linearisation) {
    pair.last = {linearisation, Residuals(id, /*search=*/false), {}};
    const std::vector<double>& residuals = pair.last.residuals;
    if (!residuals.empty() && residual().facts().has_direction) {
      const PairView view = ViewOf(pair, bearings_);
      const PairPlane plane{graph_.value(DirectionBlock(id)), graph_.value(BendBlock(id))};
      for (size_t i = 0; i < residuals.size(); ++i) {
        pair.last.leans.Add(view.measurement.matches[i].track_id, residuals[i],
                            CorrectionOf(view, plane, i));
      }
    }
  }
  leans->Add(pair.last.leans);
  return pair.last.residuals;
}

CrossFit PairGraph::CrossFitOf(int64_t id, PairBearings* bearings) {
  CrossFit fit;
  if (!residual().facts().has_direction) return fit;
  const std::vector<double> own =
      Residuals(id, /*search=*/false, 0.0, bearings);  // fills the bearings, too
  if (own.size() < 2 * kMinMatches) return fit;
  // One in 2000 Gaussian errors is beyond; wrong matches, which the loss bounds, are [sigmas].
  constexpr double kNeighboursWithin = 3.5;
  const Pair& pair = pairs_.at(id);
  const PairView view = ViewOf(pair, *bearings);
  const auto bounded_sq = [&](double r) {
    return std::pow(Robustify(r, options_.robust_threshold).value, 2);
  };
  for (const double r : own) fit.own += bounded_sq(r);
  fit.neighbours.Add(pair.measurement->matches, own, kNeighboursWithin, pair.measurement->size_px);
  const auto n = static_cast<double>(own.size());
  const PairPlane whole{graph_.value(DirectionBlock(id)), graph_.value(BendBlock(id))};
  fit.own *= n / (n - DegreesOfFreedom(view, whole));
  fit.expected = fit.own;
  for (const size_t half : {0, 1}) {
    const PairPlane plane = FitPlane(view, half, 2);
    fit.expected += fit.own / n * DegreesOfFreedom(view, plane, half, 2);
    for (size_t i = 1 - half; i < own.size(); i += 2) {
      fit.unseen += bounded_sq(ValueOf(view, plane, i));
    }
  }
  return fit;
}

void PairGraph::ForAllPairs(const std::function<void(size_t, int64_t, PairBearings*)>& body) {
  constexpr size_t kTogether = 16;  // with the same bearings, which are large to allocate
  const std::vector<int64_t> ids = pair_ids();
  ParallelFor((ids.size() + kTogether - 1) / kTogether, [&](size_t part) {
    PairBearings bearings;
    const size_t end = std::min(ids.size(), (part + 1) * kTogether);
    for (size_t i = part * kTogether; i < end; ++i) body(i, ids[i], &bearings);
  });
}

std::vector<std::vector<double>> PairGraph::AllResiduals(bool search, double least_gain) {
  std::vector<std::vector<double>> residuals(pairs_.size());
  ForAllPairs([&](size_t i, int64_t id, PairBearings* bearings) {
    residuals[i] = Residuals(id, search, least_gain, bearings);
  });
  return residuals;
}

CrossFit PairGraph::CrossFitOfAll() {
  std::vector<CrossFit> of_pairs(pairs_.size());
  ForAllPairs([&](size_t i, int64_t id, PairBearings* bearings) {
    of_pairs[i] = CrossFitOf(id, bearings);
  });
  CrossFit sum;
  for (const CrossFit& of_pair : of_pairs) sum += of_pair;
  return sum;
}

Calibration PairGraph::Estimate() const {
  Calibration c = prior_mean_;
  c.lens = graph_.value(kLensBlock);
  c.delay_s = graph_.value(kShutterBlock)[kDelay];
  c.readout_s = graph_.value(kShutterBlock)[kReadout];
  c.q_gyro_cam = Eigen::Quaterniond(Eigen::Vector4d(graph_.value(kRotationBlock))).normalized();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const auto& [id, block] : graph_.blocks()) {
    if (id.kind != BlockKind::kBias) continue;
    sum += Eigen::Vector3d(block.value);
    ++count;
  }
  c.bias_gyro_rad_s = count > 0 ? Eigen::Vector3d(sum / count) : rates_.start_bias();
  if (effects_ != nullptr) c.effect_values = graph_.value(kEffectsBlock);
  return c;
}

PairLatents PairGraph::Latents() const {
  PairLatents latents;
  latents.rates = rates_.Found(graph_);
  for (const auto& [id, pair] : pairs_) {
    if (residual().facts().has_direction) {
      const PairPlane plane{graph_.value(DirectionBlock(id)), graph_.value(BendBlock(id))};
      const std::vector<double>& times_s = pair.measurement->rate_times_s;
      const double time_s = times_s[times_s.size() / 2];
      latents.planes[id] = {plane.TurnedBy(ReferenceFrom(pair, time_s).transpose()), time_s};
    }
  }
  latents.frame_times_s = OwnTimes();
  return latents;
}

std::optional<Eigen::Vector2d> PairLatents::TimesOf(const TimedPair& pair) const {
  const auto a = frame_times_s.find(PairGraph::FrameNumber(pair.time_a_s));
  const auto b = frame_times_s.find(PairGraph::FrameNumber(pair.time_b_s));
  if (a == frame_times_s.end() || b == frame_times_s.end()) return std::nullopt;
  return Eigen::Vector2d(a->second, b->second);
}

std::map<int64_t, double> PairGraph::OwnTimes() const {
  std::map<int64_t, double> times_s;
  for (const auto& entry : pairs_) {
    for (const int64_t frame : entry.second.frame_times) {
      times_s[frame] = graph_.value(FrameTimeBlock(frame))[0];
    }
  }
  return times_s;
}

Eigen::VectorXd PairGraph::DelayByEffects(const FrameTime& frame) const {
  const Eigen::Vector2d size_px(prior_mean_.width_px, prior_mean_.height_px);
  EffectSet::Change change;
  effects_->ChangeObservation({Eigen::Vector2d::Zero(), size_px, frame}, &change);
  return change.time.row(0);
}

Result<std::vector<FactorGraph::Functional>> PairGraph::StateFunctionals(
    const std::optional<FrameTime>& at) const {
  const int num_effects = effects_ != nullptr ? effects_->size() : 0;
  std::vector<FactorGraph::Functional> functionals(static_cast<size_t>(kStateSize + num_effects));
  functionals[kStateFocal] = {{kLensBlock, 0}};
  functionals[kStateCx] = {{kLensBlock, 1}};
  functionals[kStateCy] = {{kLensBlock, 2}};
  functionals[kStateReadout] = {{kShutterBlock, kReadout}};
  functionals[kStateDelay] = {{kShutterBlock, kDelay}};
  if (at && num_effects > 0) {
    const Eigen::VectorXd by_effects = DelayByEffects(*at);
    for (int i = 0; i < num_effects; ++i) {
      functionals[kStateDelay].push_back({kEffectsBlock, i, by_effects[i]});
    }
  }
  std::vector<BlockId> biases;
  for (const auto& [id, block] : graph_.blocks()) {
    if (id.kind == BlockKind::kBias) biases.push_back(id);
  }
  if (biases.empty()) return CannotEstimate("there is no pair of frames to estimate from");
  for (int k = 0; k < 3; ++k) {
    for (const BlockId& id : biases) {
      functionals[kStateBias + k].push_back({id, k, 1.0 / static_cast<double>(biases.size())});
    }
    functionals[kStateRotation + k] = {{kRotationBlock, k}};
  }
  for (int i = 0; i < num_effects; ++i) {
    functionals[static_cast<size_t>(kStateSize + i)] = {{kEffectsBlock, i}};
  }
  return functionals;
}

Result<Eigen::MatrixXd> PairGraph::NoiseCovariance() const {
  const auto functionals = StateFunctionals();
  if (!functionals) return tl::unexpected(functionals.error());
  Result<FactorGraph::CovarianceReport> found = graph_.Covariance(*functionals);
  if (!found) return tl::unexpected(found.error());
  return std::move(found->covariance);
}

Status PairGraph::EstimateCovariance(double cluster_s, double inflation, Calibration* calibration,
                                     const std::optional<FrameTime>& at) const {
  const auto functionals = StateFunctionals(at);
  if (!functionals) return tl::unexpected(functionals.error());
  const auto size = static_cast<Eigen::Index>(functionals->size());
  const Eigen::Index num_effects = size - kStateSize;
  const Result<FactorGraph::CovarianceReport> found = graph_.Covariance(*functionals);
  if (!found) return tl::unexpected(found.error());
  const FactorGraph::CovarianceReport& report = *found;

  // Clustered covariance: the sum over stretches of time of each stretch's influence.
  std::map<int64_t, Eigen::VectorXd> clusters;
  const auto add = [&](FactorGraph::FactorKey key, double time_s) {
    const auto cluster = static_cast<int64_t>(std::floor(time_s / cluster_s));
    auto [it, fresh] = clusters.try_emplace(cluster, Eigen::VectorXd::Zero(size));
    it->second += report.influence.at(key);
  };
  for (const auto& entry : pairs_) add(entry.second.factor, entry.second.time_s);
  for (const auto& [frame, prior] : frame_time_priors_)
    add(prior, 1e-9 * static_cast<double>(frame));
  for (const auto& entry : rates_.groups()) {
    add(entry.second.factor, rates_.StartOf(entry.second) - calibration->delay_s);
  }
  const auto count = static_cast<double>(clusters.size());
  Eigen::MatrixXd covariance = inflation * report.covariance;
  covariance(kStateDelay, kStateDelay) += shared_frame_time_s2_;
  if (clusters.size() >= 8) {
    Eigen::VectorXd variance = Eigen::VectorXd::Zero(size);
    for (const auto& entry : clusters) variance += entry.second.cwiseAbs2();
    variance *= count / (count - 1.0);
    const Eigen::VectorXd wider =
        (variance.cwiseQuotient(covariance.diagonal())).cwiseMax(1.0).cwiseSqrt();
    covariance = wider.asDiagonal() * covariance * wider.asDiagonal();
  }
  calibration->covariance = covariance.topLeftCorner<kStateSize, kStateSize>();
  calibration->effect_covariance = covariance.bottomRightCorner(num_effects, num_effects);
  if (has_frame_times()) {
    const int column = effects_->frame_time_spread();
    calibration->effect_covariance(column, column) =
        frame_time_spread_sigma_s_ * frame_time_spread_sigma_s_;
  }
  return {};
}

}  // namespace camgyro
