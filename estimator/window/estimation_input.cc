#include "estimator/window/estimation_input.h"

#include <memory>
#include <utility>

#include "core/saturation.h"
#include "core/time.h"

namespace camgyro {

std::vector<TimedPair> SideBySide(const Recording& recording, const PairSelection& selection) {
  const bool lose_step = selection.gap > 1 && PairsLoseTheirStep(recording.camera_stamps);
  PairSelection from_any_frame = selection;
  from_any_frame.stride = 1;
  const int apart = selection.stride == selection.gap ? 0 : 1;  // see SelectPairs
  std::vector<TimedPair> kept;
  int next = 0;
  for (TimedPair& pair : OutlineOf(recording, from_any_frame).pairs) {
    if (pair.frame_a < next) continue;
    kept.push_back(std::move(pair));
    next = kept.back().frame_b + apart;
    if (lose_step && kept.size() % kPairsInStep == 0) ++next;
  }
  return kept;
}

EstimationInput MakeEstimationInput(const Recording& recording, const PairSelection& selection) {
  EstimationInput input = OutlineOf(recording, selection);
  AddMatches(recording, &input.pairs);
  return input;
}

std::vector<Match> MatchesOf(const Recording& recording, const TimedPair& pair) {
  if (pair.num_matches == 0) return {};
  // Pairs of a file are taken as they are, so that their numbers are their places.
  if (!recording.matches.empty()) return recording.matches[static_cast<size_t>(pair.id)].matches;
  return MatchesBetween(recording.tracks[static_cast<size_t>(pair.frame_a)],
                        recording.tracks[static_cast<size_t>(pair.frame_b)]);
}

void AddMatches(const Recording& recording, std::vector<TimedPair>* pairs) {
  for (TimedPair& pair : *pairs) pair.matches = MatchesOf(recording, pair);
}

EstimationInput OutlineOf(const Recording& recording, const PairSelection& selection) {
  EstimationInput input;
  input.origin_ns = recording.gyro.front().stamp_ns;
  const std::vector<bool> saturated = FindSaturated(recording.gyro);
  input.rates.reserve(recording.gyro.size());
  for (const GyroSample& sample : recording.gyro) {
    input.rates.push_back({SecondsSince(input.origin_ns, sample.stamp_ns), sample.omega_gyro_rad_s,
                           saturated[input.rates.size()]});
  }
  const auto add = [&](int a, int b) -> TimedPair& {
    TimedPair pair;
    pair.id = static_cast<int64_t>(input.pairs.size());
    pair.frame_a = a;
    pair.frame_b = b;
    pair.time_a_s =
        SecondsSince(input.origin_ns, recording.frames[static_cast<size_t>(a)].stamp_ns);
    pair.time_b_s =
        SecondsSince(input.origin_ns, recording.frames[static_cast<size_t>(b)].stamp_ns);
    pair.exposure_a_s = recording.frames[static_cast<size_t>(a)].exposure_s;
    pair.exposure_b_s = recording.frames[static_cast<size_t>(b)].exposure_s;
    input.pairs.push_back(std::move(pair));
    return input.pairs.back();
  };
  if (!recording.matches.empty()) {
    for (const FramePair& pair : recording.matches) {
      add(pair.frame_a, pair.frame_b).num_matches = pair.matches.size();
    }
  } else if (!recording.tracks.empty()) {
    const int n = static_cast<int>(recording.tracks.size());
    for (const int a : FirstFrames(selection, n, PairsLoseTheirStep(recording.camera_stamps))) {
      const int b = a + selection.gap;
      add(a, b).num_matches = CountMatches(recording.tracks[static_cast<size_t>(a)],
                                           recording.tracks[static_cast<size_t>(b)]);
    }
  } else {
    const int n = static_cast<int>(recording.q_cam_world.size());
    for (int a = 0; a + 1 < n; ++a) {
      CameraRotation& rotation = add(a, a + 1).rotation;
      rotation.frame_a = a;
      rotation.frame_b = a + 1;
      rotation.q_a_b = recording.q_cam_world[static_cast<size_t>(a)] *
                       recording.q_cam_world[static_cast<size_t>(a + 1)].conjugate();
    }
  }
  return input;
}

namespace {

// part: where in the picture, of its size.
double DelayAt(const Calibration& calibration, const FrameTime& frame, double part) {
  const PairEffects effects = calibration.pair_effects();
  if (effects.set == nullptr) return calibration.delay_s;
  const Eigen::Vector2d size_px(calibration.width_px, calibration.height_px);
  EffectSet::Change change;
  effects.set->ChangeObservation({part * size_px, size_px, frame}, &change);
  return calibration.delay_s + change.time.row(0).dot(calibration.effect_values);
}

}  // namespace

double DelayOf(const Calibration& calibration, const FrameTime& frame) {
  return DelayAt(calibration, frame, 0.5);
}

double FirstDelayOf(const Calibration& calibration, const FrameTime& frame) {
  return DelayAt(calibration, frame, 0.0);
}

EffectSetup MakeEffectSetup(const Recording& recording, const Calibration& calibration) {
  EffectSetup setup;
  setup.size_px << recording.camera.width_px, recording.camera.height_px;
  setup.distortion_model = calibration.distortion_model;
  setup.division_lambda = recording.camera.division_lambda;
  setup.delay_s = calibration.delay_s;
  setup.readout_s = calibration.readout_s;
  setup.R_gyro_cam = calibration.q_gyro_cam.toRotationMatrix();
  // Pictures need not be tracked yet.
  setup.has_pixels =
      !recording.matches.empty() || !recording.tracks.empty() || recording.HasImages();
  if (setup.has_pixels) {
    setup.edge_rad = std::atan2(0.5 * setup.size_px.norm(), calibration.lens[kFocal]);
  }
  if (recording.camera_stamps && recording.camera_stamps->repaired) {
    setup.frame_stamp_jitter_s = recording.camera_stamps->jitter_s;
  }
  const int64_t origin_ns = recording.gyro.front().stamp_ns;
  for (const Frame& frame : recording.frames) {
    setup.frames.push_back({SecondsSince(origin_ns, frame.stamp_ns), frame.exposure_s});
  }
  if (calibration.pair_effects().set != nullptr) {
    for (const FrameTime& frame : setup.frames) {
      setup.frame_delays_s.push_back(DelayOf(calibration, frame));
    }
  }
  if (!recording.lens_shift.empty()) {
    setup.lens_shift = std::make_shared<LensShift>(recording.lens_shift, origin_ns);
  }
  auto gyro = std::make_shared<SensorSamples>();
  gyro->values.resize(3, static_cast<Eigen::Index>(recording.gyro.size()));
  for (const GyroSample& sample : recording.gyro) {
    gyro->values.col(static_cast<Eigen::Index>(gyro->times_s.size())) = sample.omega_gyro_rad_s;
    gyro->times_s.push_back(SecondsSince(origin_ns, sample.stamp_ns));
  }
  setup.gyro = std::move(gyro);
  auto accel = std::make_shared<SensorSamples>();
  accel->values.resize(3, static_cast<Eigen::Index>(recording.accel.size()));
  for (const AccelSample& sample : recording.accel) {
    accel->values.col(static_cast<Eigen::Index>(accel->times_s.size())) = sample.accel_gyro_m_s2;
    accel->times_s.push_back(SecondsSince(origin_ns, sample.stamp_ns));
  }
  setup.accel = std::move(accel);
  return setup;
}

}  // namespace camgyro
