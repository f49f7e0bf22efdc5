// The implicit extended Kalman filter of Jia & Evans (2013), as printed: the filter that this
// project wants to surpass. To be read beside the paper; equation numbers are the paper's.
#ifndef CAMGYRO_ESTIMATOR_REFERENCE_IMPLICIT_EKF_H_
#define CAMGYRO_ESTIMATOR_REFERENCE_IMPLICIT_EKF_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include "core/calibration.h"
#include "core/pair_model.h"
#include "core/recording.h"

namespace camgyro {

struct EkfOptions {
  // Printed in section V.C.
  double sigma_px = 1.0;            // feature detection error, per coordinate
  double sigma_gyro_rad_s = 0.003;  // gyro measurement noise of one reading, per axis

  // The paper is silent; what was chosen.
  int triplets = 100;                   // N, per pair of frames
  double bias_walk_rad_s2_rtHz = 1e-4;  // random walk of b_g
  uint64_t seed = 1;                    // of the random triplets

  // Not in the paper: what makes a filter fair. Off by default.
  double gate_sigmas = 0.0;  // measurements whose innovation is larger are dropped; 0: none
  int iterations = 1;        // of the update, each linearised at the last one's result
};

// The initial values and standard deviations of section V.C around a guess of f and q_c: c the
// centre of the picture, t_r 27.5 ms, t_d and b_g zero. `guess`: resolution, lens, q_gyro_cam are
// used. The rotation's sigma is that of quaternion elements, doubled: an angle.
Prior PaperStart(const Calibration& guess);

class ImplicitEkf {
 public:
  // prior: values with their initial standard deviations.
  ImplicitEkf(const Prior& prior, const EkfOptions& options);

  // Gyro readings in time order, seconds from the filter's origin.
  void AddReading(double time_s, const Eigen::Vector3d& omega_gyro_rad_s);

  enum class UpdateResult {
    kUpdated,
    kGyroTooLate,    // the readings do not reach to the end of the pair yet: come again
    kGyroTooEarly,   // or begin after it began
    kTooFewMatches,  // fewer than three with a ray
    kNotPositive,    // predicted only: the innovation's covariance is singular
  };
  // One prediction and one update, for frames with these recorded stamps [s from the origin].
  [[nodiscard]] UpdateResult Update(double time_a_s, double time_b_s,
                                    const std::vector<Match>& matches);

  // One group of three features each, by their place among the matches.
  struct Pair {
    double time_a_s = 0.0, time_b_s = 0.0;
    std::vector<Match> matches;
    std::vector<std::array<size_t, 3>> triplets;
  };
  // The N implicit measurements (9) linearised at a state: 0 = h + H (x - x_lin) + noise.
  struct Measurement {
    Eigen::VectorXd h;         // determinants of normalised rays
    Eigen::MatrixXd H;         // N x size of the state
    Eigen::VectorXd variance;  // of h, by the detection errors
  };
  // False where a match has no ray.
  [[nodiscard]] bool Measure(const Pair& pair, const Eigen::VectorXd& x, Measurement* out) const;

  // With covariance: quaternion elements turned into angles.
  Calibration Estimate() const;

  // The state (7): x = [ f, c_x, c_y, t_r, t_d, b_g, q_c, w_1 ... w_M ], rates in the gyro frame,
  // q_c as its four elements [x y z w].
  enum StateRow : int { kF, kC, kTr = 3, kTd, kBg, kQc = 8, kRates = 12 };
  const Eigen::VectorXd& state() const { return x_; }
  const Eigen::MatrixXd& covariance() const { return P_; }
  int num_rates() const { return static_cast<int>(x_.size() - kRates) / 3; }  // M

 private:
  struct Reading {
    double time_s = 0.0;
    Eigen::Vector3d omega_gyro_rad_s;
  };

  void Predict(int64_t first, int64_t last, double time_b_s);
  bool Correct(const Pair& pair);
  LensParameters LensOf(const Eigen::VectorXd& x) const;
  const Reading& reading(int64_t number) const {
    return readings_[static_cast<size_t>(number - first_reading_)];
  }

  const EkfOptions options_;
  const Calibration start_;  // what is not estimated: resolution, aspect ratio, distortion
  Eigen::VectorXd x_;
  Eigen::MatrixXd P_;
  std::deque<Reading> readings_;
  int64_t first_reading_ = 0;  // number of readings_.front()
  int64_t first_rate_ = 0;     // reading that w_1 belongs to
  double last_time_s_ = 0.0;   // of the last prediction, on the camera's clock
  bool started_ = false;
  std::mt19937_64 random_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_REFERENCE_IMPLICIT_EKF_H_
