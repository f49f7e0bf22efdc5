// One pair of frames under a given calibration, outside of any solve: the rates are the gyro's.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PAIR_VIEW_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PAIR_VIEW_H_

#include <Eigen/Core>
#include <vector>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"
#include "factors/coplanarity_plane.h"
#include "factors/pair_bearings.h"

namespace camgyro {

struct PairView {
  PairMeasurement measurement;           // those matches that have a residual; rates in one group
  Eigen::Matrix3Xd rates;                // readings less bias and effects [rad/s]
  PairBearings bearings;                 // of a ray that is known (TurnRay)
  std::vector<TimedRay> rays_a, rays_b;  // of the matches, for MoveView
  BendVector bend_sigma_rad;             // prior
};

// Standard deviations of the prior of a pair's bend, given that of its direction's change in time.
BendVector BendSigma(double turn_sigma_rad_s, double readout_s, double gap_s);

// The translation direction of a pair's matches; see CoplanarityPlane.
struct PairPlane {
  Eigen::Vector3d tau = Eigen::Vector3d::UnitZ();
  BendVector bend = BendVector::Zero();

  // The same in another frame. R_to_from: takes vectors of this one's frame there.
  PairPlane TurnedBy(const Eigen::Matrix3d& R_to_from) const;

  // Of match i.
  Eigen::Vector3d DirectionOf(const PairMeasurement& pair, size_t i) const;
};

// False where the gyro's samples do not cover the pair. noise: of the recording, pixels, or radians
// of attitudes; the pair's factor is applied.
// Shutter, lens, effects and bias are the calibration's; matches are those that the residual of the
// options has. offsets_s: of the frames' times from their stamps.
[[nodiscard]] bool ViewPair(const EstimationInput& input, const TimedPair& pair,
                            const Calibration& calibration, double noise,
                            const PairGraphOptions& options, PairView* view,
                            const Eigen::Vector2d& offsets_s = Eigen::Vector2d::Zero());

// The same view with the frames' times at other offsets, as ViewPair would make it: of a residual
// that drops no matches (CHECKed), and with the same calibration, but quicker.
[[nodiscard]] bool MoveView(const EstimationInput& input, const TimedPair& pair,
                            const Calibration& calibration, double noise,
                            const PairGraphOptions& options, const Eigen::Vector2d& offsets_s,
                            PairView* view);

// The plane that fits the matches first, first + step, ... of a view best: the direction searched,
// its bend with the prior.
PairPlane FitPlane(const PairView& view, size_t first = 0, size_t step = 1);
// That a plane takes from these matches: 2 of a direction with a bend that its prior determines, at
// most 6, since what of the bend lies along the direction changes nothing.
double DegreesOfFreedom(const PairView& view, const PairPlane& plane, size_t first = 0,
                        size_t step = 1);
// Residuals of the matches 1, 3, 5, ... under a plane that FitPlane found of the matches 0, 2, 4,
// ..., without loss, in sigmas of what noise lets expect, of which the plane's own error is a part.
std::vector<double> PredictedResiduals(const PairView& view, const PairPlane& of_even);
// Of match i, in sigmas, without loss.
PlaneResidual ResidualOf(const PairView& view, const PairPlane& plane, size_t i);
double ValueOf(const PairView& view, const PairPlane& plane, size_t i);  // alone

// The shortest shift of px_b that takes match i onto the plane; see MatchMisfit.
Eigen::Vector2d CorrectionOf(const PairView& view, const PairPlane& plane, size_t i);

// The samples that a pair needs, and one beyond on both sides; false where there are none, one is
// saturated, or two of them are further apart than 30 ms and than five mean intervals.
[[nodiscard]] bool RatesOfPair(const EstimationInput& input, const TimedPair& pair,
                               const Calibration& calibration, std::vector<double>* times_s,
                               Eigen::Matrix3Xd* rates,
                               const Eigen::Vector2d& offsets_s = Eigen::Vector2d::Zero());

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PAIR_VIEW_H_
