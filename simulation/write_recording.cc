#include "simulation/write_recording.h"

#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "core/recording_csv.h"
#include "core/time.h"
#include "simulation/render.h"
#include "simulation/video_encoder.h"

namespace camgyro::simulation {
namespace {

namespace fs = std::filesystem;

// A text file that remembers whether all went well.
class TextFile {
 public:
  explicit TextFile(const fs::path& path) : path_(path), file_(std::fopen(path.c_str(), "w")) {}
  ~TextFile() {
    if (file_ != nullptr) std::fclose(file_);
  }
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  [[gnu::format(printf, 2, 3)]] void Print(const char* format, ...) {
    if (file_ == nullptr) return;
    va_list arguments;
    va_start(arguments, format);
    std::vfprintf(file_, format, arguments);
    va_end(arguments);
  }

  Status Close() {
    bool good = file_ != nullptr && std::ferror(file_) == 0;
    if (file_ != nullptr) good = std::fclose(std::exchange(file_, nullptr)) == 0 && good;
    if (!good) return BadInput(path_.string() + ": cannot be written");
    return {};
  }

 private:
  fs::path path_;
  std::FILE* file_;
};

Status WriteText(const fs::path& path, const std::string& text) {
  TextFile file(path);
  file.Print("%s", text.c_str());
  return file.Close();
}

long long Stamp(int64_t stamp_ns) { return static_cast<long long>(stamp_ns); }

std::string ImageName(const Frame& frame) { return std::to_string(frame.stamp_ns) + ".png"; }

// Tracks that the simulation has kept, or else made here, frame by frame: with their truth, those
// of an hour do not fit into a gigabyte.
Status WriteTracks(const Simulated& s, const Scenario& scenario, const fs::path& path) {
  constexpr int kDecimals = 9;
  TextFile file(path);
  file.Print("%s", TracksCsvHeader().c_str());
  const auto write = [&](size_t i, const std::vector<TrackedPoint>& tracks) {
    file.Print("%s", TracksCsvRows(s.recording.frames[i].stamp_ns, tracks, kDecimals).c_str());
  };
  for (size_t i = 0; i < s.recording.tracks.size(); ++i) write(i, s.recording.tracks[i]);
  if (s.recording.tracks.empty()) {
    ForEachFrame(scenario, s,
                 [&](size_t i, std::vector<TrackedPoint>* tracks,
                     std::vector<PointTruth>* /*truth*/) { write(i, *tracks); });
  }
  return file.Close();
}

Status WriteAttitudes(const Simulated& s, const fs::path& path) {
  TextFile file(path);
  file.Print("#timestamp [ns],q_cam_world_w,q_cam_world_x,q_cam_world_y,q_cam_world_z\n");
  for (size_t i = 0; i < s.recording.q_cam_world.size(); ++i) {
    const Eigen::Quaterniond& q = s.recording.q_cam_world[i];
    file.Print("%lld,%.12f,%.12f,%.12f,%.12f\n", Stamp(s.recording.frames[i].stamp_ns), q.w(),
               q.x(), q.y(), q.z());
  }
  return file.Close();
}

Status WriteFrames(const Simulated& s, const Scenario& scenario, const fs::path& cam) {
  std::vector<Frame> frames = s.recording.frames;
  for (Frame& frame : frames) {
    frame.image_file = scenario.video.format == VideoFormat::kPng ? ImageName(frame) : "";
  }
  return WriteText(cam / "data.csv", FramesCsv(frames));
}

Status WriteSensorYaml(const Simulated& s, const Scenario& scenario, const fs::path& root) {
  TextFile cam(root / "cam0/sensor.yaml");
  cam.Print("sensor_type: camera\nrate_hz: %.9g\nresolution: [%d, %d]\n", scenario.camera.rate_hz,
            scenario.camera.width_px, scenario.camera.height_px);
  const CameraGuess& guess = s.recording.camera;
  if (guess.focal_px) {
    cam.Print("camera_model: pinhole\nintrinsics: [%.9g, %.9g, %.9g, %.9g]\n",
              *guess.focal_px * guess.aspect_ratio, *guess.focal_px, guess.principal_px->x(),
              guess.principal_px->y());
  }
  if (Status status = cam.Close(); !status) return status;
  TextFile imu(root / "imu0/sensor.yaml");
  imu.Print("sensor_type: imu\nrate_hz: %.9g\n", scenario.gyro.rate_hz);
  if (scenario.gyro.noise_density_rad_s_rtHz > 0.0) {
    imu.Print("gyroscope_noise_density: %.9g\n", scenario.gyro.noise_density_rad_s_rtHz);
  }
  if (scenario.gyro.bias_walk_rad_s2_rtHz > 0.0) {
    imu.Print("gyroscope_random_walk: %.9g\n", scenario.gyro.bias_walk_rad_s2_rtHz);
  }
  return imu.Close();
}

Status WriteTruth(const Simulated& s, const Scenario& scenario, const fs::path& root) {
  const Calibration& truth = s.truth;
  const LensParameters& lens = truth.lens;
  TextFile file(root / "truth.yaml");
  file.Print("# What is true of this simulated recording; keys of calibration.yaml.\n");
  file.Print("camera:\n  resolution: [%d, %d]\n  focal_px: {value: %.9g}\n", truth.width_px,
             truth.height_px, lens[kFocal]);
  file.Print("  principal_px: {value: [%.9g, %.9g]}\n  aspect_ratio: {value: %.9g}\n", lens[kCx],
             lens[kCy], lens[kAspect]);
  if (truth.distortion_model == DistortionModel::kNone) {
    file.Print("  distortion: {model: none, value: []}\n");
  } else {
    const Eigen::Vector4d k = lens.segment<4>(FirstCoefficient(truth.distortion_model));
    file.Print("  distortion: {model: %s, value: [%.9g, %.9g, %.9g, %.9g]}\n",
               DistortionModelName(truth.distortion_model).c_str(), k[0], k[1], k[2], k[3]);
  }
  file.Print("shutter: {readout_s: {value: %.9g}}\n", truth.readout_s);
  file.Print("clock: {delay_s: {value: %.9g}}  # without the effects below\n", truth.delay_s);
  const Eigen::Vector3d& b = truth.bias_gyro_rad_s;
  file.Print("gyro: {bias_rad_s: {value: [%.9g, %.9g, %.9g]}}  # at the first sample\n", b.x(),
             b.y(), b.z());
  const Eigen::Quaterniond& q = truth.q_gyro_cam;
  file.Print("extrinsics: {q_gyro_cam_wxyz: {value: [%.12g, %.12g, %.12g, %.12g]}}\n", q.w(), q.x(),
             q.y(), q.z());
  file.Print(ActiveEffects(scenario.effects).empty() ? "effects: []\n" : "effects:\n");
  scenario.effects.ForEach([&](const auto& effect) {
    if (!effect.active()) return;
    file.Print("  - name: %s\n    parameters:\n", effect.kName);
    for (const TruthParameter& p : effect.Truth()) {
      file.Print("      - {name: %s, unit: %s, value: %.9g}\n", p.name, p.unit, p.value);
    }
  });
  if (scenario.attitudes.wanted()) {
    file.Print("noise_rad: %.9g\nwalk_rad: %.9g\n", scenario.attitudes.noise_rad,
               scenario.attitudes.walk_rad);
  } else if (scenario.video.format == VideoFormat::kNone) {
    file.Print("noise_px: %.9g\n", scenario.tracks.noise_px);
  }
  file.Print("seed: %llu\n", static_cast<unsigned long long>(scenario.seed));
  return file.Close();
}

// From our world, whose y axis is down, into one whose z axis is up.
Eigen::Matrix3d UpFromDown() {
  Eigen::Matrix3d R_up_down;
  R_up_down << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return R_up_down;
}

Status WriteTrajectory(const Simulated& s, const Scenario& scenario, const fs::path& root) {
  TextFile file(root / "truth_trajectory.csv");
  file.Print(
      "#gyro clock [ns],p_x [m],p_y [m],p_z [m],q_w,q_x,q_y,q_z,frame stamp [ns],delay [s],"
      "focal [px],b_x [rad s^-1],b_y [rad s^-1],b_z [rad s^-1]\n");
  // Pose of the camera at the first row.
  const Eigen::Matrix3d R_up_down = UpFromDown();
  for (size_t i = 0; i < s.frames.size(); ++i) {
    const FrameTruth& frame = s.frames[i];
    const Eigen::Vector3d p = R_up_down * frame.state.p_world_m;
    const Eigen::Quaterniond q(R_up_down * frame.state.R_world_cam);
    const double first_row_s = s.camera->ExposureTime(frame.timing, {0.0, 0.0});
    const Eigen::Vector3d& b = frame.bias_gyro_rad_s;
    file.Print("%lld,%.9f,%.9f,%.9f,%.12f,%.12f,%.12f,%.12f,%lld,%.9f,%.6f,%.9g,%.9g,%.9g\n",
               Stamp(StampAt(scenario.start_ns, first_row_s)), p.x(), p.y(), p.z(), q.w(), q.x(),
               q.y(), q.z(), Stamp(s.recording.frames[i].stamp_ns), frame.delay_s, frame.focal_px,
               b.x(), b.y(), b.z());
  }
  return file.Close();
}

// The pose that `camgyro odometry` estimates: the gyro frame at the middle row, z up.
Status WriteGyroTrajectory(const Simulated& s, const Scenario& scenario, const fs::path& root) {
  TextFile file(root / "truth_trajectory.tum");
  file.Print("# time [s, gyro clock] x y z [m] qx qy qz qw: gyro frame in the world, z up\n");
  const Eigen::Vector2d middle_px(0.5 * scenario.camera.width_px, 0.5 * scenario.camera.height_px);
  for (const FrameTruth& frame : s.frames) {
    const double time_s = s.camera->ExposureTime(frame.timing, middle_px);
    const CameraState state = s.camera->trajectory().At(time_s);
    const Eigen::Matrix3d R_up_gyro =
        UpFromDown() * state.R_world_cam * scenario.mount.q_gyro_cam.conjugate();
    const Eigen::Vector3d p =
        UpFromDown() * state.p_world_m - R_up_gyro * scenario.mount.p_gyro_cam_m;
    const Eigen::Quaterniond q(R_up_gyro);
    const long long time_ns = Stamp(StampAt(scenario.start_ns, time_s));
    file.Print("%lld.%09lld %.9f %.9f %.9f %.12f %.12f %.12f %.12f\n", time_ns / 1000000000,
               time_ns % 1000000000, p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  }
  return file.Close();
}

Status WritePictures(const Simulated& s, const Scenario& scenario, const fs::path& cam,
                     const std::function<void(size_t, size_t)>& progress) {
  std::unique_ptr<VideoEncoder> encoder;
  if (scenario.video.format == VideoFormat::kMp4) {
    auto opened =
        VideoEncoder::Open((cam / "video.mp4").string(), scenario.camera.width_px,
                           scenario.camera.height_px, scenario.camera.rate_hz, scenario.video.crf);
    if (!opened) return tl::unexpected(opened.error());
    encoder = std::move(*opened);
  } else {
    fs::create_directories(cam / "data");
  }
  Renderer renderer(s, scenario);
  for (size_t i = 0; i < s.frames.size(); ++i) {
    const cv::Mat picture = renderer.Render(i);
    const Frame& frame = s.recording.frames[i];
    if (encoder) {
      if (Status status = encoder->Write(picture, frame.stamp_ns); !status) return status;
    } else if (const fs::path file = cam / "data" / ImageName(frame);
               !cv::imwrite(file.string(), picture)) {
      return BadInput(file.string() + ": cannot be written");
    }
    if (progress) progress(i + 1, s.frames.size());
  }
  return encoder ? encoder->Close() : Status();
}

// Pictures or tracks of another recording in the folder would be taken for this one's.
Status CheckFolder(const Scenario& scenario, bool has_lens_shift, const fs::path& cam) {
  const VideoFormat format = scenario.video.format;
  const bool attitudes = scenario.attitudes.wanted();
  for (const auto& [name, ours] :
       {std::pair("tracks.csv", format == VideoFormat::kNone && !attitudes),
        std::pair("video.mp4", format == VideoFormat::kMp4),
        std::pair("data", format == VideoFormat::kPng), std::pair("matches.csv", false),
        std::pair("attitude.csv", attitudes), std::pair("lens_shift.csv", has_lens_shift)}) {
    if (ours || !fs::exists(cam / name)) continue;
    return BadInput((cam / name).string() +
                    ": belongs to another recording; expected a new or empty folder");
  }
  return {};
}

}  // namespace

Status WriteRecording(const Simulated& simulated, const Scenario& scenario,
                      const std::string& folder,
                      const std::function<void(size_t, size_t)>& progress) {
  const fs::path root(folder);
  try {
    if (Status status =
            CheckFolder(scenario, !simulated.recording.lens_shift.empty(), root / "cam0");
        !status)
      return status;
    fs::create_directories(root / "cam0");
    fs::create_directories(root / "imu0");
    Status status = WriteFrames(simulated, scenario, root / "cam0");
    if (status && scenario.attitudes.wanted()) {
      status = WriteAttitudes(simulated, root / "cam0/attitude.csv");
    } else if (status && scenario.video.format == VideoFormat::kNone) {
      status = WriteTracks(simulated, scenario, root / "cam0/tracks.csv");
    }
    if (status && !simulated.recording.lens_shift.empty()) {
      status =
          WriteText(root / "cam0/lens_shift.csv", LensShiftCsv(simulated.recording.lens_shift));
    }
    if (status) status = WriteText(root / "imu0/data.csv", ImuCsv(simulated.recording));
    if (status) status = WriteSensorYaml(simulated, scenario, root);
    if (status) status = WriteTruth(simulated, scenario, root);
    if (status) status = WriteTrajectory(simulated, scenario, root);
    if (status) status = WriteGyroTrajectory(simulated, scenario, root);
    if (status && scenario.video.format != VideoFormat::kNone) {
      status = WritePictures(simulated, scenario, root / "cam0", progress);
    }
    return status;
  } catch (const std::exception& error) {  // of OpenCV and std::filesystem
    return BadInput(folder + ": " + error.what());
  }
}

}  // namespace camgyro::simulation
