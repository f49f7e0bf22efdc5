// What a pair of frames is held against. Each residual is one file of this folder and one row of
// all_residuals.h; graph, window, refinement, tables, score tests and the command line know it from
// there.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_RESIDUALS_PAIR_RESIDUAL_H_
#define CAMGYRO_ESTIMATOR_WINDOW_RESIDUALS_PAIR_RESIDUAL_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/calibration.h"
#include "estimator/window/factor_graph.h"
#include "estimator/window/timed_pair.h"
#include "factors/pair_bearings.h"

namespace camgyro {

struct EstimationInput;
struct PairGraphOptions;
struct PairView;

// Where the parameters of a pair stand. Null: the pair has no such block.
struct PairParameters {
  const double* lens = nullptr;
  const double* shutter = nullptr;
  const double* q_gyro_cam = nullptr;
  const double* tau = nullptr;   // direction of translation
  const double* bend = nullptr;  // and its bend; see CoplanarityPlane
  const double* effects = nullptr;
  std::array<const double*, 2> own_times{};  // of the two frames
  std::vector<const double*> rates;          // by group

  // In the order of a cost function's blocks.
  std::vector<const double*> InOrder(const std::vector<BlockKind>& blocks) const;
};

// A match under a calibration.
struct MatchMisfit {
  // Signed distance from the plane of the pair (Sampson), of one noisy coordinate [px]. The sign
  // follows the sign of the pair's direction and has no meaning across pairs. Of a transfer: the
  // length of its error, times what gives it the median of one coordinate's magnitude.
  double residual_px = 0.0;
  // The shortest shift of px_b that takes the match onto the plane, if all of the error is there;
  // it lies across the epipolar line. Signed, and comparable across pairs [px]. Of a transfer: the
  // shift of px_b to where the rotation puts px_a.
  Eigen::Vector2d correction_px = Eigen::Vector2d::Zero();
  bool inlier = false;  // within PairGraphOptions::inlier_sigmas
};

class PairResidual {
 public:
  struct Facts {
    const char* name;  // of --residual
    const char* help;  // a phrase that begins with the name
    // Of rotations between camera attitudes: without pixels and lens, noise in rad. It is what such
    // recordings are held against, and cannot be chosen.
    bool of_attitudes = false;
    // Each pair has a direction of translation of its own, with a bend, both unknown.
    bool has_direction = false;
    bool with_effects = true;       // effects of the catalogue can be fitted
    bool with_frame_times = false;  // frames may have times of their own (frame_stamp_jitter)
    bool drops_matches = false;     // not each match with two rays has a residual: HasResidual
    int per_match = 1;              // independent residuals
    // Degrees of freedom that a pair's own direction and its turn take; the rest of the turn lies
    // along the direction, where it changes nothing.
    int lost_per_pair = 0;
    double usual_sigma = 1.0;  // first guess of the noise per axis [px; rad of attitudes]
  };

  explicit PairResidual(const Facts& facts) : facts_(facts) {}
  virtual ~PairResidual() = default;
  const Facts& facts() const { return facts_; }

  // Kinds of the cost function's parameter blocks, in its order: one of each, two frame times,
  // rates of each group.
  std::vector<BlockKind> Blocks(const PairMeasurement& pair) const;

  // The factor of a pair. id: of the pair; what is drawn at random is drawn by it.
  virtual std::shared_ptr<const ceres::CostFunction> MakeCost(
      std::shared_ptr<const PairMeasurement> pair, int64_t id) const = 0;

  // Whether a match with these bearings has a residual.
  virtual bool HasResidual(const Lens& model, const LensParameters& lens, const Bearing& a,
                           const Bearing& b) const;

  // Independent residuals in sigmas: per_match of each match, without loss; three of a rotation.
  // Empty if a ray is missing. `bearings` is filled where the residual has them, without
  // derivatives by the parameters.
  virtual std::vector<double> Independent(const std::shared_ptr<const PairMeasurement>& pair,
                                          const PairParameters& at,
                                          PairBearings* bearings) const = 0;

  // A pair under a calibration, outside of any solve, with the gyro's rates and the direction that
  // suits it best. False where the gyro does not cover it, or too few matches have a residual.
  // noise: per axis [px].
  // Each match; `view` says which these are. times_s: offsets of the two frames from their stamps,
  // where something else than the pair tells them (FitPair).
  virtual bool Explain(const EstimationInput& input, const TimedPair& pair,
                       const Calibration& calibration, double noise,
                       const PairGraphOptions& options,
                       const std::optional<Eigen::Vector2d>& times_s, PairView* view,
                       std::vector<MatchMisfit>* misfits) const;
  // Independent residuals of those matches that have had no say in the pair's direction, in sigmas
  // of what noise lets expect, the error of that direction included.
  virtual bool Unseen(const EstimationInput& input, const TimedPair& pair,
                      const Calibration& calibration, double noise, const PairGraphOptions& options,
                      std::vector<double>* residuals) const;

 private:
  const Facts facts_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_RESIDUALS_PAIR_RESIDUAL_H_
