// The measurement function of one observation within a pair of frames: lens, shutter clock and
// rates composed (docs/architecture.md), with the derivative by the pixel, so that pixel noise is
// propagated through all of it, and with back-propagation of any scalar to every parameter.
#ifndef CAMGYRO_CORE_PAIR_MODEL_H_
#define CAMGYRO_CORE_PAIR_MODEL_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/calibration.h"
#include "core/effects/catalogue.h"
#include "core/lens.h"
#include "core/rotation_chain.h"

namespace camgyro {

// The shutter clock's parameter block: [ t_r [s], t_d [s] ], in the order of the state.
enum ShutterIndex : int { kReadout, kDelay, kShutterSize };
using ShutterParameters = Eigen::Matrix<double, kShutterSize, 1>;
inline ShutterParameters ShutterOf(const Calibration& c) { return {c.readout_s, c.delay_s}; }

// Time on the gyro clock at which row v_px is exposed, eq. (2):
//   t_gyro = t_frame + t_d + t_r * v / h
// frame_time_s: the frame's recorded stamp, with its offset if it has a time of its own, seconds
// from the same origin as the gyro's times.
inline double RowTimeGyroS(double frame_time_s, const ShutterParameters& shutter, double v_px,
                           double height_px) {
  return frame_time_s + shutter[kDelay] + shutter[kReadout] * v_px / height_px;
}

// First and last time on the gyro clock at which two frames are exposed.
std::pair<double, double> ExposureSpan(const ShutterParameters& shutter,
                                       const Eigen::Vector2d& size_px, const PairEffects& effects,
                                       const FrameTime& frame_a, const FrameTime& frame_b);

// How a picture is read: how long that takes [s], and which shares of it pass from the first to the
// last column, and row. The larger share is 1; effects on time may read columns
// (readout_direction).
struct Scan {
  double readout_s = 0.0;
  Eigen::Vector2d shares{0.0, 1.0};
};
Scan ScanOf(const ShutterParameters& shutter, const Eigen::Vector2d& size_px,
            const PairEffects& effects, const FrameTime& frame);

// First to last column, beside the readout of rows [s]: zero but with readout_direction.
double ColumnReadoutOf(const Calibration& calibration);
// Pictures are read column by column, which not every program here knows, if that takes longer than
// rows do, and more than what shows (1 ms: half a pixel of a turn by 1 rad/s).
inline bool ReadsColumns(double readout_s, double column_readout_s) {
  return std::abs(column_readout_s) > std::max(1e-3, std::abs(readout_s));
}
inline constexpr char kReadsColumns[] =
    "the pictures are read column by column (readout_direction), expected row by row; turn them by "
    "90 degrees, and calibrate those";

// The true rate behind a gyro reading, less its bias, in view of the effects [rad/s].
Eigen::Vector3d TrueRate(const PairEffects& effects, double time_gyro_s,
                         const Eigen::Vector3d& reading_less_bias);

// A pixel seen from the reference orientation of its pair (the gyro frame at the first rate).
struct Bearing {
  Eigen::Vector3d ray_ref;               // R_ref_gyro(t) R_gyro_cam ray_cam
  Eigen::Matrix<double, 3, 2> J_ray_px;  // through the lens and through the row's time

  // Multiplies J_ray_px from the right by TrackedPoint::noise_factor, so that unit noise of a
  // pixel, alike in all directions, makes the ray's.
  void ScaleNoise(const Eigen::Vector3d& factor);

  // What Backpropagate needs.
  RayJet lens_ray;
  RotationChain::State rotation;
  Eigen::Matrix3d R_ref_cam;
  Eigen::Vector3d omega_cam_rad_s;
  Eigen::RowVector2d J_time_px;  // of the time of exposure [s/px]
  double row_fraction = 0.0;     // v / h
  EffectSet::Change change;      // empty without effects
  Eigen::Matrix2d noise_factor = Eigen::Matrix2d::Identity();
};

// Derivatives of one scalar by the parameters of a pair; rates are added by the caller's chain.
struct PairGradient {
  Eigen::Matrix<double, 1, kLensSize> by_lens = Eigen::Matrix<double, 1, kLensSize>::Zero();
  Eigen::Matrix<double, 1, kShutterSize> by_shutter =
      Eigen::Matrix<double, 1, kShutterSize>::Zero();
  Eigen::RowVector3d by_rotation = Eigen::RowVector3d::Zero();  // right perturbation of q_gyro_cam
  Eigen::RowVectorXd by_effects;  // sized by the first bearing that has effects
};

// False where the lens has no ray for this pixel. size_px: width, height of the picture.
// Backpropagate needs derivatives by the lens: those of the gradient.
[[nodiscard]] bool EvaluateBearing(const Lens& lens_model, const LensParameters& lens,
                                   const ShutterParameters& shutter,
                                   const Eigen::Matrix3d& R_gyro_cam, const RotationChain& chain,
                                   const FrameTime& frame, const Eigen::Vector2d& size_px,
                                   const Eigen::Vector2d& px, const PairEffects& effects,
                                   Bearing* bearing,
                                   LensDerivatives by_lens = LensDerivatives::kAll);

// The same without effects.
[[nodiscard]] inline bool EvaluateBearing(const Lens& lens_model, const LensParameters& lens,
                                          const ShutterParameters& shutter,
                                          const Eigen::Matrix3d& R_gyro_cam,
                                          const RotationChain& chain, double frame_time_s,
                                          double height_px, const Eigen::Vector2d& px,
                                          Bearing* bearing,
                                          LensDerivatives by_lens = LensDerivatives::kAll) {
  return EvaluateBearing(lens_model, lens, shutter, R_gyro_cam, chain, FrameTime{frame_time_s},
                         Eigen::Vector2d(0.0, height_px), px, PairEffects(), bearing, by_lens);
}

// A pixel before the camera's motion: where it looks, and when. Lens, shutter and effects make it,
// so that it is the same wherever these are known.
struct TimedRay {
  Eigen::Vector3d ray;                   // camera frame
  Eigen::Matrix<double, 3, 2> J_ray_px;  // through the lens
  double time_gyro_s = 0.0;              // of exposure
  Eigen::RowVector2d J_time_px;          // [s/px]
};

// False where the lens has no ray for this pixel.
[[nodiscard]] bool EvaluateTimedRay(const Lens& lens_model, const LensParameters& lens,
                                    const ShutterParameters& shutter, const FrameTime& frame,
                                    const Eigen::Vector2d& size_px, const Eigen::Vector2d& px,
                                    const PairEffects& effects, TimedRay* timed);

// The bearing of a pixel that is exposed so much later than `timed` says. Derivatives by time,
// rotation and rates can be had from it, not those by lens, shutter and effects.
void TurnRay(const TimedRay& timed, double later_s, const Eigen::Matrix3d& R_gyro_cam,
             const RotationChain& chain, Bearing* bearing);

// Derivative of a scalar by the time of exposure, given those by ray_ref and by J_ray_px.
double ByTime(const Bearing& bearing, const Eigen::Vector3d& by_ray,
              const Eigen::Matrix<double, 3, 2>& by_J_ray_px);

// Adds to `gradient` and `by_rates` (3 x chain.size()) the derivative of a scalar, given its
// derivatives by ray_ref and by J_ray_px of one bearing.
void Backpropagate(const Bearing& bearing, const RotationChain& chain, double height_px,
                   const Eigen::Vector3d& by_ray, const Eigen::Matrix<double, 3, 2>& by_J_ray_px,
                   PairGradient* gradient, RotationChain::RateGradient by_rates);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_PAIR_MODEL_H_
