#include "estimator/window/refinement.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/robust_statistics.h"
#include "estimator/window/direction_search.h"
#include "factors/coplanarity_plane.h"
#include "factors/robust.h"

namespace camgyro {
Result<Refined> Refine(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                       const Calibration& start, const Calibration& prior_mean,
                       const RefinementOptions& options) {
  Refined result;
  result.calibration = start;
  PairGraphOptions graph_options = options.graph;
  const bool rotations = !pairs.empty() && pairs.front().matches.empty();
  const int lost = rotations ? 0 : 2;
  std::unique_ptr<PairGraph> graph;
  std::vector<int64_t> ids;
  const auto all_residuals = [&](bool search) {
    std::vector<std::vector<double>> residuals;
    for (const int64_t id : ids) residuals.push_back(graph->Residuals(id, search));
    return residuals;
  };
  double scale = rotations ? options.sigma_rad : graph_options.sigma_px;
  const auto set_scale = [&](double relative) {
    scale *= std::max(1e-3, relative);
    for (const int64_t id : ids) graph->SetSigma(id, scale);
  };
  double built_at_delay_s = 0.0, last_cost = 0.0;
  for (result.rounds = 1; result.rounds <= options.max_rounds; ++result.rounds) {
    const Calibration before = result.calibration;
    // Rates are kept around the pairs as the delay was when they were added.
    const bool build = graph == nullptr || std::abs(before.delay_s - built_at_delay_s) >
                                               0.5 * graph_options.rate_margin_s;
    if (build) {
      graph_options.sigma_px = scale;
      built_at_delay_s = before.delay_s;
      Calibration from = before;
      from.prior_sigma = start.prior_sigma;
      graph = std::make_unique<PairGraph>(from, prior_mean, graph_options);
      for (const TimedRate& rate : input.rates) graph->AddRate(rate);
      result.skipped_pairs = 0;
      for (const TimedPair& pair : pairs) {
        const AddPairResult added =
            rotations ? graph->AddRotation(pair.id, pair.time_a_s, pair.time_b_s,
                                           pair.rotation.q_a_b, scale)
                      : graph->AddPair(pair.id, pair.time_a_s, pair.time_b_s, pair.matches);
        if (added != AddPairResult::kAdded) ++result.skipped_pairs;
      }
      if (graph->num_pairs() < 10) {
        return CannotEstimate("only " + std::to_string(graph->num_pairs()) +
                              " pairs of frames can be used (at least 10 are needed): the others "
                              "lack matches or gyro samples");
      }
      ids = graph->pair_ids();
    }
    if (result.rounds == 1) {
      // The scale at the start, misfit included, so that a poor start is not cut off by the loss;
      // directions depend on it.
      set_scale(RobustScale(all_residuals(false), lost));
      if (!rotations) set_scale(RobustScale(all_residuals(true), lost));
    }
    // Every round searches the directions anew: with the calibration of the round before, another
    // minimum may be the right one (little parallax has several).
    if (!rotations && result.rounds > 1) all_residuals(/*search=*/true);
    const SolveReport report = graph->Solve({15, 1e-5});
    if (!report.usable) return CannotEstimate("the solver failed: " + report.message);

    const auto residuals = all_residuals(/*search=*/false);
    const double relative_scale = RobustScale(residuals, lost);
    result.calibration = graph->Estimate();
    const StateVector moved = Difference(result.calibration, before);
    const bool last = result.rounds == options.max_rounds;
    if (std::abs(relative_scale - 1.0) > 0.03 && !last) {
      set_scale(relative_scale);
      continue;
    }
    // Where the next round would start from is not worth a covariance; the end is.
    const bool costs_settled = std::abs(report.final_cost - last_cost) < 2e-4 * report.final_cost;
    last_cost = report.final_cost;
    if (!costs_settled && !last) continue;
    if (!graph->EstimateCovariance(options.cluster_s, &result.calibration)) {
      return CannotEstimate("the information matrix is singular");
    }
    FitQuality& q = result.quality;
    q = FitQuality();
    q.pairs = graph->num_pairs();
    q.noise_px = scale;
    double sum_sq = 0.0;
    int inliers = 0;
    for (const auto& pair : residuals) {
      for (const double r : pair) {
        const double bounded = Robustify(r, graph_options.robust_threshold).value;
        sum_sq += bounded * bounded;
        inliers += std::abs(r) <= graph_options.robust_threshold ? 1 : 0;
        ++q.matches;
      }
    }
    q.rms_px = scale * std::sqrt(sum_sq / std::max(1, q.matches));
    q.inlier_ratio = static_cast<double>(inliers) / std::max(1, q.matches);
    result.converged = (moved.cwiseAbs().array() < 0.3 * result.calibration.sigma().array()).all();
    if (result.converged) break;
  }
  return result;
}

UnseenFit EvaluateUnseen(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                         const Calibration& calibration, double noise_px,
                         const PairGraphOptions& options) {
  UnseenFit fit;
  double sum_sq = 0.0;
  const Lens& lens = GetLens(calibration.distortion_model);
  const ShutterParameters shutter(calibration.delay_s, calibration.readout_s);
  const Eigen::Matrix3d R_gyro_cam = calibration.q_gyro_cam.toRotationMatrix();
  const double variance_b = noise_px * noise_px;
  const double variance_a = options.match_noise == MatchNoise::kBothImages ? variance_b : 0.0;
  for (const TimedPair& pair : pairs) {
    const double from = pair.time_a_s + calibration.delay_s + std::min(0.0, calibration.readout_s);
    const double to = pair.time_b_s + calibration.delay_s + std::max(0.0, calibration.readout_s);
    const auto by_time = [](const TimedRate& rate, double t) { return rate.time_s < t; };
    auto first = std::lower_bound(input.rates.begin(), input.rates.end(), from, by_time);
    auto last = std::lower_bound(input.rates.begin(), input.rates.end(), to, by_time);
    if (first == input.rates.begin() || last == input.rates.end()) continue;
    --first;
    ++last;
    std::vector<double> times;
    Eigen::Matrix3Xd rates(3, last - first);
    for (auto it = first; it != last; ++it) {
      rates.col(it - first) = it->omega_gyro_rad_s - calibration.bias_gyro_rad_s;
      times.push_back(it->time_s);
    }
    const RotationChain chain(times, rates);
    std::array<PairBearings, 2> halves;  // for the direction, and for the residuals
    for (size_t i = 0; i < pair.matches.size(); ++i) {
      Bearing a, b;
      if (EvaluateBearing(lens, calibration.lens, shutter, R_gyro_cam, chain, pair.time_a_s,
                          calibration.height_px, pair.matches[i].px_a, &a, false) &&
          EvaluateBearing(lens, calibration.lens, shutter, R_gyro_cam, chain, pair.time_b_s,
                          calibration.height_px, pair.matches[i].px_b, &b, false)) {
        halves[i % 2].a.push_back(a);
        halves[i % 2].b.push_back(b);
      }
    }
    if (halves[0].a.size() < PairGraph::kMinMatches / 2) continue;
    ++fit.pairs;
    const Eigen::Vector3d tau =
        FindDirection(halves[0], variance_a, variance_b, options.robust_threshold).tau;
    for (size_t i = 0; i < halves[1].a.size(); ++i) {
      const Bearing &a = halves[1].a[i], &b = halves[1].b[i];
      const double r = EvaluatePlaneResidual(a.ray_ref, a.J_ray_px, b.ray_ref, b.J_ray_px, tau,
                                             variance_a, variance_b)
                           .value;
      const double bounded = Robustify(r, options.robust_threshold).value;
      sum_sq += bounded * bounded;
      ++fit.matches;
    }
  }
  fit.rms_px = noise_px * std::sqrt(sum_sq / std::max(1, fit.matches));
  return fit;
}

}  // namespace camgyro
