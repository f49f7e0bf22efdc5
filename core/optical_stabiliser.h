// How a stabilised lens follows the camera's turns.
#ifndef CAMGYRO_CORE_OPTICAL_STABILISER_H_
#define CAMGYRO_CORE_OPTICAL_STABILISER_H_

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace camgyro {

// A stabiliser: the corner frequency below which it lets the picture turn, and how far its lens
// goes, as an angle of the picture. A Pixel's log (docs/lab/device_logs.md) has 0.5 Hz, 0.025 rad.
struct OpticalStabiliser {
  double corner_hz = 0.0;
  double travel_rad = std::numeric_limits<double>::infinity();
  // Of the circle of the stops, about the camera's x and y axes, from where the lens rests [rad].
  Eigen::Vector2d centre_rad = Eigen::Vector2d::Zero();
};

// By name, CORNER or CORNER/TRAVEL; none for any other text.
std::optional<OpticalStabiliser> StabiliserOf(const std::string& name);
std::string NameOf(const OpticalStabiliser& stabiliser);

// The angle that the lens makes up for at the times of some rates, about the camera's x and y axes
// [rad]: angle' = omega - 2 pi corner angle, exact for rates that are linear between samples up to
// the second order of the step, and never further from the stops' centre than the lens goes:
// what is beyond is lost, so that the lens leaves its stop as soon as the camera turns back. After
// a hole in the rates nobody knows where the lens is: the angle begins anew, at zero.
//   times_s: ascending; omega_cam_rad_s: about the camera's axes, one column per time
Eigen::Matrix2Xd StabilisedAngle(const std::vector<double>& times_s,
                                 const Eigen::Matrix3Xd& omega_cam_rad_s,
                                 const OpticalStabiliser& stabiliser);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_OPTICAL_STABILISER_H_
