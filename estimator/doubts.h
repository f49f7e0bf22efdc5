// What of a calibration is not to be believed, and why.
#ifndef CAMGYRO_ESTIMATOR_DOUBTS_H_
#define CAMGYRO_ESTIMATOR_DOUBTS_H_

#include "core/calibration.h"
#include "core/recording.h"
#include "estimator/calibrate.h"

namespace camgyro {

// Sets calibration->determined: a parameter is determined if the data shrank its prior and the
// result is of practical use. attitudes: of a recording without pixels.
void MarkDetermined(bool attitudes, const Prior& prior, Calibration* calibration);

// Of a fit that is not believed: determined is only what comes from the rates, bias and delay.
// ran_away: its focal length is not determined, and nothing like the one that it began with, so
// that nothing has timed the rows.
// The rates tell the delay of the middle row, and that of the first row is half of a readout off,
// which is no better known then than before the fit: its sigma is widened by that, and a doubt says
// what the middle row's is.
void DisbelieveFit(bool ran_away, CalibrationReport* report);

// Of a fit that leaves what is smooth over the picture (CalibrationReport::noise_over_smooth is
// more than kNoiseOfAstray): nothing is determined, and a doubt says why.
void DisbelievePulledFit(CalibrationReport* report);

// How many times as much (rms) frames leave that the fit has not seen as those that it has, beyond
// what the gyro's noise turns them by; both per degree of freedom, without the worst tenth of the
// pairs, so that it is 1 with the right model. 0: nothing was unseen.
double UnseenRatio(const CalibrationReport& report);

// Adds to doubts and notes what speaks against a result that is complete otherwise.
void AddDoubts(const Recording& recording, CalibrationReport* report);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DOUBTS_H_
