#include "simulation/scenario.h"

#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/robust_statistics.h"
#include "core/so3.h"
#include "simulation/yaml_section.h"

namespace camgyro::simulation {
namespace {

void Read(YamlSection section, MotionOptions* motion) {
  MotionKind kind = motion->kind;
  if (section.Read("kind", &kind,
                   {{"handheld", MotionKind::kHandheld},
                    {"walking", MotionKind::kWalking},
                    {"running", MotionKind::kRunning},
                    {"panning", MotionKind::kPanning},
                    {"rotation", MotionKind::kRotation},
                    {"single_axis", MotionKind::kSingleAxis},
                    {"slow", MotionKind::kSlow},
                    {"file", MotionKind::kFile}})) {
    *motion = MotionPreset(kind);
  }
  section.Read("rotation_rms_rad_s", &motion->rotation_rms_rad_s, Range::kNotNegative);
  section.Read("rotation_band_hz", &motion->rotation_band_hz, Range::kPositive);
  section.Read("pan_rms_rad_s", &motion->pan_rms_rad_s, Range::kNotNegative);
  section.Read("pan_period_s", &motion->pan_period_s, Range::kPositive);
  section.Read("speed_m_s", &motion->speed_m_s);
  section.Read("heading_deg", &motion->heading_deg);
  section.Read("path_radius_m", &motion->path_radius_m, Range::kNotNegative);
  section.Read("sway_rms_m_s", &motion->sway_rms_m_s, Range::kNotNegative);
  section.Read("sway_band_hz", &motion->sway_band_hz, Range::kPositive);
  section.Read("step_hz", &motion->step_hz, Range::kNotNegative);
  section.Read("step_bounce_m", &motion->step_bounce_m, Range::kNotNegative);
  section.Read("step_nod_rad", &motion->step_nod_rad, Range::kNotNegative);
  section.Read("file", &motion->file);
  section.Read("file_is_body", &motion->file_is_body);
  section.Read("file_knot_s", &motion->file_knot_s, Range::kPositive);
  section.Finish();
}

void Read(YamlSection section, SceneOptions* scene) {
  section.Read("kind", &scene->kind,
               {{"points", SceneKind::kPoints},
                {"ground", SceneKind::kGround},
                {"room", SceneKind::kRoom},
                {"corridor", SceneKind::kCorridor},
                {"facade", SceneKind::kFacade},
                {"mountains", SceneKind::kMountains}});
  section.Read("depth_law", &scene->depth_law,
               {{"uniform", DepthLaw::kUniform},
                {"logarithmic", DepthLaw::kLogarithmic},
                {"inverse", DepthLaw::kInverse}});
  section.Read("depth_m", &scene->depth_m, Range::kPositive);
  section.Read("ground_m", &scene->ground_m, Range::kPositive);
  section.Read("distance_m", &scene->distance_m, Range::kPositive);
  section.Read("room_m", &scene->room_m, Range::kPositive);
  section.Read("block_m", &scene->block_m, Range::kPositive);
  section.Read("far_m", &scene->far_m, Range::kPositive);
  section.Read("moving_fraction", &scene->moving_fraction, Range::kFraction);
  section.Read("moving_objects", &scene->moving_objects);
  section.Read("moving_speed_m_s", &scene->moving_speed_m_s, Range::kNotNegative);
  section.Finish();
}

void Read(YamlSection section, CameraOptions* camera) {
  std::vector<int> resolution = {camera->width_px, camera->height_px};
  if (section.Read("resolution", &resolution)) {
    if (resolution.size() != 2 || resolution[0] < 16 || resolution[1] < 16) {
      section.Complain({}, "resolution", "must be [width, height] of at least 16 pixels");
    } else {
      camera->width_px = resolution[0];
      camera->height_px = resolution[1];
    }
  }
  section.Read("focal_px", &camera->focal_px, Range::kPositive);
  Eigen::Vector2d principal_px;
  if (section.Read("principal_px", &principal_px)) camera->principal_px = principal_px;
  section.Read("rate_hz", &camera->rate_hz, Range::kPositive);
  section.Read("readout_s", &camera->readout_s);
  section.Read("delay_s", &camera->delay_s);
  section.Read("exposure_s", &camera->exposure_s, Range::kNotNegative);
  section.Read("exposure_swing", &camera->exposure_swing, Range::kFraction);
  section.Read("drop_fraction", &camera->drop_fraction, Range::kFraction);
  section.Read("declare_intrinsics", &camera->declare_intrinsics);
  section.Finish();
}

void Read(YamlSection section, MountOptions* mount) {
  Eigen::Vector4d wxyz;
  if (section.Read("q_gyro_cam_wxyz", &wxyz)) {
    if (std::abs(wxyz.norm() - 1.0) > 1e-3) {
      section.Complain({}, "q_gyro_cam_wxyz", "must have norm 1");
    }
    mount->q_gyro_cam = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
  }
  section.Read("p_gyro_cam_m", &mount->p_gyro_cam_m);
  section.Finish();
}

void Read(YamlSection section, GyroOptions* gyro) {
  section.Read("rate_hz", &gyro->rate_hz, Range::kPositive);
  section.Read("noise_density_rad_s_rtHz", &gyro->noise_density_rad_s_rtHz, Range::kNotNegative);
  section.Read("bias_rad_s", &gyro->bias_rad_s);
  section.Read("bias_walk_rad_s2_rtHz", &gyro->bias_walk_rad_s2_rtHz, Range::kNotNegative);
  section.Read("averaged", &gyro->averaged);
  section.Read("stamp_jitter_s", &gyro->stamp_jitter_s, Range::kNotNegative);
  section.Read("stamp_latency_s", &gyro->stamp_latency_s, Range::kNotNegative);
  section.Read("stamp_stall_s", &gyro->stamp_stall_s, Range::kNotNegative);
  section.Read("drop_fraction", &gyro->drop_fraction, Range::kFraction);
  section.Read("quantum_rad_s", &gyro->quantum_rad_s, Range::kNotNegative);
  section.Read("accelerometer", &gyro->accelerometer);
  section.Read("accel_noise_density_m_s2_rtHz", &gyro->accel_noise_density_m_s2_rtHz,
               Range::kNotNegative);
  section.Read("accel_bias_m_s2", &gyro->accel_bias_m_s2);
  section.Read("accel_bias_walk_m_s3_rtHz", &gyro->accel_bias_walk_m_s3_rtHz, Range::kNotNegative);
  section.Finish();
}

void Read(YamlSection section, TrackOptions* tracks) {
  section.Read("count", &tracks->count);
  section.Read("noise_px", &tracks->noise_px, Range::kNotNegative);
  section.Read("noise_scatter", &tracks->noise_scatter, Range::kNotNegative);
  section.Read("reanchored", &tracks->reanchored);
  section.Read("outlier_fraction", &tracks->outlier_fraction, Range::kFraction);
  section.Read("outlier_px", &tracks->outlier_px, Range::kNotNegative);
  section.Read("mean_life_frames", &tracks->mean_life_frames, Range::kNotNegative);
  section.Finish();
}

void Read(YamlSection section, AttitudeOptions* attitudes) {
  section.Read("noise_rad", &attitudes->noise_rad, Range::kNotNegative);
  section.Read("walk_rad", &attitudes->walk_rad, Range::kNotNegative);
  section.Finish();
}

void Read(YamlSection section, VideoOptions* video) {
  section.Read(
      "format", &video->format,
      {{"none", VideoFormat::kNone}, {"png", VideoFormat::kPng}, {"mp4", VideoFormat::kMp4}});
  section.Read("max_blur_samples", &video->max_blur_samples);
  section.Read("vignetting", &video->vignetting, Range::kFraction);
  section.Read("full_well_electrons", &video->full_well_electrons, Range::kNotNegative);
  section.Read("read_noise_electrons", &video->read_noise_electrons, Range::kNotNegative);
  section.Read("crf", &video->crf);
  section.Finish();
}

void Read(YamlSection section, DeviceLogFiles* files) {
  section.Read("gyro", &files->gyro);
  section.Read("frames", &files->frames);
  section.Read("lens_shift", &files->lens_shift);
  section.Finish();
}

void Read(YamlSection section, Effects* effects) {
  effects->ForEach([&](auto& effect) {
    YamlSection keys = section.Child(effect.kName);
    effect.Read(&keys);
    keys.Finish();
  });
  section.Finish();
  const TangentialDistortion& tangential = effects->tangential_distortion;
  if (effects->radial_distortion.kannala_brandt && tangential.active()) {
    section.Complain({}, "tangential_distortion.p1", "and p2 belong to model radtan");
  }
}

std::string CheckTogether(const Scenario& scenario) {
  if (scenario.video.format != VideoFormat::kNone && scenario.scene.kind == SceneKind::kPoints) {
    return "video.format: points have no surface to show; set scene.kind to ground, room, "
           "corridor, facade or mountains";
  }
  const bool attitudes = scenario.attitudes.wanted();
  if (attitudes && scenario.video.format != VideoFormat::kNone) {
    return "attitudes: are in the place of pictures; leave video.format out";
  }
  if (!attitudes && scenario.effects.attitude_rolling_shutter.active()) {
    return "attitudes.noise_rad: or walk_rad is missing for attitude_rolling_shutter";
  }
  if (scenario.video.max_blur_samples < 4 || scenario.video.max_blur_samples > 64) {
    return "video.max_blur_samples: must lie between 4 and 64";
  }
  if (scenario.video.crf < 0 || scenario.video.crf > 51) {
    return "video.crf: must lie between 0 and 51";
  }
  if (scenario.scene.depth_m[0] >= scenario.scene.depth_m[1]) {
    return "scene.depth_m: must be [nearest, farthest]";
  }
  if (scenario.scene.kind == SceneKind::kCorridor &&
      (scenario.scene.block_m[0] >= scenario.scene.room_m[0] ||
       scenario.scene.block_m[1] >= scenario.scene.room_m[2])) {
    return "scene.block_m: must be smaller than room_m";
  }
  if (scenario.tracks.count < 0 || scenario.scene.moving_objects < 0) {
    return "tracks.count, scene.moving_objects: must not be negative";
  }
  if (scenario.motion.kind == MotionKind::kFile && scenario.motion.file.empty()) {
    return "motion.file: is missing for motion.kind file";
  }
  const DeviceLogFiles& log = scenario.log_files;
  if (log.gyro.empty() && !(log.frames.empty() && log.lens_shift.empty())) {
    return "log.gyro: is missing; the times of a log are after its first gyro sample";
  }
  if (!log.gyro.empty() && scenario.motion.kind == MotionKind::kFile) {
    return "log.gyro: says how the camera turns, as motion.kind file does; leave one of them out";
  }
  if (scenario.effects.optical_stabilisation.logged_px != 0.0 && log.lens_shift.empty()) {
    return "log.lens_shift: is missing for optical_stabilisation.logged_px";
  }
  return "";
}

void MakeRelativeTo(const std::filesystem::path& folder, std::string* file) {
  const std::filesystem::path path(*file);
  if (!path.empty() && path.is_relative()) *file = (folder / path).string();
}

double MedianInterval(const std::vector<int64_t>& times_ns) {
  std::vector<double> intervals_s;
  for (size_t i = 1; i < times_ns.size(); ++i) {
    intervals_s.push_back(1e-9 * static_cast<double>(times_ns[i] - times_ns[i - 1]));
  }
  return MedianInPlace(&intervals_s);
}

// The log of a scenario, and what it says of the scenario's length and rates.
Status TakeLog(Scenario* scenario) {
  if (scenario->log_files.gyro.empty()) return {};
  Result<DeviceLog> log = ReadDeviceLog(scenario->log_files);
  if (!log) return tl::unexpected(log.error());
  const double span_s = 1e-9 * static_cast<double>(log->gyro_ns.back());
  scenario->duration_s = span_s - 2.0 * scenario->margin_s;
  if (!(scenario->duration_s > 0.0)) {
    return BadInput(scenario->log_files.gyro + ": is shorter than twice margin_s");
  }
  scenario->gyro.rate_hz = 1.0 / MedianInterval(log->gyro_ns);
  if (!log->frame_ns.empty()) scenario->camera.rate_hz = 1.0 / MedianInterval(log->frame_ns);
  scenario->log = std::make_shared<const DeviceLog>(*std::move(log));
  return {};
}

// Applies "a.b=value" to the tree. Returns a complaint or nothing.
std::string Override(const std::string& assignment, YAML::Node* root) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos) return "\"" + assignment + "\" is not of the form key=value";
  YAML::Node node = *root;
  std::istringstream keys(assignment.substr(0, equals));
  std::string key;
  while (std::getline(keys, key, '.')) {
    if (node.IsDefined() && !node.IsNull() && !node.IsMap()) {
      return "\"" + assignment + "\" goes into a key that has no keys";
    }
    YAML::Node next = node[key];
    node.reset(next);
  }
  node = YAML::Load(assignment.substr(equals + 1));
  return "";
}

}  // namespace

Eigen::Quaterniond MountOptions::DefaultRotation() {
  // Android: gyro x along the picture's -y, y along -x, z against the view (back camera, portrait
  // sensor), and 2 to 4 degrees of assembly.
  Eigen::Matrix3d R;
  R << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  return Eigen::Quaterniond(R) * Exp(Eigen::Vector3d(0.04, -0.06, 0.03));
}

MotionOptions MotionPreset(MotionKind kind) {
  MotionOptions motion;
  motion.kind = kind;
  switch (kind) {
    case MotionKind::kHandheld:
    case MotionKind::kFile:
      break;
    case MotionKind::kWalking:
      motion.rotation_rms_rad_s = {0.25, 0.35, 0.2};
      motion.speed_m_s = 1.4;
      motion.step_hz = 1.9;
      motion.step_bounce_m = 0.02;
      motion.step_nod_rad = 0.015;
      break;
    case MotionKind::kRunning:
      motion.rotation_rms_rad_s = {0.8, 1.0, 0.7};
      motion.rotation_band_hz = {0.3, 4.0};
      motion.speed_m_s = 3.0;
      motion.step_hz = 2.7;
      motion.step_bounce_m = 0.04;
      motion.step_nod_rad = 0.04;
      break;
    case MotionKind::kPanning:
      motion.rotation_rms_rad_s = {0.02, 0.02, 0.02};
      motion.pan_rms_rad_s = 0.6;
      motion.speed_m_s = 0.3;
      motion.sway_rms_m_s = 0.05;
      break;
    case MotionKind::kRotation:
      motion.speed_m_s = 0.0;
      motion.sway_rms_m_s = 0.0;
      break;
    case MotionKind::kSingleAxis:
      motion.rotation_rms_rad_s = {0.0, 0.8, 0.0};
      break;
    case MotionKind::kSlow:
      motion.rotation_rms_rad_s = {0.2, 0.2, 0.2};
      motion.speed_m_s = 0.4;
      motion.sway_rms_m_s = 0.05;
      break;
  }
  return motion;
}

Result<Scenario> ParseScenario(const std::string& yaml, const std::vector<std::string>& overrides) {
  Scenario scenario;
  std::string complaint;
  try {
    YAML::Node root = YAML::Load(yaml);
    if (root.IsNull()) root = YAML::Node(YAML::NodeType::Map);
    if (root.IsMap()) {
      for (const std::string& assignment : overrides) {
        const std::string fault = Override(assignment, &root);
        if (!fault.empty()) return BadUsage(fault);
      }
    }
    YamlSection file(root, "", &complaint);
    file.Read("seed", &scenario.seed);
    file.Read("duration_s", &scenario.duration_s, Range::kPositive);
    file.Read("margin_s", &scenario.margin_s, Range::kPositive);
    file.Read("start_ns", &scenario.start_ns);
    Read(file.Child("motion"), &scenario.motion);
    Read(file.Child("scene"), &scenario.scene);
    Read(file.Child("camera"), &scenario.camera);
    Read(file.Child("mount"), &scenario.mount);
    Read(file.Child("gyro"), &scenario.gyro);
    Read(file.Child("tracks"), &scenario.tracks);
    Read(file.Child("attitudes"), &scenario.attitudes);
    Read(file.Child("video"), &scenario.video);
    Read(file.Child("effects"), &scenario.effects);
    Read(file.Child("log"), &scenario.log_files);
    file.Finish();
  } catch (const YAML::Exception& error) {
    complaint = "line " + std::to_string(error.mark.line + 1) + ": " + error.msg;
  }
  if (complaint.empty()) complaint = CheckTogether(scenario);
  if (!complaint.empty()) return BadInput(complaint);
  return scenario;
}

Result<Scenario> LoadScenario(const std::string& path, const std::vector<std::string>& overrides) {
  std::ifstream file(path);
  if (!file) return BadInput(path + ": cannot open the scenario");
  std::stringstream text;
  text << file.rdbuf();
  Result<Scenario> scenario = ParseScenario(text.str(), overrides);
  if (!scenario) {
    Error error = scenario.error();
    error.message = path + ": " + error.message;
    return tl::unexpected(error);
  }
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  DeviceLogFiles& log = scenario->log_files;
  for (std::string* name : {&scenario->motion.file, &log.gyro, &log.frames, &log.lens_shift}) {
    MakeRelativeTo(folder, name);
  }
  if (const Status taken = TakeLog(&*scenario); !taken) return tl::unexpected(taken.error());
  return scenario;
}

std::vector<std::string> ActiveEffects(const Effects& effects) {
  std::vector<std::string> names;
  effects.ForEach([&](const auto& effect) {
    if (effect.active()) names.emplace_back(effect.kName);
  });
  return names;
}

}  // namespace camgyro::simulation
