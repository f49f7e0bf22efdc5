// What a calibration does not know of its model: the systematic part of its error, and whether the
// residuals show an effect that the model lacks. Without refitting anything.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_MODEL_CHECK_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_MODEL_CHECK_H_

#include <optional>
#include <string>

#include "core/effects/device_class.h"
#include "core/recording.h"
#include "estimator/calibrate.h"

namespace camgyro {

// What a calibration was fitted to.
enum class FittedTo { kTheseData, kMoreData };

// Fills total_covariance, device_class and systematic of the report. Returns a doubt in words where
// a candidate of the catalogue is significant beyond doubt (kNoDoubt, all candidates together).
//
// With x the parameters and c the effects that are neither declared nor fitted, a fit without c is
// off by X c to first order, where X = H_xx^-1 H_xc (score_test.h). Before the data c has the sizes
// of the device's class; the residuals make of it a Gaussian around c_hat with covariance C. The
// mean squared error of the fitted values, given the data, is then
//   total = covariance + X C X' + (X c_hat)(X c_hat)'.
// The last term stands because the values are not corrected by X c_hat: a correction by an effect
// that may be another one is left to the diagnosis, which tests it on unseen frames.
//
// A calibration that was fitted to more than these data, as an online estimate of which the last
// seconds are here, is not where their fit is. It is off by X c_hat - d then, d being the step to
// their fit, as far as that is more than noise.
//
// To that the gyro's bias has what parallax may hide of it (unseen_parallax.h).
//
// Where the two halves of the recording disagree (kHalvesLimit), the covariance was multiplied by
// their chi-square. These effects let the halves differ as well: by X1 c - X2 c, which makes
//   1 + tr((4 covariance)^-1 (X1 - X2) C (X1 - X2)') / kStateSize
// of it. The covariance is divided by that as far as it was multiplied, since total has it.
//
// A recording that is too short for stretches that scatter (kLeastBlocks) has a total, in which the
// residuals are taken for as noisy as the fit says, and no doubt. Nothing is filled for one that is
// fitted with the residual of the transfer alone.
std::optional<std::string> CheckModel(const Recording& recording, const CalibrateOptions& options,
                                      DeviceClass device, CalibrationReport* report,
                                      FittedTo fitted_to = FittedTo::kTheseData);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_MODEL_CHECK_H_
