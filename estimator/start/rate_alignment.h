// How well the camera's rotations fit the gyro at one lag, whatever the orientation and the bias.
#ifndef CAMGYRO_ESTIMATOR_START_RATE_ALIGNMENT_H_
#define CAMGYRO_ESTIMATOR_START_RATE_ALIGNMENT_H_

#include <Eigen/Core>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Gyro samples as arrays. Times [s] from the first gyro stamp; rates [rad/s] as columns.
struct GyroRates {
  explicit GyroRates(const std::vector<GyroSample>& gyro);

  // White noise of the mean rate over an interval [rad/s], one axis, from the second differences of
  // the samples: motion is smooth at the gyro's rate, vibration is not.
  double Noise(double interval_s) const;

  std::vector<double> times_s;
  Eigen::Matrix3Xd omega_gyro_rad_s;
};

// Camera rotations as mean rates over their intervals.
struct CameraRates {
  std::vector<double> frame_times_s;  // all frames, from the first frame's stamp
  std::vector<int> frame_a, frame_b;  // one entry per pair
  Eigen::Matrix3Xd omega_cam_rad_s;   // Log(q_a_b) / interval, 3 x pairs
  Eigen::VectorXd weight;             // inverse variance of their noise and the gyro's; median 1

  int size() const { return static_cast<int>(frame_a.size()); }
  double interval_s(int pair) const {
    return frame_times_s[frame_b[pair]] - frame_times_s[frame_a[pair]];
  }
};

// Both clocks start at their own first stamp here; `lag` is what is left between them:
//   t_gyro - (first gyro stamp) = t_camera - (first frame stamp) + lag
class RateAlignment {
 public:
  // Pairs with a hole in the gyro (core/gyro_gap.h) are left out.
  RateAlignment(GyroRates gyro, CameraRates camera);

  // Least squares over rotation, bias and one scale: w_gyro = scale * R_gyro_cam * w_cam + bias.
  struct Fit {
    int pairs = 0;  // inside the gyro's time
    Eigen::Matrix3d R_gyro_cam = Eigen::Matrix3d::Identity();
    Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();  // with scale 1
    // Fraction of the gyro's (weighted, mean removed) power that the fit explains, 0..1; the
    // second for the best improper matrix (determinant -1).
    double explained = 0.0;
    double explained_mirrored = 0.0;
    Eigen::Matrix3d mirrored = -Eigen::Matrix3d::Identity();
    double rate_ratio =
        0.0;  // size of gyro rates / size of camera rates; not biased by camera noise
    double gyro_rms_rad_s = 0.0;  // about the mean, norm of the vector
    double cam_rms_rad_s = 0.0;
  };
  // Closed form: Wahba's problem by Kabsch's SVD on the centred rates. `pair_weight` multiplies the
  // weights (empty: none). Pairs beyond the gyro's ends are left out; pairs == 0 if none is left.
  Fit At(double lag_s, const Eigen::VectorXd& pair_weight) const;

  // Mean gyro rate [rad/s] of each pair's interval shifted by lag, and whether the gyro covers it.
  void MeanGyroRates(double lag_s, Eigen::Matrix3Xd* omega_gyro_rad_s,
                     std::vector<char>* covered) const;

  const GyroRates& gyro() const { return gyro_; }
  const CameraRates& camera() const { return camera_; }

 private:
  GyroRates gyro_;
  CameraRates camera_;
  Eigen::Matrix3Xd integral_;     // of the rates from the first sample [rad]: linear in between
  std::vector<int> gaps_;         // number of holes before each sample
  std::vector<int> used_frames_;  // ascending; frames that any pair needs
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_RATE_ALIGNMENT_H_
