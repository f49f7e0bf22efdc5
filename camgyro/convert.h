// Between the library's plain types and those inside.
#ifndef CAMGYRO_CONVERT_H_
#define CAMGYRO_CONVERT_H_

#include <string>

#include "camgyro/odometry.h"
#include "camgyro/types.h"
#include "camgyro/vins.h"
#include "core/calibration.h"
#include "core/effects/device_class.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/odometry/odometry.h"
#include "estimator/vins/initialise.h"

namespace camgyro {

api::Calibration ToApi(const Calibration& calibration);
api::VinsStart ToApi(const Result<VinsStart>& start);

DeviceClass FromApi(api::Device device);
// Errors: kBadUsage naming what is not finite or out of range.
Result<CameraGuess> FromApi(const api::CameraGuess& guess);
Result<VinsOptions> FromApi(const api::VinsSettings& settings);
Result<OdometryOptions> FromApi(const api::OdometrySettings& settings);
// With the total covariance, where it is known.
Result<Calibration> FromApi(const api::Calibration& calibration);

}  // namespace camgyro

#endif  // CAMGYRO_CONVERT_H_
