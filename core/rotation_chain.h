// Rotations of the gyro from its rates: ordered products, eq. (5)-(6) of Jia & Evans, with prefix
// products, so that one look-up costs the same however many rates lie before it.
#ifndef CAMGYRO_CORE_ROTATION_CHAIN_H_
#define CAMGYRO_CORE_ROTATION_CHAIN_H_

#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace camgyro {

// What a RotationChain wants of a gyro sample, given the samples before and after it: the straight
// lines between these values have the integrals of the curve through the samples (Gregory's rule,
// to fourth order in the sampling interval h). Straight lines between the samples themselves lose
// (2 pi nu h)^2 / 12 of what turns at frequency nu, and a focal length from them is as much too
// long: 4e-4 at 200 Hz in the simulator's running.
inline Eigen::Vector3d ChainRate(const Eigen::Vector3d& before, const Eigen::Vector3d& rate,
                                 const Eigen::Vector3d& after, double interval_before_s,
                                 double interval_after_s) {
  const double p = interval_before_s, n = interval_after_s;
  // (p^3 + n^3) / (p + n) / 12 times the second derivative; bounded, for samples with one stamp.
  const double uneven = std::min(3.0, (p * p - p * n + n * n) / (p * n));
  return rate - uneven / (6.0 * (p + n)) * (p * (after - rate) - n * (rate - before));
}

// R_ref_gyro(t): maps vectors of the gyro frame at t into the gyro frame at the first sample.
//
// Between two given rates (ChainRate) the rate is linear in time (the paper holds it constant,
// which delays the gyro by half a sampling interval); its integral theta(t) over a segment gives
// Exp(theta). What this neglects, the commutator of the two rates, is dt^2/12 |w0 x w1| <= 1e-5 rad
// per segment at 100 Hz and 10 rad/s^2. Before the first and after the last sample the rate is
// held.
class RotationChain {
 public:
  // What an observation at one time needs, and what its derivatives need.
  struct State {
    Eigen::Matrix3d R_ref_gyro;
    Eigen::Vector3d omega_gyro_rad_s;
    Eigen::Vector3d alpha_gyro_rad_s2;  // slope of the rate
    int segment = 0;                    // rates `segment` and `segment + 1` are interpolated
    double weight_next = 0.0;           // omega = (1 - w) omega[segment] + w omega[segment + 1]
    double theta_this_s = 0.0, theta_next_s = 0.0;  // theta = sum of these times the two rates
    Eigen::Matrix3d J_phi_theta;  // left perturbation of R_ref_gyro by the partial theta

    // Left perturbation of R_ref_gyro per second: R_ref_gyro * omega, up to the commutator.
    Eigen::Vector3d PhiPerSecond() const { return J_phi_theta * omega_gyro_rad_s; }
  };

  // times_s: strictly increasing, at least two. Rates [rad/s] as columns. value_of: neighbouring
  // rates may follow one value, which is added to them; its number for each rate, from 0 on and
  // ascending by 0 or 1. Empty: each rate has its own.
  RotationChain(const std::vector<double>& times_s, const Eigen::Matrix3Xd& omega_gyro_rad_s,
                const std::vector<int>& value_of = {});

  int size() const { return static_cast<int>(times_s_.size()); }
  int num_values() const { return value_of_.back() + 1; }
  const std::vector<double>& times_s() const { return times_s_; }

  // The second writes where the state is kept, which saves a copy of it for each bearing.
  State At(double time_s) const {
    State state;
    At(time_s, &state);
    return state;
  }
  void At(double time_s, State* state) const;

  using RateGradient = Eigen::Ref<Eigen::Matrix3Xd, 0, Eigen::OuterStride<3>>;  // without gaps
  // Adds to `gradient` (3 x num_values) the derivative of a scalar by every value, given its
  // derivatives by the left perturbation phi of R_ref_gyro and by the rate at that time. Columns
  // after the value of rate state.segment + 1 stay untouched.
  void AddRateGradient(const State& state, const Eigen::Vector3d& by_phi,
                       const Eigen::Vector3d& by_omega, RateGradient gradient) const;

 private:
  std::vector<double> times_s_;
  Eigen::Matrix3Xd omega_;
  std::vector<Eigen::Matrix3d> prefix_;  // R_ref_gyro at each sample
  std::vector<int> value_of_;
  // Transposed derivatives of the left perturbation of R_ref_gyro, three rows each: at sample k, by
  // the value of its rate, through the segments before it; and by a value through all segments.
  Eigen::Matrix<double, Eigen::Dynamic, 3> until_, whole_;
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_ROTATION_CHAIN_H_
