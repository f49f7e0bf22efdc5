// Fits that have gone astray: something that the model lacks has sent them to a lens that is none.
#ifndef CAMGYRO_ESTIMATOR_ASTRAY_H_
#define CAMGYRO_ESTIMATOR_ASTRAY_H_

#include <functional>
#include <optional>
#include <string>

#include "core/calibration.h"
#include "core/effects/catalogue.h"
#include "core/recording.h"
#include "estimator/calibrate.h"
#include "estimator/start/find_start.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

// A focal length has run away from where it was: they differ by more than a factor of 2. Attitudes
// have none, which is 0 and stays.
bool RanAway(double focal_px, double from_px);

// It has, and a round of its fit still moves it by a tenth: such a fit comes to no end. One that
// began at a wrong focal length gets as far from it, but settles there
// (FaultsTest.TheLightFlickers: by 1 % in its second round).
bool IsRunningAway(double before_px, double now_px, double from_px);

// A focal length is far from that of the rotations at the start, if they determine one: a strong
// lens that nothing declares moves theirs by 7 % (rms, docs/lab/start.md), and a fit's by any
// factor.
bool IsFarFromRotations(double focal_px, const std::optional<StartFocal>& start);

// A fit that leaves more than so many times what it would leave without what is a smooth function
// of the place in the picture lacks something that bends the whole picture. Of a fit that lacks
// nothing it is 1, but for chance. Nothing of such a fit is determined, whatever its sigmas.
constexpr double kNoiseOfAstray = 1.5;

// What a fit leaves (ComputeResiduals, of 100 pairs at most, without the tenth that leaves most)
// over what it leaves without what is smooth (SeparateSmooth), robust. 0 where nothing can be said:
// for recordings without pictures, residuals without a direction of translation, and pairs with too
// few matches. The tracks' noise is in both, whether it adds up from frame to frame or not; that of
// the gyro, which turns the whole picture, is taken off what is smooth.
double NoiseOverSmooth(const Recording& recording, const EstimationInput& input,
                       const Calibration& fit, double noise_px, const PairGraphOptions& options);

// A lens that follows the camera's turns (optical_stabilisation) takes them out of the pictures.
bool LensFollowsTurns(const Calibration& calibration);

// Where the fit's focal length is far from that of the rotations, and the fit has found a
// distortion that nothing declares: start.focal anew, of rotations seen through that lens. Without
// it, the start may take any focal length for determined. Through a lens that follows the camera's
// turns (optical_stabilisation), rotations determine none. rotations_at: may be empty; nothing is
// done then.
void LookThroughFittedLens(const Recording& recording, const CalibrateOptions& options,
                           const CameraRotationsAt& rotations_at, CalibrationReport* report);

// Beyond the range of real devices by more than so many of its sigmas, a value is not believed.
constexpr double kImplausibleSigmas = 2.0;

// What speaks against a fit with this effect of it: parameters outside of what real devices show,
// or a focal length that ran away from start_focal_px. Empty: nothing.
std::string Implausible(const EffectSet::Item& item, const Calibration& fit, double start_focal_px);

// A fit bears out an effect of its own: one of its values is beyond 3 of its sigmas.
bool IsSeen(const EffectSet::Item& item, const Calibration& fit);

// Whether the data bear out an effect that a fit has in place of a fit that went astray: the focal
// length is near that of the start and of where it began [px], the noise is less than `noise_px` of
// the other fit, and the effect's values are like those of real devices, and not zero.
bool IsBornOut(const CalibrationReport& fit, const std::string& effect, double begin_focal_px,
               double noise_px);

// A fit without what leads it astray.
struct AstrayFit {
  double focal_px = 0.0;
  double noise_px = 0.0;
  double over_smooth = 0.0;  // NoiseOverSmooth
};

// The calibration with one of the effects that lead fits astray (EffectEntry::leads_astray) and
// that the data bear out: of its shapes that the start does not rule out, and of several such
// effects, with the one that fits unseen frames best; a note says so. from: where fits begin;
// astray: the one without, absent where the matches alone tell of a strong lens
// (CameraGuess::division_lambda), which is all that is tried then; fit_with: a fit with an effect,
// as --effects names it, which is called from several threads. Two shapes are tried together, the
// usual ones first; if one of them leaves a tenth of the variance, the others are not. The lens
// comes first, and where nothing that is smooth is left, nothing else is tried.
std::optional<CalibrationReport> FitWithWhatLeadsAstray(
    const Recording& recording, const StartResult& start, const Calibration& from,
    const std::optional<AstrayFit>& astray,
    const std::function<Result<CalibrationReport>(const std::string& effect)>& fit_with);

// Of the frames that each half of a fit has not seen, where it was tested; else of all [px].
double UnseenRms(const CalibrationReport& fit);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ASTRAY_H_
