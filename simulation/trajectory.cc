#include "simulation/trajectory.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/so3.h"

namespace camgyro::simulation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Derivatives {
  double value = 0.0, first = 0.0, second = 0.0;
  Derivatives& operator+=(const Derivatives& other) {
    value += other.value;
    first += other.first;
    second += other.second;
    return *this;
  }
};

// Sum of sinusoids, with its derivatives.
class Wave {
 public:
  void Add(double amplitude, double frequency_hz, double phase_rad) {
    if (amplitude == 0.0) return;
    terms_.push_back({amplitude, 2.0 * M_PI * frequency_hz, phase_rad});
  }

  // Random phases; `rate_rms` is the exact rms of the first derivative over a long time, spread
  // evenly over the band.
  void AddBand(double rate_rms, const Eigen::Vector2d& band_hz, std::mt19937_64* random) {
    constexpr int kTerms = 16;
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int i = 0; i < kTerms; ++i) {
      const double place = (i + unit(*random)) / kTerms;
      const double frequency_hz = band_hz[0] + (band_hz[1] - band_hz[0]) * place;
      const double phase = 2.0 * M_PI * unit(*random);
      Add(rate_rms * std::sqrt(2.0 / kTerms) / (2.0 * M_PI * frequency_hz), frequency_hz, phase);
    }
  }

  Derivatives At(double time_s) const {
    Derivatives sum;
    for (const Term& term : terms_) {
      const double angle = term.omega * time_s + term.phase;
      const double sine = term.amplitude * std::sin(angle);
      sum.value += sine;
      sum.first += term.amplitude * term.omega * std::cos(angle);
      sum.second -= term.omega * term.omega * sine;
    }
    return sum;
  }

 private:
  struct Term {
    double amplitude, omega, phase;
  };
  std::vector<Term> terms_;
};

// R_world_cam = R_y(yaw) R_x(pitch) R_z(roll), each a wave, the yaw with the turning of the path.
class WaveTrajectory final : public Trajectory {
 public:
  WaveTrajectory(const MotionOptions& motion, double shake_m_s, std::mt19937_64* random) {
    std::uniform_real_distribution<double> phase(0.0, 2.0 * M_PI);
    for (int axis = 0; axis < 3; ++axis) {
      angle_[axis].AddBand(motion.rotation_rms_rad_s[axis], motion.rotation_band_hz, random);
      sway_[axis].AddBand(motion.sway_rms_m_s / std::sqrt(3.0), motion.sway_band_hz, random);
    }
    const double pan_amplitude =
        motion.pan_rms_rad_s * std::sqrt(2.0) * motion.pan_period_s / (2.0 * M_PI);
    angle_[1].Add(pan_amplitude, 1.0 / motion.pan_period_s, phase(*random));
    const double step_phase = phase(*random);
    sway_[1].Add(motion.step_bounce_m, motion.step_hz, step_phase);
    sway_[0].Add(0.5 * motion.step_bounce_m, 0.5 * motion.step_hz, 0.5 * step_phase);
    angle_[0].Add(motion.step_nod_rad, motion.step_hz, step_phase + 1.0);
    angle_[2].Add(0.5 * motion.step_nod_rad, 0.5 * motion.step_hz, 0.5 * step_phase + 1.0);
    for (Wave& wave : sway_) wave.AddBand(shake_m_s / std::sqrt(3.0), {3.0, 8.0}, random);

    const double heading = motion.heading_deg * M_PI / 180.0;
    ahead_ = {std::sin(heading), 0.0, std::cos(heading)};
    right_ = {std::cos(heading), 0.0, -std::sin(heading)};
    speed_m_s_ = motion.speed_m_s;
    radius_m_ = motion.path_radius_m;
  }

  CameraState At(double time_s) const override {
    Derivatives pitch = angle_[0].At(time_s), yaw = angle_[1].At(time_s);
    const Derivatives roll = angle_[2].At(time_s);
    CameraState state;
    for (int axis = 0; axis < 3; ++axis) {
      const Derivatives sway = sway_[axis].At(time_s);
      state.p_world_m[axis] = sway.value;
      state.v_world_m_s[axis] = sway.first;
      state.a_world_m_s2[axis] = sway.second;
    }
    if (radius_m_ > 0.0) {  // a circle about the origin
      const double turn_rad_s = speed_m_s_ / radius_m_;
      const double phi = turn_rad_s * time_s;
      yaw += {phi, turn_rad_s, 0.0};
      const Vector3d tangent = std::cos(phi) * ahead_ + std::sin(phi) * right_;
      const Vector3d outward = std::sin(phi) * ahead_ - std::cos(phi) * right_;
      state.p_world_m += radius_m_ * outward;
      state.v_world_m_s += speed_m_s_ * tangent;
      state.a_world_m_s2 -= speed_m_s_ * turn_rad_s * outward;
    } else {
      state.p_world_m += speed_m_s_ * time_s * ahead_;
      state.v_world_m_s += speed_m_s_ * ahead_;
    }

    state.R_world_cam = (Eigen::AngleAxisd(yaw.value, Vector3d::UnitY()) *
                         Eigen::AngleAxisd(pitch.value, Vector3d::UnitX()) *
                         Eigen::AngleAxisd(roll.value, Vector3d::UnitZ()))
                            .toRotationMatrix();
    // Axes of the three turns in the camera frame, and their derivatives.
    const double sin_p = std::sin(pitch.value), cos_p = std::cos(pitch.value);
    const double sin_r = std::sin(roll.value), cos_r = std::cos(roll.value);
    const Vector3d yaw_axis(sin_r * cos_p, cos_r * cos_p, -sin_p);
    const Vector3d pitch_axis(cos_r, -sin_r, 0.0);
    const Vector3d yaw_axis_rate(cos_r * cos_p * roll.first - sin_r * sin_p * pitch.first,
                                 -sin_r * cos_p * roll.first - cos_r * sin_p * pitch.first,
                                 -cos_p * pitch.first);
    const Vector3d pitch_axis_rate = Vector3d(-sin_r, -cos_r, 0.0) * roll.first;
    state.omega_cam_rad_s =
        yaw_axis * yaw.first + pitch_axis * pitch.first + Vector3d::UnitZ() * roll.first;
    state.alpha_cam_rad_s2 = yaw_axis * yaw.second + yaw_axis_rate * yaw.first +
                             pitch_axis * pitch.second + pitch_axis_rate * pitch.first +
                             Vector3d::UnitZ() * roll.second;
    return state;
  }

 private:
  Wave angle_[3];  // pitch about x, yaw about y, roll about z
  Wave sway_[3];
  Vector3d ahead_, right_;
  double speed_m_s_, radius_m_;
};

// Moves as one trajectory and turns as another.
class TurnedTrajectory final : public Trajectory {
 public:
  TurnedTrajectory(std::shared_ptr<const Trajectory> path, std::shared_ptr<const Trajectory> turns)
      : path_(std::move(path)), turns_(std::move(turns)) {}

  CameraState At(double time_s) const override {
    CameraState state = path_->At(time_s);
    const CameraState turned = turns_->At(time_s);
    state.R_world_cam = turned.R_world_cam;
    state.omega_cam_rad_s = turned.omega_cam_rad_s;
    state.alpha_cam_rad_s2 = turned.alpha_cam_rad_s2;
    return state;
  }

 private:
  const std::shared_ptr<const Trajectory> path_, turns_;
};

}  // namespace

Result<std::shared_ptr<const Trajectory>> MakeTrajectory(const Scenario& scenario,
                                                         std::mt19937_64* random) {
  if (scenario.motion.kind == MotionKind::kFile) {
    Eigen::Isometry3d T_pose_cam = Eigen::Isometry3d::Identity();
    if (scenario.motion.file_is_body) {
      T_pose_cam.linear() = scenario.mount.q_gyro_cam.toRotationMatrix();
      T_pose_cam.translation() = scenario.mount.p_gyro_cam_m;
    }
    return ReadTrajectory(scenario.motion.file, scenario.motion.file_knot_s, T_pose_cam);
  }
  auto waves = std::make_shared<WaveTrajectory>(
      scenario.motion, scenario.effects.translation_acceleration.shake_m_s, random);
  if (scenario.log == nullptr) return waves;
  return std::make_shared<TurnedTrajectory>(std::move(waves),
                                            TurnsOfLog(*scenario.log, scenario.mount.q_gyro_cam));
}

}  // namespace camgyro::simulation
