#include "core/optical_stabiliser.h"

#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "core/format.h"

namespace camgyro {

std::optional<OpticalStabiliser> StabiliserOf(const std::string& name) {
  OpticalStabiliser s;
  char* end = nullptr;
  s.corner_hz = std::strtod(name.c_str(), &end);
  if (name.empty() || !(s.corner_hz > 0.0)) return std::nullopt;
  if (*end == '/') {
    s.travel_rad = std::strtod(end + 1, &end);
    if (!(s.travel_rad > 0.0)) return std::nullopt;
  }
  if (*end != 0) return std::nullopt;
  return s;
}

std::string NameOf(const OpticalStabiliser& stabiliser) {
  const std::string corner = Format("%.3g", stabiliser.corner_hz);
  return std::isfinite(stabiliser.travel_rad) ? corner + Format("/%.3g", stabiliser.travel_rad)
                                              : corner;
}

Eigen::Matrix2Xd StabilisedAngle(const std::vector<double>& times_s,
                                 const Eigen::Matrix3Xd& omega_cam_rad_s,
                                 const OpticalStabiliser& stabiliser) {
  constexpr double kHole_s = 0.25;  // at corners of 0.5 Hz a lens has forgotten half of its angle
  const double a = 2.0 * M_PI * stabiliser.corner_hz;
  const auto n = static_cast<Eigen::Index>(times_s.size());
  Eigen::Matrix2Xd angle = Eigen::Matrix2Xd::Zero(2, n);
  for (Eigen::Index i = 1; i < n; ++i) {
    const double dt = times_s[static_cast<size_t>(i)] - times_s[static_cast<size_t>(i) - 1];
    if (dt > kHole_s) continue;
    const double decay = std::exp(-a * dt);
    const Eigen::Vector2d input =
        0.5 * (decay * omega_cam_rad_s.col(i - 1) + omega_cam_rad_s.col(i)).head<2>();
    angle.col(i) = decay * angle.col(i - 1) + dt * input;
    const Eigen::Vector2d off_centre = angle.col(i) - stabiliser.centre_rad;
    const double size = off_centre.norm();
    if (size > stabiliser.travel_rad) {
      angle.col(i) = stabiliser.centre_rad + stabiliser.travel_rad / size * off_centre;
    }
  }
  return angle;
}

}  // namespace camgyro
