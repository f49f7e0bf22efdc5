// Where the rotation alone would move each match: for far scenes.
#include <cmath>
#include <optional>

#include "estimator/window/pair_graph.h"
#include "estimator/window/pair_view.h"
#include "estimator/window/residuals/all_residuals.h"
#include "factors/symmetric_transfer.h"

namespace camgyro {
namespace {

// Median of the magnitude of a Gaussian by that of the length of two.
constexpr double kMedianOfOne = 0.67449 / 1.17741;

PairResidual::Facts FactsOfTransfer() {
  PairResidual::Facts facts{"transfer",
                            "transfer, of the rotation alone, for scenes without parallax"};
  facts.with_effects = false;
  facts.drops_matches = true;
  facts.per_match = 2;
  return facts;
}

// A transfer has no direction: each match is unseen.
class ByRotationAlone final : public PairResidual {
 public:
  ByRotationAlone() : PairResidual(FactsOfTransfer()) {}

  std::shared_ptr<const ceres::CostFunction> MakeCost(std::shared_ptr<const PairMeasurement> pair,
                                                      int64_t) const override {
    return std::make_shared<SymmetricTransfer>(std::move(pair));
  }

  bool HasResidual(const Lens& model, const LensParameters& lens, const Bearing& a,
                   const Bearing& b) const override {
    return HasTransfer(model, lens, a, b);
  }

  std::vector<double> Independent(const std::shared_ptr<const PairMeasurement>& pair,
                                  const PairParameters& at, PairBearings*) const override {
    return SymmetricTransfer(pair).IndependentResiduals(at.InOrder(Blocks(*pair)).data());
  }

  bool Explain(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
               double noise, const PairGraphOptions& options, const std::optional<Eigen::Vector2d>&,
               PairView* view, std::vector<MatchMisfit>* misfits) const override {
    std::vector<double> residuals;
    if (!ViewResiduals(input, pair, calibration, noise, options, view, &residuals)) return false;
    const double sigma_of_two_px =
        std::sqrt(view->measurement.variance_a() + view->measurement.variance_b());
    misfits->clear();
    for (size_t i = 0; i < residuals.size(); i += 2) {
      const Eigen::Vector2d two(residuals[i], residuals[i + 1]);
      misfits->push_back({kMedianOfOne * two.norm() * view->measurement.sigma,
                          -sigma_of_two_px * two, two.norm() <= options.inlier_sigmas()});
    }
    return true;
  }

  bool Unseen(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise, const PairGraphOptions& options,
              std::vector<double>* residuals) const override {
    PairView view;
    return ViewResiduals(input, pair, calibration, noise, options, &view, residuals);
  }

 private:
  bool ViewResiduals(const EstimationInput& input, const TimedPair& pair,
                     const Calibration& calibration, double noise, const PairGraphOptions& options,
                     PairView* view, std::vector<double>* residuals) const {
    if (!ViewPair(input, pair, calibration, noise, options, view) ||
        static_cast<int>(view->bearings.a.size()) < PairGraph::kMinMatches) {
      return false;
    }
    const ShutterParameters shutter = ShutterOf(calibration);
    PairParameters at;
    at.lens = calibration.lens.data();
    at.shutter = shutter.data();
    at.q_gyro_cam = calibration.q_gyro_cam.coeffs().data();
    at.rates = {view->rates.data()};
    *residuals = Independent(std::make_shared<const PairMeasurement>(view->measurement), at,
                             /*bearings=*/nullptr);
    return residuals->size() == 2 * view->bearings.a.size();
  }
};

}  // namespace

const PairResidual& ByTransfer() {
  static const ByRotationAlone residual;
  return residual;
}

}  // namespace camgyro
