// All matches of a pair against one plane, whose normal is an unknown of the pair.
#include <cmath>
#include <optional>

#include "estimator/window/fit_pair.h"
#include "estimator/window/pair_graph_options.h"
#include "estimator/window/pair_view.h"
#include "estimator/window/residuals/all_residuals.h"
#include "factors/coplanarity_plane.h"

namespace camgyro {
namespace {

PairResidual::Facts FactsOfPlane() {
  PairResidual::Facts facts{"plane", "plane"};
  facts.has_direction = true;
  facts.with_frame_times = true;
  facts.lost_per_pair = 4;
  return facts;
}

class Plane final : public PairResidual {
 public:
  Plane() : PairResidual(FactsOfPlane()) {}

  std::shared_ptr<const ceres::CostFunction> MakeCost(std::shared_ptr<const PairMeasurement> pair,
                                                      int64_t) const override {
    return std::make_shared<CoplanarityPlane>(std::move(pair));
  }

  std::vector<double> Independent(const std::shared_ptr<const PairMeasurement>& pair,
                                  const PairParameters& at, PairBearings* bearings) const override {
    const PairMeasurement& m = *pair;
    std::vector<double> residuals;
    const RotationChain chain(m.rate_times_s, GatherRates(m, at.rates.data()));
    if (!EvaluatePairBearings(m, chain, at.lens, at.shutter, at.q_gyro_cam, at.effects, false,
                              bearings, m.own_times ? at.own_times.data() : nullptr)) {
      return residuals;
    }
    const PairPlane plane{Eigen::Map<const Eigen::Vector3d>(at.tau),
                          Eigen::Map<const BendVector>(at.bend)};
    for (size_t i = 0; i < m.matches.size(); ++i) {
      const Bearing &a = bearings->a[i], &b = bearings->b[i];
      residuals.push_back(PlaneResidualValue(a.ray_ref, a.J_ray_px, b.ray_ref, b.J_ray_px,
                                             plane.DirectionOf(m, i), m.variance_a(),
                                             m.variance_b()));
    }
    return residuals;
  }

  bool Explain(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
               double noise, const PairGraphOptions& options,
               const std::optional<Eigen::Vector2d>& times_s, PairView* view,
               std::vector<MatchMisfit>* misfits) const override {
    PairPlane plane;
    if (!FitPair(input, pair, calibration, noise, options, view, &plane, 0, 1, times_s)) {
      return false;
    }
    misfits->clear();
    for (size_t i = 0; i < view->bearings.a.size(); ++i) {
      const double sigmas = ValueOf(*view, plane, i);
      MatchMisfit misfit;
      misfit.residual_px = sigmas * view->measurement.sigma;
      misfit.inlier = std::abs(sigmas) <= options.inlier_sigmas();
      misfit.correction_px = CorrectionOf(*view, plane, i);
      misfits->push_back(misfit);
    }
    return true;
  }

  bool Unseen(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise, const PairGraphOptions& options,
              std::vector<double>* residuals) const override {
    PairView view;
    PairPlane plane;
    if (!FitPair(input, pair, calibration, noise, options, &view, &plane, 0, 2)) return false;
    *residuals = PredictedResiduals(view, plane);
    return true;
  }
};

}  // namespace

const PairResidual& ByPlane() {
  static const Plane residual;
  return residual;
}

}  // namespace camgyro
