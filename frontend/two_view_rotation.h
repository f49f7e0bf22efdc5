// The camera's rotation between two frames, for the start: before anything is known of the gyro.
#ifndef CAMGYRO_FRONTEND_TWO_VIEW_ROTATION_H_
#define CAMGYRO_FRONTEND_TWO_VIEW_ROTATION_H_

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "core/lens.h"
#include "core/recording.h"
#include "frontend/gyro_rotation.h"
#include "frontend/two_view_problem.h"

namespace camgyro {

struct TwoViewOptions {
  int min_matches = 15;
  // Least noise of a match believed, so that a few exact matches do not outvote the others.
  double min_sigma_px = 0.02;
  // False: the rotation that moves the pictures onto each other, as if nothing had translated.
  // Biased by parallax, but not led astray by a lens that is far off.
  bool with_translation = true;
};

// Rotation q_a_b from the matches of one pair, whatever the translation (Feng et al. section 3.2
// take it from the fundamental matrix). Minimises over rotation and translation direction together
//   sum rho( r_i^2 + s_i^2 ),  r_i = tau . n_i / sigma(tau . n_i) [px],  n_i = a_i x R b_i,
// r the distance from the epipolar line and s the distance from the epipole for matches on its
// wrong side (points behind the camera), without which the rms error one frame apart is 1.5 mrad
// instead of 0.9. rho is Geman and McClure's, at the spread of the residuals. No translation is
// fine.
//
// On ov_handheld_gs (every third pair, 0.3 px noise per observation, lens known), median / rms
// error per axis [mrad], against the 5-point algorithm of OpenCV and the rotation alone:
//     frames apart   this          5-point       rotation alone   this, f 15 % too long
//     1              0.64 / 0.93    3.0 / 740     2.6 / 2.6        1.1 / 1.6
//     2              0.57 / 0.86    4.0 / 610     5.3 / 5.3        1.7 / 2.6
//     4              0.57 / 0.80    3.0 / 339     10.6 / 10.7      2.9 / 5.2
// (the 5-point algorithm's rms is that of solutions turned by half a turn). With the lens's strong
// distortion unknown it is the worse choice: 7.7 / 19 against 5.5 / 6.9 of the rotation alone, two
// frames apart.
//
// sigma_rad is the standard deviation of an axis (rms of the three) from the normal equations and
// the residuals' spread. Squared error over its expectation, above: median 1.5, 0.9, 0.8 (0.8 is
// right), mean 5.9, 2.9, 1.8: where parallax hardly exceeds the noise it is too small now and then.
// It knows neither errors of the lens nor the rolling shutter.
//
// Nothing if fewer than min_matches have a ray, or the matches do not determine the rotation.
//
// motion: without a value, all directions are searched; with that of a lens nearby, its minimum is
// followed, which takes a fifth of the time. Holds the motion found, with translation, or nothing.
std::optional<CameraRotation> EstimateCameraRotation(
    const FramePair& pair, const Lens& lens_model, const LensParameters& lens,
    const TwoViewOptions& options = {}, std::optional<TwoViewMotion>* motion = nullptr);

// The same where the gyro is roughly aligned with the camera: of rays without what the rolling
// shutter did to them, and of the minima the one that is near the gyro's rotation. The rotation is
// between the times of the middle rows.
//
// Without it, rates that change while the rows are read look like parallax: on tools/sample (24 ms,
// rendered) the rotations' residuals are those of 35 px/s in the middle of the picture, with it
// (and the readout time that the start finds) 4 px/s (docs/lab/start.md).
std::optional<CameraRotation> EstimateCameraRotation(const FramePair& pair,
                                                     const GyroRotation& gyro,
                                                     const TwoViewOptions& options = {});

// Rotations between frames i and i + gap of attitudes made elsewhere (world -> camera, one per
// frame): q_a_b = q_cam_world[a] q_cam_world[b]^-1. Their error is not known: sigma_rad is 0.
std::vector<CameraRotation> CameraRotationsFromAttitudes(
    const std::vector<Eigen::Quaterniond>& q_cam_world, int gap);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_TWO_VIEW_ROTATION_H_
