#include "simulation/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace camgyro::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Rays are exact at nodes this far apart and linear between them: < 0.02 px at k1 = -0.3.
constexpr int kNodeStep = 8;

std::mt19937_64 MakeRandom(uint64_t seed, uint32_t stream) {
  std::seed_seq sequence{static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32), stream};
  return std::mt19937_64(sequence);
}

}  // namespace

Renderer::Renderer(const Simulated& simulated, const Scenario& scenario)
    : scenario_(scenario),
      camera_(*simulated.camera),
      scene_(simulated.scene),
      frames_(simulated.frames),
      random_(MakeRandom(scenario.seed, 100)) {
  textures_.emplace_back(&random_);
  std::mt19937_64 more = MakeRandom(scenario.seed, 101);
  for (const Surface& surface : scene_.surfaces()) {
    while (static_cast<int>(textures_.size()) <= surface.texture) textures_.emplace_back(&more);
  }
  std::normal_distribution<float> normal;
  for (int i = 0; i < 1 << 16; ++i) normals_.push_back(normal(random_));
  for (int i = 0; i < static_cast<int>(scene_.surfaces().size()); ++i) {
    if (scene_.surfaces()[static_cast<size_t>(i)].shape != Shape::kBox) unbounded_.push_back(i);
  }
}

cv::Mat Renderer::Render(size_t frame) {
  const FrameTiming& timing = frames_[frame].timing;
  const cv::Mat sensor = RenderSensor(timing);
  return camera_.stabilises() ? Warp(timing, sensor) : sensor;
}

cv::Mat Renderer::RenderSensor(const FrameTiming& timing) {
  const CameraOptions& camera = scenario_.camera;
  FindBoxes(timing);
  // As many samples as the blur is long, in pixels.
  const Vector2d centre(0.5 * camera.width_px, 0.5 * camera.height_px);
  const CameraState state = camera_.trajectory().At(camera_.ExposureTime(timing, centre));
  const double blur_px = (state.omega_cam_rad_s.norm() + 0.3 * state.v_world_m_s.norm()) *
                         timing.exposure_s * camera.focal_px;
  const std::vector<Sample> samples = SamplesOfPixel(
      std::clamp(static_cast<int>(std::ceil(blur_px)), 4, scenario_.video.max_blur_samples));

  const bool columns = scenario_.effects.readout_direction.columns;
  const int lines = columns ? camera.width_px : camera.height_px;
  cv::Mat brightness(camera.height_px, camera.width_px, CV_32F);
  std::vector<float> values;
  for (int line = 0; line < lines; ++line) {
    RenderLine(timing, line, samples, &values);
    cv::Mat target = columns ? brightness.col(line) : brightness.row(line);
    cv::Mat(values).reshape(1, target.rows).copyTo(target);
  }
  cv::Mat picture;
  AddNoise(brightness, &picture);
  return picture;
}

// Where boxes may be seen: their corners, seen at three times of the readout, and a margin.
void Renderer::FindBoxes(const FrameTiming& timing) {
  const CameraOptions& camera = scenario_.camera;
  const double width = camera.width_px, height = camera.height_px;
  boxes_.clear();
  for (int i = 0; i < static_cast<int>(scene_.surfaces().size()); ++i) {
    const Surface& surface = scene_.surfaces()[static_cast<size_t>(i)];
    if (surface.shape != Shape::kBox) continue;
    Box box{i, 1e9, -1e9, 1e9, -1e9};
    bool in_front = false, partly_behind = false;
    for (const double part : {0.0, 0.5, 1.0}) {
      const double time_s = camera_.ExposureTime(timing, {part * width, part * height});
      const CameraState state = camera_.trajectory().At(time_s);
      for (int corner = 0; corner < 8; ++corner) {
        const Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
        const Vector3d world =
            surface.centre_m + scene_.Offset(i, time_s) + sign.cwiseProduct(surface.half_m);
        const Vector3d point = state.R_world_cam.transpose() * (world - state.p_world_m);
        in_front = in_front || point.z() > 0.05;
        const auto px = point.z() > 0.05 ? camera_.Project(point, time_s) : std::nullopt;
        partly_behind = partly_behind || !px;
        if (!px) continue;
        box.u_min = std::min(box.u_min, px->x());
        box.u_max = std::max(box.u_max, px->x());
        box.v_min = std::min(box.v_min, px->y());
        box.v_max = std::max(box.v_max, px->y());
      }
    }
    if (!in_front) continue;
    const double margin = 10.0 + 0.1 * std::max(box.u_max - box.u_min, box.v_max - box.v_min);
    if (partly_behind) {
      box = {i, 0.0, width, 0.0, height};
    } else {
      box = {i, box.u_min - margin, box.u_max + margin, box.v_min - margin, box.v_max + margin};
    }
    if (box.u_max < 0.0 || box.v_max < 0.0 || box.u_min > width || box.v_min > height) continue;
    boxes_.push_back(box);
  }
}

std::vector<Sample> SamplesOfPixel(int least) {
  int count = least;
  while (count % 3 == 0 || count % 5 == 0) ++count;
  const auto spaced = [count](int index) { return (index % count + 0.5) / count - 0.5; };
  std::vector<Sample> samples;
  for (int k = 0; k < count; ++k) {
    samples.push_back({spaced(k), Vector2d(spaced(3 * k + 1), spaced(5 * k + 2))});
  }
  return samples;
}

void Renderer::RenderLine(const FrameTiming& timing, int line, const std::vector<Sample>& samples,
                          std::vector<float>* brightness) {
  const CameraOptions& camera = scenario_.camera;
  const bool columns = scenario_.effects.readout_direction.columns;
  const int length = columns ? camera.height_px : camera.width_px;
  const auto pixel = [&](double along) {
    return columns ? Vector2d(line, along) : Vector2d(along, line);
  };
  const double line_time_s = camera_.ExposureTime(timing, pixel(0.0));
  const Vector2d line_shift = camera_.StabiliserShift(line_time_s);
  const Vector2d focal(camera.focal_px * scenario_.effects.aspect_ratio.ratio, camera.focal_px);

  std::vector<Vector3d> nodes;  // rays of the pixels kNodeStep apart
  for (int along = 0; along < length + kNodeStep; along += kNodeStep) {
    nodes.push_back(camera_.Unproject(pixel(along), line_time_s).value_or(Vector3d::Zero()));
  }
  std::vector<std::vector<int>> candidates(nodes.size(), unbounded_);
  for (const Box& box : boxes_) {
    const double across_min = columns ? box.u_min : box.v_min;
    const double across_max = columns ? box.u_max : box.v_max;
    if (line < across_min || line > across_max) continue;
    const double along_min = columns ? box.v_min : box.u_min;
    const double along_max = columns ? box.v_max : box.u_max;
    for (size_t node = 0; node < nodes.size(); ++node) {
      const double begin = static_cast<double>(node) * kNodeStep;
      if (begin + kNodeStep >= along_min && begin <= along_max) {
        candidates[node].push_back(box.surface);
      }
    }
  }

  brightness->assign(static_cast<size_t>(length), 0.0f);
  for (const Sample& sample : samples) {
    const double time_s = line_time_s + timing.exposure_s * sample.time;
    const CameraState state = camera_.trajectory().At(time_s);
    const Vector2d shift = camera_.StabiliserShift(time_s) - line_shift;
    const Vector2d offset = (sample.offset_px - shift).cwiseQuotient(focal);
    for (size_t node = 0; node + 1 < nodes.size(); ++node) {
      if (nodes[node].z() == 0.0 || nodes[node + 1].z() == 0.0) continue;  // the lens is blind here
      Vector3d ray = nodes[node];
      ray.head<2>() += offset;
      Vector3d direction = state.R_world_cam * ray;
      const Vector3d step = state.R_world_cam * (nodes[node + 1] - nodes[node]) / kNodeStep;
      const int begin = static_cast<int>(node) * kNodeStep;
      const int end = std::min(begin + kNodeStep, length);
      for (int along = begin; along < end; ++along, direction += step) {
        std::optional<Hit> nearest;
        for (const int surface : candidates[node]) {
          const auto hit = scene_.CastSurface(surface, state.p_world_m, direction, time_s);
          if (hit && (!nearest || hit->distance < nearest->distance)) nearest = hit;
        }
        if (!nearest) continue;
        (*brightness)[static_cast<size_t>(along)] +=
            Shade(*nearest, state.p_world_m, direction, time_s);
      }
    }
  }
  for (float& value : *brightness) value /= static_cast<float>(samples.size());
}

float Renderer::Shade(const Hit& hit, const Vector3d& origin, const Vector3d& direction,
                      double time_s) const {
  constexpr float kLight[4] = {0.8f, 0.9f, 1.0f, 0.95f};  // by the side that a face looks to
  const Surface& surface = scene_.surfaces()[static_cast<size_t>(hit.surface)];
  Vector3d local = origin + hit.distance * direction - surface.centre_m;
  if (surface.moving()) local -= scene_.Offset(hit.surface, time_s);
  double a, b, cosine = 1.0;
  if (hit.face == 3) {
    a = std::atan2(local.x(), local.z()) * surface.half_m.x();
    b = std::asin(local.y() / surface.half_m.x()) * surface.half_m.x();
  } else {
    a = local[hit.face == 0 ? 2 : 0];
    b = local[hit.face == 1 ? 2 : 1];
    cosine = std::abs(direction[hit.face]) / direction.norm();
  }
  // Faces on either side differ, and so do their axes.
  const double face_shift = 0.31 * hit.face + (hit.face < 3 && local[hit.face] > 0.0 ? 0.17 : 0.0);
  // The pixel's longer edge on the surface; a third less, since the samples' offsets smooth too.
  const double footprint_m =
      hit.distance / scenario_.camera.focal_px * std::max(1.0, 0.67 / cosine);
  const double tiles = 1.0 / surface.tile_m;
  const Texture& texture = textures_[static_cast<size_t>(surface.texture)];
  const float albedo = texture.At(a * tiles + surface.texture_shift.x() + face_shift,
                                  b * tiles + surface.texture_shift.y(), footprint_m * tiles);
  return kLight[hit.face] * (0.08f + 0.9f * albedo);
}

void Renderer::AddNoise(const cv::Mat& brightness, cv::Mat* picture) {
  const VideoOptions& video = scenario_.video;
  const auto width = static_cast<float>(brightness.cols),
             height = static_cast<float>(brightness.rows);
  const float corner_sq = 0.25f * (width * width + height * height);
  const auto full_well = static_cast<float>(video.full_well_electrons);
  const auto read_sq = static_cast<float>(video.read_noise_electrons * video.read_noise_electrons);
  picture->create(brightness.rows, brightness.cols, CV_8U);
  for (int v = 0; v < brightness.rows; ++v) {
    const auto* from = brightness.ptr<float>(v);
    auto* to = picture->ptr<uint8_t>(v);
    const float dv = static_cast<float>(v) - 0.5f * height;
    uint64_t bits = 0;
    for (int u = 0; u < brightness.cols; ++u) {
      if (u % 4 == 0) bits = random_();
      const float normal = normals_[bits & 0xffff];
      bits >>= 16;
      const float du = static_cast<float>(u) - 0.5f * width;
      const float fall = static_cast<float>(video.vignetting) * (du * du + dv * dv) / corner_sq;
      float light = from[u] * (1.0f - fall);
      if (full_well > 0.0f) light += normal * std::sqrt(light * full_well + read_sq) / full_well;
      to[u] = cv::saturate_cast<uint8_t>(255.0f * light);
    }
  }
}

// Electronic stabilisation as a device does it: resamples the finished picture, along a mesh.
cv::Mat Renderer::Warp(const FrameTiming& timing, const cv::Mat& sensor) const {
  constexpr int kMesh = 16;  // [px]
  const int columns = sensor.cols / kMesh + 2, rows = sensor.rows / kMesh + 2;
  cv::Mat mesh(rows, columns, CV_32FC2);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Vector2d from = camera_.Destabilise(timing, Vector2d(i * kMesh, j * kMesh))
                                .value_or(Vector2d(-1e4, -1e4));
      mesh.at<cv::Vec2f>(j, i) = {static_cast<float>(from.x()), static_cast<float>(from.y())};
    }
  }
  cv::Mat map(sensor.rows, sensor.cols, CV_32FC2);
  for (int v = 0; v < sensor.rows; ++v) {
    for (int u = 0; u < sensor.cols; ++u) {
      const int i = u / kMesh, j = v / kMesh;
      const float a = static_cast<float>(u % kMesh) / kMesh,
                  b = static_cast<float>(v % kMesh) / kMesh;
      map.at<cv::Vec2f>(v, u) =
          (mesh.at<cv::Vec2f>(j, i) * (1 - a) + mesh.at<cv::Vec2f>(j, i + 1) * a) * (1 - b) +
          (mesh.at<cv::Vec2f>(j + 1, i) * (1 - a) + mesh.at<cv::Vec2f>(j + 1, i + 1) * a) * b;
    }
  }
  cv::Mat picture;
  cv::remap(sensor, picture, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return picture;
}

}  // namespace camgyro::simulation
