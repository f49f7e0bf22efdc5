#include "tools/vins_tables/motion_truth.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/imu_integral.h"
#include "core/robust_statistics.h"
#include "core/time.h"

namespace camgyro {
namespace {

class Simulation final : public MotionTruth {
 public:
  Simulation(std::shared_ptr<const simulation::SimulatedCamera> camera,
             simulation::Scenario scenario)
      : camera_(std::move(camera)), scenario_(std::move(scenario)) {}

  std::optional<Stretch> Over(int64_t from_ns, int64_t to_ns) const override {
    const double end_s = scenario_.duration_s + 2.0 * scenario_.margin_s;
    if (SecondsSince(scenario_.start_ns, from_ns) < 0.0 ||
        SecondsSince(scenario_.start_ns, to_ns) > end_s) {
      return std::nullopt;
    }
    return [this](int64_t time_ns) {
      const simulation::CameraState camera =
          camera_->trajectory().At(SecondsSince(scenario_.start_ns, time_ns));
      const Eigen::Vector3d& arm = scenario_.mount.p_gyro_cam_m;
      const Eigen::Vector3d omega_gyro = scenario_.mount.q_gyro_cam * camera.omega_cam_rad_s;
      MotionState at;
      at.state.time_ns = time_ns;
      at.state.q_world_gyro =
          Eigen::Quaterniond(camera.R_world_cam) * scenario_.mount.q_gyro_cam.conjugate();
      at.state.p_world_m = camera.p_world_m - at.state.q_world_gyro * arm;
      at.state.v_world_m_s = camera.v_world_m_s - at.state.q_world_gyro * omega_gyro.cross(arm);
      at.gravity_m_s2 = {0.0, 9.80665, 0.0};
      return at;
    };
  }

 private:
  std::shared_ptr<const simulation::SimulatedCamera> camera_;
  simulation::Scenario scenario_;
};

class Fit final : public MotionTruth {
 public:
  Fit(const Recording& recording, const Calibration& truth, const VinsOptions& options,
      double span_s, double step_s, double* sigma_m_s) {
    const double duration_s =
        SecondsSince(recording.frames.front().stamp_ns, recording.frames.back().stamp_ns);
    std::vector<double> sigmas;
    for (double first_s = 0.0; first_s + span_s <= duration_s + 1e-6; first_s += step_s) {
      VinsInput input = CutVinsInput(recording, truth, first_s, first_s + span_s);
      const Result<VinsStart> start = InitialiseVins(input, options);
      if (!start || start->verdict != VinsVerdict::kReady) continue;
      for (size_t k = 0; k < start->states.size(); ++k) {
        const Eigen::Index row = start->StateRow(k) + 6;
        sigmas.push_back(std::sqrt(start->covariance.block<3, 3>(row, row).trace() / 3.0));
      }
      pieces_.push_back({*start,
                         ImuIntegral(input.gyro, input.accel, input.gyro.front().stamp_ns,
                                     start->calibration.bias_gyro_rad_s, start->bias_accel_m_s2),
                         input.gyro.front().stamp_ns});
    }
    if (sigma_m_s != nullptr) *sigma_m_s = sigmas.empty() ? 0.0 : MedianInPlace(&sigmas);
  }

  std::optional<Stretch> Over(int64_t from_ns, int64_t to_ns) const override {
    // The piece whose middle is nearest to that of the stretch.
    const Piece* best = nullptr;
    double best_s = 0.0;
    for (const Piece& piece : pieces_) {
      const int64_t first = piece.start.states.front().time_ns;
      const int64_t last = piece.start.states.back().time_ns;
      if (first > from_ns || last < to_ns) continue;
      const double off_s =
          std::abs(0.5 * (SecondsSince(first, from_ns) - SecondsSince(to_ns, last)));
      if (best == nullptr || off_s < best_s) {
        best = &piece;
        best_s = off_s;
      }
    }
    if (best == nullptr) return std::nullopt;
    return [best](int64_t time_ns) { return At(*best, time_ns); };
  }

 private:
  struct Piece {
    VinsStart start;
    ImuIntegral imu;
    int64_t origin_ns;
  };

  static MotionState At(const Piece& piece, int64_t time_ns) {
    const auto& states = piece.start.states;
    auto after = std::upper_bound(states.begin(), states.end(), time_ns,
                                  [](int64_t t, const VinsState& s) { return t < s.time_ns; });
    const VinsState& from = after == states.begin() ? *after : *(after - 1);
    const ImuDelta d = piece.imu.Between(SecondsSince(piece.origin_ns, from.time_ns),
                                         SecondsSince(piece.origin_ns, time_ns));
    MotionState at;
    at.gravity_m_s2 = piece.start.gravity_world_m_s2;
    at.state.time_ns = time_ns;
    at.state.q_world_gyro = from.q_world_gyro * d.q_i_j;
    at.state.v_world_m_s = from.v_world_m_s + at.gravity_m_s2 * d.dt_s + from.q_world_gyro * d.dv;
    at.state.p_world_m = from.p_world_m + from.v_world_m_s * d.dt_s +
                         0.5 * d.dt_s * d.dt_s * at.gravity_m_s2 + from.q_world_gyro * d.dp;
    return at;
  }

  std::vector<Piece> pieces_;
};

}  // namespace

std::unique_ptr<MotionTruth> SimulatedTruth(const simulation::Simulated& simulated,
                                            const simulation::Scenario& scenario) {
  return std::make_unique<Simulation>(simulated.camera, scenario);
}

std::unique_ptr<MotionTruth> FittedTruth(const Recording& recording, const Calibration& truth,
                                         const VinsOptions& options, double span_s, double step_s,
                                         double* sigma_m_s) {
  return std::make_unique<Fit>(recording, truth, options, span_s, step_s, sigma_m_s);
}

}  // namespace camgyro
