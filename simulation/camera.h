// The simulated camera: lens, rolling shutter and stabilisers, with every effect of the catalogue
// that changes them. Shares with the estimator only the radial-tangential lens.
#ifndef CAMGYRO_SIMULATION_CAMERA_H_
#define CAMGYRO_SIMULATION_CAMERA_H_

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/lens.h"
#include "simulation/scenario.h"
#include "simulation/trajectory.h"

namespace camgyro::simulation {

// Seconds are after the first gyro stamp; stamp_s is on the camera's clock, minus that stamp.
struct FrameTiming {
  double stamp_s = 0.0;  // true stamp; the recorded one may jitter
  double exposure_s = 0.0;
  Eigen::Matrix3d R_world_virtual;  // electronic stabilisation: of the delivered picture
};

class SimulatedCamera {
 public:
  SimulatedCamera(const Scenario& scenario, std::shared_ptr<const Trajectory> trajectory);

  FrameTiming MakeFrame(double stamp_s, double exposure_s) const;

  // t_d of a frame, with all effects of the clock [s].
  double Delay(const FrameTiming& frame) const;

  // Middle of the exposure of a pixel, on the gyro clock: stamp + delay + t_r * curve(row).
  // The pixel is that of the sensor, before electronic stabilisation.
  double ExposureTime(const FrameTiming& frame, const Eigen::Vector2d& px) const;

  // Derivative of ExposureTime by the pixel [s/px].
  Eigen::RowVector2d ExposureSlope(const Eigen::Vector2d& px) const;

  // Sensor pixel of a point in the camera frame, and back (a ray with z = 1).
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point_cam, double time_s) const;
  std::optional<Eigen::Vector3d> Unproject(const Eigen::Vector2d& px, double time_s) const;

  // Focal length of the rows at a time [px].
  double Focal(double time_s) const;

  // Optical stabilisation: where the principal point is, from where it would be without [px].
  Eigen::Vector2d StabiliserShift(double time_s) const;

  struct Observation {
    Eigen::Vector2d sensor_px;
    Eigen::Vector2d averaging_px;  // of it, what the mean over the exposure makes
    double time_s = 0.0;           // exposure of that pixel
    double depth_m = 0.0;          // along the optical axis
  };
  // Where and when a point is seen: solves time = ExposureTime(pixel of the point at time) to
  // 1e-13 s. Nothing if the point is behind the camera, off the picture, or has no solution.
  std::optional<Observation> Observe(
      const FrameTiming& frame, const std::function<Eigen::Vector3d(double)>& point_world) const;

  // Electronic stabilisation: sensor pixel -> pixel of the delivered picture. The identity without.
  std::optional<Eigen::Vector2d> Stabilise(const FrameTiming& frame,
                                           const Eigen::Vector2d& sensor_px) const;
  // And back. Nothing where the sensor has no such pixel.
  std::optional<Eigen::Vector2d> Destabilise(const FrameTiming& frame,
                                             const Eigen::Vector2d& picture_px) const;
  bool stabilises() const { return scenario_.effects.electronic_stabilisation.strength != 0.0; }

  bool InPicture(const Eigen::Vector2d& px) const;
  const Trajectory& trajectory() const { return *trajectory_; }
  const Scenario& scenario() const { return scenario_; }

 private:
  LensParameters LensAt(double time_s) const;
  // Effect exposure_lowpass: where a point is on average while the pixel is exposed; px itself
  // without. Nothing where it has no pixel.
  std::optional<Eigen::Vector2d> MeanOverExposure(
      const FrameTiming& frame, const std::function<Eigen::Vector3d(double)>& point_world,
      const Eigen::Vector2d& px, double time_s) const;
  Eigen::Matrix3d SmoothedOrientation(double time_s) const;
  Eigen::Matrix3d Correction(const FrameTiming& frame, double time_s) const;

  Scenario scenario_;
  std::shared_ptr<const Trajectory> trajectory_;
  LensParameters lens_;
  struct HighPassed {  // camera's rotation about x, y; for the optical stabilisation
    Eigen::Vector2d angle_rad, rate_rad_s;
  };
  std::vector<HighPassed> high_passed_;
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_CAMERA_H_
