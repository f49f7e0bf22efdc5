#include "tools/stabilization/frame_warp.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace camgyro {
namespace {

constexpr int kMeshPx = 16;
constexpr float kNowhere = -1e4f;  // far outside of every picture

}  // namespace

VirtualCamera::VirtualCamera(const Calibration& calibration)
    : width_px(calibration.width_px),
      height_px(calibration.height_px),
      model(calibration.distortion_model),
      lens(calibration.lens) {}

VirtualCamera::VirtualCamera(const Calibration& calibration, int width, int height, double zoom)
    : width_px(width), height_px(height) {
  const Eigen::Vector2d centre(0.5 * (width - 1), 0.5 * (height - 1));
  lens = MakePinhole(zoom * calibration.lens[kFocal],
                     centre + zoom * (calibration.lens.segment<2>(kCx) - centre),
                     calibration.lens[kAspect]);
}

std::optional<Eigen::Vector3d> VirtualCamera::Ray(const Eigen::Vector2d& px) const {
  RayJet jet;
  if (!GetLens(model).Unproject(px, lens, &jet, LensDerivatives::kNone)) return std::nullopt;
  return jet.ray;
}

std::optional<Eigen::Vector2d> VirtualCamera::Project(const Eigen::Vector3d& ray) const {
  if (!(ray.z() > 1e-3 * ray.norm())) return std::nullopt;
  return GetLens(model).Project(ray, lens);
}

FrameWarp::FrameWarp(const CameraPath& path, const Calibration& calibration, int frame,
                     const Eigen::Quaterniond& q_world_virtual, const VirtualCamera& camera)
    : calibration_(calibration), lens_(GetLens(calibration.distortion_model)), camera_(camera) {
  const Eigen::Matrix3d R_virtual_world = q_world_virtual.conjugate().toRotationMatrix();
  for (int i = 0; i < kRows; ++i) {
    const double row = calibration.height_px * (2.0 * i / (kRows - 1) - 0.5);
    table_[static_cast<size_t>(i)] = {R_virtual_world * path.R_world_cam(frame, row),
                                      calibration.lens + path.LensChange(frame, row)};
  }
}

FrameWarp::Row FrameWarp::At(double row_px) const {
  // Entries are some 1 ms apart: at 20 rad/s^2 and 2 rad/s a mean of two is 5e-6 off.
  const double place =
      std::clamp((row_px / calibration_.height_px + 0.5) * 0.5 * (kRows - 1), 0.0, kRows - 1.0);
  const size_t low = std::min(static_cast<size_t>(place), static_cast<size_t>(kRows - 2));
  const double weight = place - static_cast<double>(low);
  const Row &before = table_[low], &after = table_[low + 1];
  return {(1.0 - weight) * before.R_virtual_cam + weight * after.R_virtual_cam,
          (1.0 - weight) * before.lens + weight * after.lens};
}

std::optional<Eigen::Vector2d> FrameWarp::ToVirtual(const Eigen::Vector2d& px) const {
  RayJet jet;
  const Row row = At(px.y());
  if (!lens_.Unproject(px, row.lens, &jet, LensDerivatives::kNone)) return std::nullopt;
  return camera_.Project(row.R_virtual_cam * jet.ray);
}

std::optional<Eigen::Vector2d> FrameWarp::ToSource(const Eigen::Vector2d& px_virtual) const {
  const std::optional<Eigen::Vector3d> ray = camera_.Ray(px_virtual);
  if (!ray) return std::nullopt;
  // A row later is seen line_delay later, when the point has moved by far less than a row.
  double row_px = std::clamp(px_virtual.y(), 0.0, static_cast<double>(calibration_.height_px));
  std::optional<Eigen::Vector2d> px;
  for (int i = 0; i < 6; ++i) {
    const Row row = At(row_px);
    px = lens_.Project(row.R_virtual_cam.transpose() * *ray, row.lens);
    if (!px || std::abs(px->y() - row_px) < 0.02) break;
    row_px = px->y();
  }
  return px;
}

void FrameWarp::Maps(cv::Mat* map_x, cv::Mat* map_y) const {
  const int columns = (camera_.width_px + kMeshPx - 1) / kMeshPx + 1;
  const int rows = (camera_.height_px + kMeshPx - 1) / kMeshPx + 1;
  std::vector<cv::Vec2f> mesh(static_cast<size_t>(rows * columns), {kNowhere, kNowhere});
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const auto px = ToSource({kMeshPx * column, kMeshPx * row});
      if (!px) continue;
      mesh[static_cast<size_t>(row * columns + column)] = {static_cast<float>(px->x()),
                                                           static_cast<float>(px->y())};
    }
  }
  map_x->create(camera_.height_px, camera_.width_px, CV_32FC1);
  map_y->create(camera_.height_px, camera_.width_px, CV_32FC1);
  std::vector<cv::Vec2f> line(static_cast<size_t>(columns));
  for (int v = 0; v < camera_.height_px; ++v) {
    const cv::Vec2f* above = &mesh[static_cast<size_t>(v / kMeshPx * columns)];
    const float weight = static_cast<float>(v % kMeshPx) / kMeshPx;
    for (int i = 0; i < columns; ++i) {
      line[static_cast<size_t>(i)] = (1.0f - weight) * above[i] + weight * above[columns + i];
    }
    auto* const x = map_x->ptr<float>(v);
    auto* const y = map_y->ptr<float>(v);
    for (int i = 0; i + 1 < columns; ++i) {
      const cv::Vec2f from = line[static_cast<size_t>(i)];
      const cv::Vec2f slope = (line[static_cast<size_t>(i) + 1] - from) * (1.0f / kMeshPx);
      const int first = kMeshPx * i, last = std::min(first + kMeshPx, camera_.width_px);
      for (int u = first; u < last; ++u) {
        x[u] = from[0] + static_cast<float>(u - first) * slope[0];
        y[u] = from[1] + static_cast<float>(u - first) * slope[1];
      }
    }
  }
}

}  // namespace camgyro
