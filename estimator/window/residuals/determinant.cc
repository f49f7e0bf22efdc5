// Triplets of matches as in the paper. Whatever looks at single matches takes them as those of
// planes.
#include <optional>

#include "estimator/window/direction_search.h"
#include "estimator/window/residuals/all_residuals.h"
#include "factors/coplanarity_determinant.h"

namespace camgyro {
namespace {

PairResidual::Facts FactsOfDeterminant() {
  PairResidual::Facts facts{"determinant", "determinant as in the paper"};
  facts.lost_per_pair = 4;
  return facts;
}

class Determinant final : public PairResidual {
 public:
  Determinant() : PairResidual(FactsOfDeterminant()) {}

  std::shared_ptr<const ceres::CostFunction> MakeCost(std::shared_ptr<const PairMeasurement> pair,
                                                      int64_t id) const override {
    const int count = static_cast<int>(pair->matches.size());
    return std::make_shared<CoplanarityDeterminant>(
        std::move(pair), RandomTriplets(count, count, static_cast<uint64_t>(id) + 1));
  }

  std::vector<double> Independent(const std::shared_ptr<const PairMeasurement>& pair,
                                  const PairParameters& at, PairBearings* bearings) const override {
    const PairMeasurement& m = *pair;
    const RotationChain chain(m.rate_times_s, GatherRates(m, at.rates.data()));
    if (!EvaluatePairBearings(m, chain, at.lens, at.shutter, at.q_gyro_cam, at.effects, false,
                              bearings)) {
      return {};
    }
    return FindDirection(*bearings, m.variance_a(), m.variance_b(), m.robust_threshold).residuals;
  }

  bool Explain(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
               double noise, const PairGraphOptions& options,
               const std::optional<Eigen::Vector2d>& times_s, PairView* view,
               std::vector<MatchMisfit>* misfits) const override {
    return ByPlane().Explain(input, pair, calibration, noise, options, times_s, view, misfits);
  }

  bool Unseen(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise, const PairGraphOptions& options,
              std::vector<double>* residuals) const override {
    return ByPlane().Unseen(input, pair, calibration, noise, options, residuals);
  }
};

}  // namespace

const PairResidual& ByDeterminant() {
  static const Determinant residual;
  return residual;
}

}  // namespace camgyro
