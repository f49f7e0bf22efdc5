#include "estimator/start/stabiliser_search.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/format.h"
#include "core/time.h"
#include "estimator/start/clock_rate.h"
#include "estimator/start/lag_search.h"
#include "estimator/start/orientation.h"
#include "estimator/start/rate_alignment.h"
#include "estimator/start/stabiliser_fit.h"

namespace camgyro {
namespace {

// Gains of stabilisers are 0.3 and more (core/effects/optical_stabilisation.cc).
constexpr double kLeastGain = 0.2;
constexpr double kGainSigmas = 3.0;
constexpr int kLeastPairs = 20;
// The noise that a held lens leaves over that which a stabilised one leaves. Where there is no
// stabiliser it is 1: with an undeclared lens or hardly any motion, a gain may seem certain that
// explains nothing (`camgyro delay` of gopro-hero5-karma: 89.1 ± 4.1 %).
constexpr double kLeastNoiseRatio = 1.15;
// Rotations are made anew at the focal length found, until it stays.
constexpr int kMostRounds = 6;
constexpr double kStaysLog = 0.03;
// A lens is not quite where the model has it (docs/lab/device_logs.md); log of f.
constexpr double kModelOfFollowing = 0.03;

double SigmaOf(const StabiliserFit& fit, int parameter) {
  return std::sqrt(fit.covariance(parameter, parameter));
}

StartStabiliser JudgeStabiliser(const StabiliserFit& fit) {
  StartStabiliser found;
  found.stabiliser = fit.stabiliser;
  found.gain = fit.gain;
  found.gain_sigma = SigmaOf(fit, StabiliserFit::kGain);
  found.follows_turns = fit.converged && fit.gain - kGainSigmas * found.gain_sigma > kLeastGain &&
                        fit.held_noise_rad_s > kLeastNoiseRatio * fit.noise_rad_s;
  found.is_held = fit.converged && std::abs(fit.gain) + kGainSigmas * found.gain_sigma < kLeastGain;
  return found;
}

// The start as the fit has it, with the focal length that belongs to it.
void TakeFit(const Recording& recording, const StabiliserFit& fit, double offset_s, double focal_px,
             StartResult* start) {
  start->delay_middle_row_s = fit.lag_s / (1.0 + start->clock_skew) + offset_s;
  start->delay_sigma_s = SigmaOf(fit, StabiliserFit::kLag);
  const Orientation orientation = CompleteOrientation(
      fit.q_gyro_cam,
      fit.covariance.block<3, 3>(StabiliserFit::kRotation, StabiliserFit::kRotation),
      recording.camera.q_gyro_cam);
  start->q_gyro_cam = orientation.q_gyro_cam;
  start->rotation_sigma_rad = orientation.sigma_rad;
  start->rotation_axes_determined = orientation.axes_determined;
  start->bias_gyro_rad_s = fit.bias_gyro_rad_s;
  start->bias_sigma_rad_s = fit.covariance.diagonal().segment<3>(StabiliserFit::kBias).cwiseSqrt();
  start->explained = fit.explained;
  start->noise_rad_s = fit.noise_rad_s;
  start->focal->value_px = focal_px;
  start->focal->sigma_px =
      focal_px * std::hypot(SigmaOf(fit, StabiliserFit::kLogScale), kModelOfFollowing);
  start->focal->determined = start->focal->sigma_px < StartFocal::kDetermined * focal_px;
  if (!recording.camera.readout_s) start->readout = UsualReadout(recording);
}

std::string NoteOn(const StartStabiliser& found) {
  const double travel_rad = found.stabiliser.travel_rad;
  return Format(
             "the lens follows the camera's turns: it makes up for %.0f ± %.0f %% of what is "
             "faster than %.2g Hz",
             100.0 * found.gain, 100.0 * found.gain_sigma, found.stabiliser.corner_hz) +
         (std::isfinite(travel_rad) ? Format(", up to %.2g deg", travel_rad * 180.0 / M_PI)
                                    : std::string()) +
         ", and optical_stabilisation is part of the model";
}

}  // namespace

void LookForStabiliser(const Recording& recording, const CameraRotationsAt& rotations_at,
                       StartResult* start) {
  const GyroRates gyro(recording.gyro);
  const double offset_s =
      SecondsSince(recording.frames.front().stamp_ns, recording.gyro.front().stamp_ns);
  StartResult now = *start;
  double focal_px = start->focal->value_px;
  for (int round = 0; round < kMostRounds; ++round) {
    // Rotations that are made near to the gyro's follow it where a shift of the lens can pass for a
    // step sideways: of a camera that only turns, they showed no stabiliser.
    const RotationTrial trial{focal_px, std::nullopt};
    Result<CameraRates> camera =
        MakeCameraRates(recording, rotations_at(recording, {trial}).front(), gyro);
    if (!camera || camera->size() < kLeastPairs) return;
    const RateAlignment alignment(gyro, OnGyroClock(*std::move(camera), now.clock_skew));
    const double lag_s = (now.delay_middle_row_s - offset_s) * (1.0 + now.clock_skew);
    const StabiliserFit fit = FitStabiliser(alignment, lag_s, now.q_gyro_cam, now.bias_gyro_rad_s);
    now.stabiliser = JudgeStabiliser(fit);
    start->stabiliser = now.stabiliser;
    if (!now.stabiliser->follows_turns) return;
    focal_px *= fit.scale;
    TakeFit(recording, fit, offset_s, focal_px, &now);
    if (std::abs(std::log(fit.scale)) < kStaysLog) {
      now.notes.push_back(NoteOn(*now.stabiliser));
      *start = std::move(now);
      return;
    }
  }
  start->stabiliser->follows_turns = false;  // no focal length fits its own rotations
}

}  // namespace camgyro
