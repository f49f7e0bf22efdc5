// What tests of the calibrator share: a lively recording, options for it, and feeding.
#ifndef CAMGYRO_TESTS_CAMGYRO_FEED_CALIBRATOR_H_
#define CAMGYRO_TESTS_CAMGYRO_FEED_CALIBRATOR_H_

#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "camgyro/calibrator.h"
#include "core/recording.h"
#include "simulation/simulate.h"

namespace camgyro::api {

inline simulation::Scenario LivelyScenario(double duration_s) {
  simulation::Scenario scenario;
  scenario.duration_s = duration_s;
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.motion.rotation_rms_rad_s.setConstant(0.5);
  scenario.tracks.count = 60;
  scenario.tracks.noise_px = 0.3;
  return scenario;
}

inline CalibratorOptions OptionsFor(const simulation::Scenario& scenario) {
  CalibratorOptions options;
  options.camera.width_px = scenario.camera.width_px;
  options.camera.height_px = scenario.camera.height_px;
  options.max_frames_waiting = 1000;  // tests feed faster than real time
  return options;
}

inline std::unique_ptr<Calibrator> Make(const CalibratorOptions& options) {
  std::string error;
  auto calibrator = Calibrator::Create(options, &error);
  EXPECT_NE(calibrator, nullptr) << error;
  return calibrator;
}

inline AddResult Add(Calibrator* c, const GyroSample& s) {
  const Eigen::Vector3d& w = s.omega_gyro_rad_s;
  return c->AddGyro(s.stamp_ns, w.x(), w.y(), w.z());
}
inline AddResult Add(Calibrator* c, const AccelSample& s) {
  const Eigen::Vector3d& a = s.accel_gyro_m_s2;
  return c->AddAccel(s.stamp_ns, a.x(), a.y(), a.z());
}
inline std::vector<TrackPoint> Points(const std::vector<TrackedPoint>& points) {
  std::vector<TrackPoint> out;
  for (const TrackedPoint& p : points) out.push_back({p.track_id, p.px.x(), p.px.y()});
  return out;
}
inline AddResult Add(Calibrator* c, const Recording& r, size_t frame) {
  const std::vector<TrackPoint> points = Points(r.tracks[frame]);
  return c->AddTracks(r.frames[frame].stamp_ns, points.data(), points.size());
}

// Everything in the order of time, in one thread.
inline void Feed(Calibrator* c, const Recording& r) {
  size_t gyro = 0, accel = 0;
  const auto until = [&](int64_t stamp_ns) {
    for (; gyro < r.gyro.size() && r.gyro[gyro].stamp_ns <= stamp_ns; ++gyro) {
      ASSERT_EQ(Add(c, r.gyro[gyro]), AddResult::kAccepted);
    }
    for (; accel < r.accel.size() && r.accel[accel].stamp_ns <= stamp_ns; ++accel) {
      ASSERT_EQ(Add(c, r.accel[accel]), AddResult::kAccepted);
    }
  };
  for (size_t i = 0; i < r.frames.size(); ++i) {
    until(r.frames[i].stamp_ns);
    ASSERT_EQ(Add(c, r, i), AddResult::kAccepted);
  }
  until(std::numeric_limits<int64_t>::max());
}

inline double Sigmas(double estimate, double truth, const ParameterState& p) {
  return std::abs(estimate - truth) / p.sigma;
}

}  // namespace camgyro::api

#endif  // CAMGYRO_TESTS_CAMGYRO_FEED_CALIBRATOR_H_
