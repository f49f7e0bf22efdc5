// What a PairGraph says at its present state: residuals, the estimate, its covariance.
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "estimator/window/direction_search.h"
#include "estimator/window/pair_blocks.h"
#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_view.h"
#include "factors/coplanarity_plane.h"
#include "factors/robust.h"
#include "factors/symmetric_transfer.h"

namespace camgyro {

std::vector<double> PairGraph::Residuals(int64_t id, bool search) {
  const Pair& pair = pairs_.at(id);
  std::vector<double> residuals;
  if (pair.measurement == nullptr) {
    residuals.resize(3);
    std::vector<const double*> p = {graph_.value(kShutterBlock).data(),
                                    graph_.value(kRotationBlock).data()};
    if (num_effects_ > 0) p.push_back(EffectsNow().values);
    for (const int64_t frame : pair.frame_times) {
      p.push_back(graph_.value(FrameTimeBlock(frame)).data());
    }
    for (const int64_t group : pair.groups) p.push_back(graph_.value(RatesBlock(group)).data());
    CHECK(graph_.factors().at(pair.factor).cost->Evaluate(p.data(), residuals.data(), nullptr));
    return residuals;
  }
  const PairMeasurement& m = *pair.measurement;
  std::vector<const double*> groups;
  for (const int64_t group : pair.groups) groups.push_back(graph_.value(RatesBlock(group)).data());
  if (options_.residual == ResidualKind::kSymmetricTransfer) {
    std::vector<const double*> p = {graph_.value(kLensBlock).data(),
                                    graph_.value(kShutterBlock).data(),
                                    graph_.value(kRotationBlock).data()};
    p.insert(p.end(), groups.begin(), groups.end());
    return SymmetricTransfer(pair.measurement).IndependentResiduals(p.data());
  }
  const RotationChain chain(m.rate_times_s, GatherRates(m, groups.data()));
  if (!EvaluatePairBearings(m, chain, graph_.value(kLensBlock).data(),
                            graph_.value(kShutterBlock).data(), graph_.value(kRotationBlock).data(),
                            EffectsNow().values, false, &bearings_,
                            m.own_times ? OwnTimesOf(pair).data() : nullptr)) {
    return residuals;
  }
  if (options_.residual != ResidualKind::kPlane) {
    return FindDirection(bearings_, m.variance_a(), m.variance_b(), m.robust_threshold).residuals;
  }
  const PairPlane plane{graph_.value(DirectionBlock(id)), graph_.value(BendBlock(id))};
  double cost = 0.0;
  for (size_t i = 0; i < m.matches.size(); ++i) {
    residuals.push_back(EvaluatePlaneResidual(bearings_.a[i].ray_ref, bearings_.a[i].J_ray_px,
                                              bearings_.b[i].ray_ref, bearings_.b[i].J_ray_px,
                                              plane.DirectionOf(m, i), m.variance_a(),
                                              m.variance_b())
                            .value);
    const double robust = Robustify(residuals.back(), m.robust_threshold).value;
    cost += robust * robust;
  }
  if (search) {
    const DirectionEstimate found =
        FindDirection(bearings_, m.variance_a(), m.variance_b(), m.robust_threshold);
    cost += CostOfPointsBehind(bearings_, m.variance_a(), m.variance_b(), m.robust_threshold,
                               plane.tau);
    if (found.cost < cost) {
      graph_.value(DirectionBlock(id)) = found.tau;
      graph_.value(BendBlock(id)).setZero();
      return found.residuals;
    }
  }
  return residuals;
}

CrossFit PairGraph::CrossFitOf(int64_t id) {
  CrossFit fit;
  if (options_.residual != ResidualKind::kPlane || pairs_.at(id).measurement == nullptr) return fit;
  const std::vector<double> own = Residuals(id, /*search=*/false);  // fills the bearings, too
  if (own.size() < 2 * kMinMatches) return fit;
  const Pair& pair = pairs_.at(id);
  PairView view;
  view.measurement = *pair.measurement;
  view.bearings = bearings_;
  view.bend_sigma_rad = pair.bend_sigma_rad;
  const auto bounded_sq = [&](double r) {
    return std::pow(Robustify(r, options_.robust_threshold).value, 2);
  };
  for (const double r : own) fit.own += bounded_sq(r);
  const auto n = static_cast<double>(own.size());
  const PairPlane whole{graph_.value(DirectionBlock(id)), graph_.value(BendBlock(id))};
  fit.own *= n / (n - DegreesOfFreedom(view, whole));
  fit.expected = fit.own;
  for (const size_t half : {0, 1}) {
    const PairPlane plane = FitPlane(view, half, 2);
    fit.expected += fit.own / n * DegreesOfFreedom(view, plane, half, 2);
    for (size_t i = 1 - half; i < own.size(); i += 2) {
      fit.unseen += bounded_sq(ResidualOf(view, plane, i).value);
    }
  }
  return fit;
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
  c.bias_gyro_rad_s = count > 0 ? Eigen::Vector3d(sum / count) : start_bias_;
  if (num_effects_ > 0) c.effect_values = graph_.value(kEffectsBlock);
  return c;
}

bool PairGraph::EstimateCovariance(double cluster_s, double inflation,
                                   Calibration* calibration) const {
  const int size = kStateSize + num_effects_;
  std::vector<FactorGraph::Functional> functionals(static_cast<size_t>(size));
  functionals[kStateFocal] = {{kLensBlock, 0}};
  functionals[kStateCx] = {{kLensBlock, 1}};
  functionals[kStateCy] = {{kLensBlock, 2}};
  functionals[kStateReadout] = {{kShutterBlock, kReadout}};
  functionals[kStateDelay] = {{kShutterBlock, kDelay}};
  std::vector<BlockId> biases;
  for (const auto& [id, block] : graph_.blocks()) {
    if (id.kind == BlockKind::kBias) biases.push_back(id);
  }
  if (biases.empty()) return false;
  for (int k = 0; k < 3; ++k) {
    for (const BlockId& id : biases) {
      functionals[kStateBias + k].push_back({id, k, 1.0 / static_cast<double>(biases.size())});
    }
    functionals[kStateRotation + k] = {{kRotationBlock, k}};
  }
  for (int i = 0; i < num_effects_; ++i) {
    functionals[static_cast<size_t>(kStateSize + i)] = {{kEffectsBlock, i}};
  }
  const FactorGraph::CovarianceReport report = graph_.Covariance(functionals);
  if (!report.usable) return false;

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
  for (const auto& entry : groups_) {
    add(entry.second.factor, sample(entry.second.first_sample).time_s - calibration->delay_s);
  }
  const auto count = static_cast<double>(clusters.size());
  Eigen::MatrixXd covariance = inflation * report.covariance;
  if (clusters.size() >= 8) {
    Eigen::VectorXd variance = Eigen::VectorXd::Zero(size);
    for (const auto& entry : clusters) variance += entry.second.cwiseAbs2();
    variance *= count / (count - 1.0);
    const Eigen::VectorXd wider =
        (variance.cwiseQuotient(covariance.diagonal())).cwiseMax(1.0).cwiseSqrt();
    covariance = wider.asDiagonal() * covariance * wider.asDiagonal();
  }
  calibration->covariance = covariance.topLeftCorner<kStateSize, kStateSize>();
  calibration->effect_covariance = covariance.bottomRightCorner(num_effects_, num_effects_);
  if (has_frame_times()) {
    const int column = Effects()->frame_time_spread();
    calibration->effect_covariance(column, column) =
        frame_time_spread_sigma_s_ * frame_time_spread_sigma_s_;
  }
  return true;
}

}  // namespace camgyro
