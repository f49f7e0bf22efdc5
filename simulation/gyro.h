// The simulated gyro and accelerometer, with every effect of the catalogue that changes them.
#ifndef CAMGYRO_SIMULATION_GYRO_H_
#define CAMGYRO_SIMULATION_GYRO_H_

#include <Eigen/Core>
#include <random>
#include <vector>

#include "core/recording.h"
#include "simulation/scenario.h"
#include "simulation/trajectory.h"

namespace camgyro::simulation {

struct SimulatedGyro {
  std::vector<GyroSample> gyro;
  std::vector<AccelSample> accel;
  // Bias with its walk and drift, for every sample before any is dropped [rad/s], and when [s].
  std::vector<double> times_s;
  std::vector<Eigen::Vector3d> bias_rad_s;
};

// Samples from 0 to duration + 2 margins, or as the log has them.
//   w = Clip( (I + diag(scale) + S) LowPass(w_true) + b + noise ), then rounded to the quantum
SimulatedGyro SimulateGyro(const Scenario& scenario, const Trajectory& trajectory,
                           std::mt19937_64* random);

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_GYRO_H_
