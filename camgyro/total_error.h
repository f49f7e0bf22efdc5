// What effects that nobody has declared may add to the error of an online estimate.
#ifndef CAMGYRO_TOTAL_ERROR_H_
#define CAMGYRO_TOTAL_ERROR_H_

#include <cstdint>
#include <optional>
#include <string>

#include "camgyro/online_calibration.h"
#include "core/effects/device_class.h"
#include "core/recording.h"
#include "estimator/vins/vins_window.h"

namespace camgyro::api {

// Found by the model check (estimator/diagnosis/model_check.h) on the latest seconds alone, since
// no more is kept: what these bound less than the whole recording did makes it too large, rather
// than too small. Not thread-safe.
class TotalError {
 public:
  TotalError(const camgyro::CameraGuess& camera, DeviceClass device)
      : camera_(camera), device_(device) {}

  // True if this frame of the estimate is kBetweenChecksS after the last check, or there was none.
  bool Due(std::int64_t frame_stamp_ns) const;
  // Looks at the latest frames, with the estimate that follows from them. Takes part of a second.
  void Renew(const VinsInput& latest, MatchNoise noise,
             const OnlineCalibration::Progress& progress);
  // The estimate was given up.
  void Forget();

  // Sets the estimate's total covariance, if that is known.
  void AddTo(OnlineCalibration::Progress* progress) const;
  // In words, if the pictures showed an effect that the model lacks; else empty.
  const std::string& doubt() const { return doubt_; }

  static constexpr double kBetweenChecksS = 10.0;

 private:
  const camgyro::CameraGuess camera_;
  const DeviceClass device_;
  std::optional<std::int64_t> checked_ns_;  // camera clock
  std::optional<StateCovariance> added_;    // to the covariance of noise
  std::string doubt_;
};

}  // namespace camgyro::api

#endif  // CAMGYRO_TOTAL_ERROR_H_
