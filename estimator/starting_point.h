// From the start of a recording to where its fit begins.
#ifndef CAMGYRO_ESTIMATOR_STARTING_POINT_H_
#define CAMGYRO_ESTIMATOR_STARTING_POINT_H_

#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/start/find_start.h"
#include "estimator/window/pair_graph_options.h"
#include "estimator/window/residuals/pair_residual.h"

namespace camgyro {

// Of the neighbours of a recording with attitudes.
std::vector<CameraRotation> NeighbourRotations(const Recording& recording);

// The Gaussian prior of a calibration, as wide as the table of the state says (core/state.h).
//   f: the declared one, else the scan's; c: the declared one, else the centre; t_r: declared, else
//   half of the shorter of frame interval and 1/30 s; t_d: the search's; b_g: 0; q_c: the search's,
//   with its sigma where that is wider than the table's. Attitudes: t_r 0, and units for what needs
//   pixels.
Prior MakePrior(const Recording& recording, const StartResult& start);

// Options with the noise of this recording's matches and gyro.
PairGraphOptions GraphOptionsFor(const Recording& recording, const StartResult& start,
                                 PairGraphOptions options);

// Puts effects into a calibration that has none: those of a list (MakeEffects), and those that the
// start has found (EffectEntry::found_at_start) and the residual can have, with the values where a
// fit begins. A gyro's clock that was found behind stamps of arrival brings clock_skew, where its
// rate is not known so well that it does not show. notes, if wanted: of what was not in the list
// (EffectEntry::start_note) is appended. Errors: the list's.
Status AddStartEffects(const Recording& recording, const StartResult& start,
                       const std::string& list, const PairResidual& residual,
                       Calibration* calibration, std::vector<std::string>* notes = nullptr);

// What effects may know of the start: a lens that follows the camera's turns, or one that is held.
void TellOfStabiliser(const StartResult& start, EffectSetup* setup);

// Puts optical_stabilisation into a calibration that has none, where the start has found that the
// lens follows the camera's turns and the residual can have effects.
void AddStabiliser(const Recording& recording, const StartResult& start,
                   const PairResidual& residual, Calibration* calibration);

// Where a fit begins, and what is held to be likely before.
struct StartingPoint {
  Prior prior;
  // The prior's mean with the start's focal length, effects and bias. A step sideways looks like a
  // turn, to rotations: where a bias beyond the prior's sigma may be that, one that is found
  // without it.
  Calibration estimate;
  std::vector<std::string> notes;
};

// MakePrior and AddStartEffects, with what else the start has found. Errors: of the effects' list.
Result<StartingPoint> MakeStartingPoint(const Recording& recording, const StartResult& start,
                                        const std::string& effects, const PairResidual& residual);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_STARTING_POINT_H_
