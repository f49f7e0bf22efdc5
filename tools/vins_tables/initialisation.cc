#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "core/imu_integral.h"
#include "core/time.h"
#include "estimator/start/slerp_delay_search.h"
#include "tools/vins_tables/vins_tables.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

constexpr double kWindowS = 2.0, kPropagationS = 10.0;
// Good enough to begin with: what VIO back ends recover from.
constexpr double kGoodScale = 0.10, kGoodGravityRad = 2.0 * M_PI / 180.0, kGoodVelocityMS = 0.15;

struct Errors {
  double scale = 0.0, gravity_rad = 0.0, velocity_m_s = 0.0, drift_m = 0.0;
};

struct Tally {
  int windows = 0, ready = 0, good = 0, false_ready = 0;
  std::vector<Errors> errors;  // of windows that gave a state
};

double Quantile(const std::vector<Errors>& errors, double Errors::*which, double share) {
  std::vector<double> values;
  for (const Errors& error : errors) values.push_back(std::abs(error.*which));
  if (values.empty()) return std::nan("");
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * (values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// All in the world of the estimate: the gyro frame at the first keyframe.
std::optional<Errors> ErrorsOf(const VinsStart& start, const RecordingWithTruth& r) {
  const int64_t end_ns = start.states.back().time_ns;
  const int64_t far_ns = StampAt(end_ns, kPropagationS);
  const auto truth = r.motion->Over(start.states.front().time_ns, far_ns);
  if (!truth || r.recording.gyro.back().stamp_ns < far_ns) return std::nullopt;
  const MotionState first = (*truth)(start.states.front().time_ns);
  const Eigen::Quaterniond q_first = first.state.q_world_gyro.conjugate();
  const auto position = [&](int64_t time_ns) {
    return Vector3d(q_first * ((*truth)(time_ns).state.p_world_m - first.state.p_world_m));
  };
  Errors errors;
  double along = 0.0, size = 0.0;
  for (const VinsState& state : start.states) {
    const Vector3d p = position(state.time_ns);
    along += p.dot(state.p_world_m);
    size += p.squaredNorm();
  }
  errors.scale = along / size - 1.0;
  const Vector3d gravity = q_first * first.gravity_m_s2;
  errors.gravity_rad = std::atan2(gravity.cross(start.gravity_world_m_s2).norm(),
                                  gravity.dot(start.gravity_world_m_s2));
  const VinsState& last = start.states.back();
  errors.velocity_m_s = (last.v_world_m_s - q_first * (*truth)(end_ns).state.v_world_m_s).norm();

  std::vector<GyroSample> gyro;
  std::vector<AccelSample> accel;
  const auto inside = [&](const auto& s) {
    return s.stamp_ns >= StampAt(end_ns, -0.1) && s.stamp_ns <= StampAt(far_ns, 0.1);
  };
  std::copy_if(r.recording.gyro.begin(), r.recording.gyro.end(), std::back_inserter(gyro), inside);
  std::copy_if(r.recording.accel.begin(), r.recording.accel.end(), std::back_inserter(accel),
               inside);
  const ImuIntegral imu(gyro, accel, end_ns, start.calibration.bias_gyro_rad_s,
                        start.bias_accel_m_s2);
  const ImuDelta d = imu.Between(0.0, kPropagationS);
  const Vector3d moved = last.v_world_m_s * kPropagationS +
                         0.5 * kPropagationS * kPropagationS * start.gravity_world_m_s2 +
                         last.q_world_gyro * d.dp;
  errors.drift_m = (moved - (position(far_ns) - position(end_ns))).norm();
  return errors;
}

// What a VIO without our delay believes: it comes as it is, exactly.
Calibration WithDelay(const Calibration& calibrated, double delay_s) {
  Calibration c = calibrated;
  c.delay_s = delay_s;
  c.readout_s = 0.0;  // VINS-Mono knows no rolling shutter
  for (const int i : {kStateDelay, kStateReadout}) {
    c.covariance.row(i).setZero();
    c.covariance.col(i).setZero();
  }
  return c;
}

void Add(const Result<VinsStart>& start, const RecordingWithTruth& r, Tally* tally) {
  if (!start || start->states.empty()) return;
  const bool ready = start->verdict == VinsVerdict::kReady;
  tally->ready += ready;
  const std::optional<Errors> errors = ErrorsOf(*start, r);
  if (!errors) return;
  const bool good = std::abs(errors->scale) < kGoodScale && errors->gravity_rad < kGoodGravityRad &&
                    errors->velocity_m_s < kGoodVelocityMS;
  tally->good += ready && good;
  tally->false_ready += ready && !good;
  tally->errors.push_back(*errors);
}

void Print(const std::string& name, const char* way, const Tally& t) {
  const double share = 100.0 / std::max(1, t.windows);
  const double deg = 180.0 / M_PI;
  std::printf(
      "| %s | %s | %d | %.0f %% | %.0f %% | %.0f %% | %.1f / %.1f %% | %.2f / %.2f | %.3f / %.3f | "
      "%.1f / %.1f |\n",
      name.c_str(), way, t.windows, share * static_cast<double>(t.errors.size()), share * t.good,
      share * t.false_ready, 100.0 * Quantile(t.errors, &Errors::scale, 0.5),
      100.0 * Quantile(t.errors, &Errors::scale, 0.9),
      deg * Quantile(t.errors, &Errors::gravity_rad, 0.5),
      deg * Quantile(t.errors, &Errors::gravity_rad, 0.9),
      Quantile(t.errors, &Errors::velocity_m_s, 0.5),
      Quantile(t.errors, &Errors::velocity_m_s, 0.9), Quantile(t.errors, &Errors::drift_m, 0.5),
      Quantile(t.errors, &Errors::drift_m, 0.9));
  std::fflush(stdout);
}

}  // namespace

void TabulateInitialisation(const RecordingWithTruth& r, const Calibration& calibrated,
                            double step_s) {
  const std::vector<CameraRotation> rotations = NeighbourRotations(r.recording, calibrated);
  const int64_t begin_ns = r.recording.frames.front().stamp_ns;
  const double duration_s = SecondsSince(begin_ns, r.recording.frames.back().stamp_ns);
  Tally ignored, feng, full;
  for (double first_s = 0.0; first_s + kWindowS + kPropagationS + 0.5 <= duration_s;
       first_s += step_s) {
    const auto initialise = [&](const Calibration& c) {
      return InitialiseVins(CutVinsInput(r.recording, c, first_s, first_s + kWindowS), r.options);
    };
    // Without a reference that fitted nothing can be compared.
    const Result<VinsStart> start = initialise(calibrated);
    const int64_t window_ns = StampAt(begin_ns, first_s + calibrated.delay_s);
    if (!r.motion->Over(StampAt(window_ns, -0.05),
                        StampAt(window_ns, kWindowS + kPropagationS + 0.1))) {
      continue;
    }
    for (Tally* tally : {&ignored, &feng, &full}) ++tally->windows;
    Add(start, r, &full);
    Add(initialise(WithDelay(calibrated, 0.0)), r, &ignored);

    SlerpOptions slerp;  // as in the paper: 50 pairs, +-0.5 s
    const auto window_begin =
        std::find_if(rotations.begin(), rotations.end(), [&](const CameraRotation& rotation) {
          const Frame& frame = r.recording.frames[static_cast<size_t>(rotation.frame_a)];
          return SecondsSince(begin_ns, frame.stamp_ns) >= first_s;
        });
    const Result<SlerpDelay> delay =
        SlerpDelaySearch(r.recording, rotations, static_cast<int>(window_begin - rotations.begin()),
                         calibrated.q_gyro_cam, calibrated.bias_gyro_rad_s, slerp);
    if (delay) Add(initialise(WithDelay(calibrated, delay->delay_s)), r, &feng);
  }
  Print(r.name, "none", ignored);
  Print(r.name, "Feng's search", feng);
  Print(r.name, "full", full);
}

}  // namespace camgyro
