// Geometry between a rolling-shutter picture and the picture of a virtual camera that exposes all
// rows at once, from an orientation of one's choice.
#ifndef CAMGYRO_TOOLS_STABILIZATION_FRAME_WARP_H_
#define CAMGYRO_TOOLS_STABILIZATION_FRAME_WARP_H_

#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/calibration.h"
#include "core/lens.h"
#include "tools/stabilization/camera_path.h"

namespace camgyro {

// The camera of the picture that is made.
struct VirtualCamera {
  int width_px = 0, height_px = 0;
  DistortionModel model = DistortionModel::kNone;
  LensParameters lens = LensParameters::Zero();

  // Size and lens of the calibrated one.
  explicit VirtualCamera(const Calibration& calibration);
  // The calibrated one without its distortion, zoomed about the centre of the picture, so that at
  // zoom 1 and from the camera's own orientation the picture stays where it is.
  VirtualCamera(const Calibration& calibration, int width_px, int height_px, double zoom);
  // Nothing where the lens has no ray.
  std::optional<Eigen::Vector3d> Ray(const Eigen::Vector2d& px) const;
  // Nothing for rays that do not point forwards.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& ray) const;
};

class FrameWarp {
 public:
  // `calibration` is the one of the path; both must outlive this.
  FrameWarp(const CameraPath& path, const Calibration& calibration, int frame,
            const Eigen::Quaterniond& q_world_virtual, const VirtualCamera& camera);

  // Where a point of the picture, infinitely far away, is in the virtual one; and back. Nothing
  // where lens or virtual camera have no such point. The way back finds the row's time by
  // iteration, to 0.01 px for rows within a picture height of the picture.
  std::optional<Eigen::Vector2d> ToVirtual(const Eigen::Vector2d& px) const;
  std::optional<Eigen::Vector2d> ToSource(const Eigen::Vector2d& px_virtual) const;

  // ToSource of every pixel, interpolated in a mesh of 16 px: maps for cv::remap, CV_32FC1.
  void Maps(cv::Mat* map_x, cv::Mat* map_y) const;

 private:
  static constexpr int kRows = 33;  // of the table, from half a height above to half below
  struct Row {
    Eigen::Matrix3d R_virtual_cam;
    LensParameters lens;
  };
  // Of any row, between those of the table.
  Row At(double row_px) const;

  const Calibration& calibration_;
  const Lens& lens_;
  VirtualCamera camera_;
  std::array<Row, kRows> table_;
};

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_STABILIZATION_FRAME_WARP_H_
