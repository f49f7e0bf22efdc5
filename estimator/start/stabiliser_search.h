// Does the lens follow the camera's turns? From rotations, before anything is fitted.
#ifndef CAMGYRO_ESTIMATOR_START_STABILISER_SEARCH_H_
#define CAMGYRO_ESTIMATOR_START_STABILISER_SEARCH_H_

#include "core/recording.h"
#include "estimator/start/camera_rotations_at.h"
#include "estimator/start/find_start.h"

namespace camgyro {

// Sets start->stabiliser. Where the lens follows turns beyond doubt, delay, orientation, bias and
// focal length of the start are those of that fit, since a start that takes the lens for held is
// off by tens of ms and by any focal length; its readout time is left open, and a note says so.
void LookForStabiliser(const Recording& recording, const CameraRotationsAt& rotations_at,
                       StartResult* start);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_STABILISER_SEARCH_H_
