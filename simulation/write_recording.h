// Writes a simulated recording as files, in the layout of docs/recording_format.md.
#ifndef CAMGYRO_SIMULATION_WRITE_RECORDING_H_
#define CAMGYRO_SIMULATION_WRITE_RECORDING_H_

#include <functional>
#include <string>

#include "core/result.h"
#include "simulation/simulate.h"

namespace camgyro::simulation {

// Writes into `folder` (made if absent; an older recording of the same kind is replaced, one of
// another kind is an error)
//
//   cam0/data.csv, cam0/sensor.yaml, imu0/data.csv, imu0/sensor.yaml
//
//   cam0/tracks.csv        without a video: those of `simulated`, or made while they are written
//
//   cam0/video.mp4,        rendered, by scenario.video.format
//   cam0/data/*.png
//
//   cam0/lens_shift.csv    if the recording has it
//
//   truth.yaml             keys of calibration.yaml, without sigmas and covariance
//
//   truth_trajectory.csv   one row per frame; EuRoC ground truth first, so that it can serve as
//                          motion.file
//
//   truth_trajectory.tum   the gyro frame at every frame's middle row, as odometry has it
//
// The same scenario gives the same bytes. `progress` is told the frames done, if given.
Status WriteRecording(const Simulated& simulated, const Scenario& scenario,
                      const std::string& folder,
                      const std::function<void(size_t done, size_t all)>& progress = {});

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_WRITE_RECORDING_H_
