#include "frontend/readers/ios_logger_reader.h"

#include <filesystem>
#include <vector>

#include "core/robust_statistics.h"
#include "frontend/readers/add_pictures.h"
#include "frontend/readers/csv_reader.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/readers/sample_rows.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

Status ReadGyro(const std::string& file, Recording* recording) {
  CsvReader csv(file, {"time [s]", "x [rad/s]", "y [rad/s]", "z [rad/s]"}, {4});
  SampleColumns columns;
  columns.time_unit_s = 1.0;
  columns.gyro = {1, 2, 3};
  return ReadGyroRows(file, columns, &csv, recording);
}

Status ReadAccel(const std::string& file, Recording* recording) {
  CsvReader csv(file, {"time [s]", "x [g]", "y [g]", "z [g]"}, {4});
  SampleColumns columns;
  columns.time_unit_s = 1.0;
  columns.accel = {1, 2, 3};
  columns.accel_map *= -kStandardGravity;
  return ReadAccelRows(file, columns, &csv, recording);
}

Status ReadFrames(const std::string& file, FrameOrder* order, Recording* recording) {
  CsvReader csv(file, {"time [s]", "number", "fx [px]", "fy [px]", "cx [px]", "cy [px]"}, {2, 6});
  std::vector<double> fx, fy, cx, cy;
  while (csv.NextRow()) {
    AddFrame(csv.Time(0, 1.0), csv, order, recording);
    if (csv.width() < 6) continue;
    fx.push_back(csv.Number(2));
    fy.push_back(csv.Number(3));
    cx.push_back(csv.Number(4));
    cy.push_back(csv.Number(5));
    if (!(fx.back() > 0.0) || !(fy.back() > 0.0)) csv.Fail("expected focal lengths above zero");
    if (!csv.status()) break;
  }
  if (!csv.status() || fx.empty()) return csv.status();
  CameraGuess& camera = recording->camera;
  camera.focal_px = MedianInPlace(&fy);
  camera.aspect_ratio = MedianInPlace(&fx) / *camera.focal_px;
  camera.principal_px = Eigen::Vector2d(MedianInPlace(&cx), MedianInPlace(&cy));
  return {};
}

Status ReadPoses(const std::string& file, FrameOrder* order, Recording* recording) {
  CsvReader csv(file, {"time [s]", "x [m]", "y [m]", "z [m]", "qw", "qx", "qy", "qz"}, {8});
  recording->frames.clear();
  while (csv.NextRow()) {
    AddFrame(csv.Time(0, 1.0), csv, order, recording);
    recording->q_cam_world.push_back(ReadQuaternion(4, {5, 6, 7}, &csv).conjugate());
  }
  return csv.status();
}

}  // namespace

bool IsIosLogger(const std::string& folder) {
  const fs::path root(folder);
  return fs::is_regular_file(root / "Gyro.txt") &&
         (fs::is_regular_file(root / "Frames.txt") || fs::is_regular_file(root / "ARposes.txt"));
}

Result<Recording> ReadIosLogger(const std::string& folder) {
  const auto file = [&](const char* name) { return (fs::path(folder) / name).string(); };
  const auto exists = [&](const char* name) { return fs::is_regular_file(file(name)); };
  const bool has_video = exists("Frames.m4v") && exists("Frames.txt");
  if (!has_video && !exists("ARposes.txt")) {
    return BadInput(Concat(folder,
                           ": has Gyro.txt of ios_logger, but neither Frames.m4v with Frames.txt "
                           "nor ARposes.txt"));
  }
  Recording recording;
  recording.path = folder;
  Status status = ReadGyro(file("Gyro.txt"), &recording);
  if (status && exists("Accel.txt")) status = ReadAccel(file("Accel.txt"), &recording);
  const std::string frames = file(has_video ? "Frames.txt" : "ARposes.txt");
  FrameOrder order;
  if (status) status = (has_video ? ReadFrames : ReadPoses)(frames, &order, &recording);
  if (status) status = CheckFrames(frames, recording.frames);
  if (status && has_video) status = AddVideo(file("Frames.m4v"), frames, frames, &recording);
  if (status) status = order.Mend(frames, &recording);
  if (!status) return tl::unexpected(status.error());
  if (!has_video) {
    recording.notes.push_back(folder +
                              ": has no Frames.m4v; the attitudes of ARposes.txt are used");
  }
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
