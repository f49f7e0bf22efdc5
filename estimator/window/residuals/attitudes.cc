// The rotation between two camera attitudes against the gyro's.
#include "estimator/window/residuals/all_residuals.h"
#include "factors/relative_rotation.h"

namespace camgyro {
namespace {

PairResidual::Facts FactsOfAttitudes() {
  PairResidual::Facts facts{"attitudes", "attitudes"};
  facts.of_attitudes = true;
  facts.with_frame_times = true;
  facts.usual_sigma = 2e-3;
  return facts;
}

class Attitudes final : public PairResidual {
 public:
  Attitudes() : PairResidual(FactsOfAttitudes()) {}

  std::shared_ptr<const ceres::CostFunction> MakeCost(std::shared_ptr<const PairMeasurement> pair,
                                                      int64_t) const override {
    return std::make_shared<RelativeRotation>(std::move(pair));
  }

  // With loss: what the loss bends is beyond the median that the noise is taken from.
  std::vector<double> Independent(const std::shared_ptr<const PairMeasurement>& pair,
                                  const PairParameters& at, PairBearings*) const override {
    std::vector<double> residuals(3);
    if (!RelativeRotation(pair).Evaluate(at.InOrder(Blocks(*pair)).data(), residuals.data(),
                                         nullptr)) {
      residuals.clear();
    }
    return residuals;
  }
};

}  // namespace

const PairResidual& ByAttitudes() {
  static const Attitudes residual;
  return residual;
}

}  // namespace camgyro
