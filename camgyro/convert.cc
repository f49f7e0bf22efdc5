#include "camgyro/convert.h"

#include <cmath>

#include "camgyro/calibrator.h"
#include "camgyro/version.h"
#include "core/pair_model.h"
#include "core/standard_distortion.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

api::Vec3 ToApi(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d FromApi(const api::Vec3& v) { return {v[0], v[1], v[2]}; }
std::array<double, 4> ToApi(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

api::VinsVerdict ToApi(VinsVerdict verdict) {
  switch (verdict) {
    case VinsVerdict::kReady:
      return api::VinsVerdict::kReady;
    case VinsVerdict::kNoAccelerometer:
      return api::VinsVerdict::kNoAccelerometer;
    case VinsVerdict::kTooFewTracks:
      return api::VinsVerdict::kTooFewData;
    case VinsVerdict::kTooLittleExcitation:
      return api::VinsVerdict::kTooLittleExcitation;
    case VinsVerdict::kTooLittleParallax:
      return api::VinsVerdict::kTooLittleParallax;
    case VinsVerdict::kAccelerometerImplausible:
      return api::VinsVerdict::kAccelerometerImplausible;
    case VinsVerdict::kCalibrationImplausible:
      return api::VinsVerdict::kCalibrationImplausible;
    case VinsVerdict::kImprecise:
      return api::VinsVerdict::kImprecise;
    case VinsVerdict::kNotConverged:
      return api::VinsVerdict::kNotConverged;
  }
  return api::VinsVerdict::kNotConverged;
}

bool Finite(const api::Vec3& v) { return FromApi(v).allFinite(); }

}  // namespace

api::Calibration ToApi(const Calibration& calibration) {
  const LensParameters lens = calibration.FullLens();
  api::Calibration c;
  c.width_px = calibration.width_px;
  c.height_px = calibration.height_px;
  c.focal_px = lens[kFocal];
  c.aspect_ratio = lens[kAspect];
  c.principal_px = {lens[kCx], lens[kCy]};
  const DistortionCoefficients distortion =
      StandardDistortion(calibration.distortion_model, lens,
                         Eigen::Vector2d(calibration.width_px, calibration.height_px));
  if (distortion.model == DistortionModel::kKannalaBrandt) {
    c.distortion_model = api::Distortion::kKannalaBrandt;
  }
  std::copy(distortion.k.data(), distortion.k.data() + 4, c.distortion.begin());
  c.readout_s = calibration.readout_s;
  c.column_readout_s = ColumnReadoutOf(calibration);
  c.delay_s = calibration.delay_s;
  c.bias_gyro_rad_s = ToApi(calibration.bias_gyro_rad_s);
  c.q_gyro_cam_wxyz = ToApi(calibration.q_gyro_cam);
  static_assert(static_cast<int>(api::kParameters) == static_cast<int>(kStateSize));
  // Symmetric: the order of rows and columns is the same.
  Eigen::Map<StateCovariance>(c.covariance.data()) = calibration.covariance;
  Eigen::Map<StateCovariance>(c.total_covariance.data()) = calibration.total_covariance.value_or(
      StateCovariance::Constant(std::numeric_limits<double>::infinity()));
  return c;
}

api::VinsStart ToApi(const Result<VinsStart>& start) {
  api::VinsStart result;
  if (!start) {
    result.verdict = api::VinsVerdict::kBadInput;
    result.explanation = start.error().message;
    return result;
  }
  result.verdict = ToApi(start->verdict);
  result.explanation = start->explanation;
  for (const VinsState& state : start->states) {
    result.states.push_back({state.frame_stamp_ns, state.time_ns, ToApi(state.q_world_gyro),
                             ToApi(state.p_world_m), ToApi(state.v_world_m_s)});
  }
  result.gravity_world_m_s2 = ToApi(start->gravity_world_m_s2);
  result.bias_accel_m_s2 = ToApi(start->bias_accel_m_s2);
  result.p_gyro_cam_m = ToApi(start->p_gyro_cam_m);
  result.calibration = ToApi(start->calibration);
  for (const VinsLandmark& landmark : start->landmarks) {
    api::VinsLandmark& out = result.landmarks.emplace_back();
    out.track_id = landmark.track_id;
    Eigen::Map<Eigen::Vector4d>(out.point.data()) = landmark.point;
    Eigen::Map<Eigen::Matrix3d>(out.covariance_m2.data()) = landmark.covariance_m2;
    out.observations = landmark.observations;
  }
  result.covariance_size = static_cast<size_t>(start->covariance.rows());
  // Symmetric: the order of rows and columns is the same.
  result.covariance.assign(start->covariance.data(),
                           start->covariance.data() + start->covariance.size());
  result.scale_sigma = start->scale_sigma;
  result.gravity_sigma_rad = start->gravity_sigma_rad;
  return result;
}

DeviceClass FromApi(api::Device device) {
  switch (device) {
    case api::Device::kActionCamera:
      return DeviceClass::kActionCamera;
    case api::Device::kIndustrial:
      return DeviceClass::kIndustrial;
    case api::Device::kPhone:
      break;
  }
  return DeviceClass::kPhone;
}

Result<CameraGuess> FromApi(const api::CameraGuess& guess) {
  constexpr int kLargest = 1 << 14;
  CameraGuess camera;
  if (guess.width_px < 16 || guess.height_px < 16 || guess.width_px > kLargest ||
      guess.height_px > kLargest) {
    return BadUsage("camera: expected a size from 16 to 16384 px");
  }
  camera.width_px = guess.width_px;
  camera.height_px = guess.height_px;
  if (guess.focal_px) {
    if (!(*guess.focal_px > 1.0 && *guess.focal_px < 1e5)) {
      return BadUsage("camera: expected a focal length from 1 to 100000 px");
    }
    camera.focal_px = guess.focal_px;
  }
  if (!(guess.aspect_ratio > 0.2 && guess.aspect_ratio < 5.0)) {
    return BadUsage("camera: expected an aspect ratio from 0.2 to 5");
  }
  camera.aspect_ratio = guess.aspect_ratio;
  if (guess.principal_px) {
    const Eigen::Vector2d principal((*guess.principal_px)[0], (*guess.principal_px)[1]);
    if (!(principal.cwiseAbs().maxCoeff() < 2.0 * kLargest)) {
      return BadUsage("camera: the principal point is not finite or far off the picture");
    }
    camera.principal_px = principal;
  }
  for (const double k : guess.distortion) {
    if (!(std::abs(k) < 10.0)) return BadUsage("camera: expected distortion between -10 and 10");
    if (k != 0.0) camera.distortion_model = DistortionModel::kRadTan;
  }
  if (guess.distortion_model == api::Distortion::kKannalaBrandt) {
    camera.distortion_model = DistortionModel::kKannalaBrandt;
  }
  if (camera.distortion_model != DistortionModel::kNone) {
    camera.distortion.assign(guess.distortion.begin(), guess.distortion.end());
  }
  for (const auto& [value, limit, name] :
       {std::tuple(guess.readout_s, 1.0, "readout"), std::tuple(guess.delay_s, 1e9, "delay")}) {
    if (value && !(std::abs(*value) <= limit)) {
      return BadUsage(std::string("camera: the ") + name + " is not finite or too large");
    }
  }
  camera.readout_s = guess.readout_s;
  camera.delay_s = guess.delay_s;
  if (guess.q_gyro_cam_wxyz) {
    const auto& q = *guess.q_gyro_cam_wxyz;
    const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
    if (!(std::abs(rotation.norm() - 1.0) < 0.01)) {
      return BadUsage("camera: q_gyro_cam is no unit quaternion");
    }
    camera.q_gyro_cam = rotation.normalized();
  }
  return camera;
}

Result<VinsOptions> FromApi(const api::VinsSettings& s) {
  for (const double positive : {s.gyro_noise_rad_s_rtHz, s.accel_noise_m_s2_rtHz,
                                s.accel_bias_sigma_m_s2, s.p_gyro_cam_sigma_m, s.gravity_m_s2}) {
    if (!(positive > 1e-9 && positive < 1e3)) {
      return BadUsage("VINS settings: expected noise, sigmas and gravity between 1e-9 and 1e3");
    }
  }
  if (!Finite(s.p_gyro_cam_m) || !(FromApi(s.p_gyro_cam_m).norm() < 10.0)) {
    return BadUsage("VINS settings: p_gyro_cam is not finite or longer than 10 m");
  }
  if (!(s.window_s >= 0.8 && s.window_s <= 8.0)) {
    return BadUsage("VINS settings: expected a window from 0.8 to 8 s");
  }
  VinsOptions options;
  options.noise = {s.gyro_noise_rad_s_rtHz, s.accel_noise_m_s2_rtHz};
  options.accel_bias_sigma_m_s2 = s.accel_bias_sigma_m_s2;
  options.p_gyro_cam_m = FromApi(s.p_gyro_cam_m);
  options.p_gyro_cam_sigma_m = s.p_gyro_cam_sigma_m;
  options.gravity_m_s2 = s.gravity_m_s2;
  return options;
}

Result<OdometryOptions> FromApi(const api::OdometrySettings& s) {
  const Result<VinsOptions> inertial = FromApi(s.inertial);
  if (!inertial) return tl::unexpected(inertial.error());
  for (const double density : {s.gyro_bias_walk_rad_s2_rtHz, s.accel_bias_walk_m_s3_rtHz}) {
    if (!(density > 1e-12 && density < 1e3)) {
      return BadUsage("odometry settings: expected random walks between 1e-12 and 1e3");
    }
  }
  if (s.keyframes < 6 || s.keyframes > 60) {
    return BadUsage("odometry settings: expected 6 to 60 keyframes");
  }
  OdometryOptions options;
  options.noise = inertial->noise;
  options.accel_bias_sigma_m_s2 = inertial->accel_bias_sigma_m_s2;
  options.p_gyro_cam_m = inertial->p_gyro_cam_m;
  options.p_gyro_cam_sigma_m = inertial->p_gyro_cam_sigma_m;
  options.gravity_m_s2 = inertial->gravity_m_s2;
  options.walk = {s.gyro_bias_walk_rad_s2_rtHz, s.accel_bias_walk_m_s3_rtHz};
  options.keyframes = s.keyframes;
  return options;
}

Result<Calibration> FromApi(const api::Calibration& c) {
  api::CameraGuess as_guess;
  as_guess.width_px = c.width_px;
  as_guess.height_px = c.height_px;
  as_guess.focal_px = c.focal_px;
  as_guess.aspect_ratio = c.aspect_ratio;
  as_guess.principal_px = c.principal_px;
  as_guess.distortion_model = c.distortion_model;
  as_guess.distortion = c.distortion;
  as_guess.readout_s = c.readout_s;
  as_guess.delay_s = c.delay_s;
  as_guess.q_gyro_cam_wxyz = c.q_gyro_cam_wxyz;
  const Result<CameraGuess> checked = FromApi(as_guess);
  if (!checked) return tl::unexpected(checked.error());
  if (ReadsColumns(c.readout_s, c.column_readout_s)) {
    return BadUsage(std::string("calibration: ") + kReadsColumns);
  }
  if (!Finite(c.bias_gyro_rad_s)) return BadUsage("calibration: the gyro bias is not finite");
  Calibration calibration;
  calibration.width_px = c.width_px;
  calibration.height_px = c.height_px;
  calibration.lens = MakePinhole(c.focal_px, *checked->principal_px, c.aspect_ratio);
  calibration.distortion_model = checked->distortion_model;
  if (checked->distortion_model != DistortionModel::kNone) {
    calibration.lens.segment<4>(FirstCoefficient(checked->distortion_model)) =
        Eigen::Map<const Eigen::Vector4d>(c.distortion.data());
  }
  calibration.readout_s = c.readout_s;
  calibration.delay_s = c.delay_s;
  calibration.bias_gyro_rad_s = FromApi(c.bias_gyro_rad_s);
  calibration.q_gyro_cam = *checked->q_gyro_cam;
  calibration.covariance = Eigen::Map<const StateCovariance>(c.covariance.data());
  const Eigen::Map<const StateCovariance> total(c.total_covariance.data());
  if (total.allFinite() && !total.isZero()) calibration.total_covariance = total;
  if (!calibration.covariance.allFinite()) {
    return BadUsage("calibration: the covariance is not finite");
  }
  return calibration;
}

namespace api {

const char* Version() noexcept {
#define CAMGYRO_TEXT_(x) #x
#define CAMGYRO_TEXT(x) CAMGYRO_TEXT_(x)
  return CAMGYRO_TEXT(CAMGYRO_VERSION_MAJOR) "." CAMGYRO_TEXT(
      CAMGYRO_VERSION_MINOR) "." CAMGYRO_TEXT(CAMGYRO_VERSION_PATCH);
#undef CAMGYRO_TEXT
#undef CAMGYRO_TEXT_
}

const char* ToString(AddResult result) noexcept {
  switch (result) {
    case AddResult::kAccepted:
      return "accepted";
    case AddResult::kDuplicate:
      return "duplicate";
    case AddResult::kOutOfOrder:
      return "out of order";
    case AddResult::kTooLate:
      return "too late";
    case AddResult::kNotFinite:
      return "not finite";
    case AddResult::kOutOfRange:
      return "out of range";
    case AddResult::kWrongSize:
      return "wrong size";
    case AddResult::kQueueFull:
      return "queue full";
    case AddResult::kStopped:
      return "stopped";
  }
  return "";
}

const char* ToString(Readiness readiness) noexcept {
  switch (readiness) {
    case Readiness::kNoEstimate:
      return "no estimate";
    case Readiness::kUndetermined:
      return "undetermined";
    case Readiness::kImprecise:
      return "imprecise";
    case Readiness::kUnsteady:
      return "unsteady";
    case Readiness::kReady:
      return "ready";
  }
  return "";
}

const char* ToString(VinsVerdict verdict) noexcept {
  switch (verdict) {
    case VinsVerdict::kReady:
      return "ready";
    case VinsVerdict::kNoCalibration:
      return "no calibration";
    case VinsVerdict::kNoAccelerometer:
      return "no accelerometer";
    case VinsVerdict::kTooFewData:
      return "too few data";
    case VinsVerdict::kTooLittleExcitation:
      return "too little excitation";
    case VinsVerdict::kTooLittleParallax:
      return "too little parallax";
    case VinsVerdict::kAccelerometerImplausible:
      return "accelerometer implausible";
    case VinsVerdict::kCalibrationImplausible:
      return "calibration implausible";
    case VinsVerdict::kImprecise:
      return "imprecise";
    case VinsVerdict::kNotConverged:
      return "not converged";
    case VinsVerdict::kBadInput:
      return "bad input";
  }
  return "";
}

const char* ParameterName(int parameter) noexcept {
  return parameter >= 0 && parameter < kParameters
             ? StateTable()[static_cast<size_t>(parameter)].long_name
             : "";
}

}  // namespace api
}  // namespace camgyro
