#include "frontend/readers/stray_scanner_reader.h"

#include <cmath>
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

// Between 1 and 9.8: where the median of |a| tells g from m/s^2. A phone that is carried has 1 g.
constexpr double kLargestInG = 3.0;

Status ReadImu(const std::string& file, Recording* recording) {
  CsvReader csv = CsvReader::ByName(file);
  SampleColumns columns;
  columns.time = csv.Column({"timestamp"});
  columns.time_unit_s = 1.0;
  columns.gyro = VectorColumns({"alpha_x", "alpha_y", "alpha_z"}, &csv);
  columns.accel = VectorColumns({"a_x", "a_y", "a_z"}, &csv);
  if (!csv.status()) return csv.status();
  if (Status rows = ReadGyroRows(file, columns, &csv, recording); !rows) return rows;
  std::vector<double> sizes;
  for (const AccelSample& sample : recording->accel) sizes.push_back(sample.accel_gyro_m_s2.norm());
  const bool in_g = MedianInPlace(&sizes) < kLargestInG;
  if (in_g) recording->notes.push_back(file + ": accelerations taken to be in g");
  for (AccelSample& sample : recording->accel) {
    sample.accel_gyro_m_s2 *= in_g ? -kStandardGravity : -1.0;
  }
  return {};
}

Status ReadOdometry(const std::string& file, FrameOrder* order, Recording* recording) {
  CsvReader csv = CsvReader::ByName(file);
  const size_t time = csv.Column({"timestamp"});
  const size_t w = csv.Column({"qw"});
  const auto xyz = VectorColumns({"qx", "qy", "qz"}, &csv);
  if (!csv.status()) return csv.status();
  while (csv.NextRow()) {
    AddFrame(csv.Time(time, 1.0), csv, order, recording);
    const Eigen::Quaterniond q_world_cam = ReadQuaternion(w, xyz, &csv);
    recording->q_cam_world.push_back(q_world_cam.conjugate());
  }
  return csv.status();
}

Status ReadCameraMatrix(const std::string& file, CameraGuess* camera) {
  CsvReader csv(file, {"column 1", "column 2", "column 3"}, {3});
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  for (int row = 0; row < 3 && csv.NextRow(); ++row) {
    K.row(row) << csv.Number(0), csv.Number(1), csv.Number(2);
  }
  if (!csv.status()) return csv.status();
  if (!(K(0, 0) > 0.0) || !(K(1, 1) > 0.0)) {
    return BadInput(file + ": expected a 3 x 3 matrix with focal lengths above zero");
  }
  camera->focal_px = K(1, 1);
  camera->aspect_ratio = K(0, 0) / K(1, 1);
  camera->principal_px = Eigen::Vector2d(K(0, 2), K(1, 2));
  return {};
}

}  // namespace

bool IsStrayScanner(const std::string& folder) {
  return fs::is_regular_file(fs::path(folder) / "odometry.csv") &&
         fs::is_regular_file(fs::path(folder) / "imu.csv");
}

Result<Recording> ReadStrayScanner(const std::string& folder) {
  const auto file = [&](const char* name) { return (fs::path(folder) / name).string(); };
  Recording recording;
  recording.path = folder;
  Status status = ReadImu(file("imu.csv"), &recording);
  FrameOrder order;
  if (status) status = ReadOdometry(file("odometry.csv"), &order, &recording);
  if (status) status = CheckFrames(file("odometry.csv"), recording.frames);
  if (status && fs::is_regular_file(file("camera_matrix.csv"))) {
    status = ReadCameraMatrix(file("camera_matrix.csv"), &recording.camera);
  }
  if (status && fs::is_regular_file(file("rgb.mp4"))) {
    recording.q_cam_world.clear();  // the pictures themselves tell more
    status = AddVideo(file("rgb.mp4"), file("odometry.csv"), file("odometry.csv"), &recording);
  } else if (status) {
    recording.notes.push_back(folder + ": has no rgb.mp4; the attitudes of odometry.csv are used");
  }
  if (status) status = order.Mend(file("odometry.csv"), &recording);
  if (!status) return tl::unexpected(status.error());
  NoteClocks(&recording);
  return recording;
}

}  // namespace camgyro
