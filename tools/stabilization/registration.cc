#include "tools/stabilization/registration.h"

#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "core/robust_statistics.h"
#include "tools/stabilization/frame_warp.h"

namespace camgyro {
namespace {

constexpr size_t kMinMatches = 8;

// Median distance from the homography that fits best (least median of squares).
std::optional<double> HomographyError(const std::vector<Match>& matches) {
  std::vector<cv::Point2d> a, b, mapped;
  for (const Match& match : matches) {
    a.emplace_back(match.px_a.x(), match.px_a.y());
    b.emplace_back(match.px_b.x(), match.px_b.y());
  }
  const cv::Mat H = cv::findHomography(a, b, cv::LMEDS);
  if (H.empty()) return std::nullopt;
  cv::perspectiveTransform(a, mapped, H);
  std::vector<double> distances;
  for (size_t i = 0; i < b.size(); ++i) distances.push_back(cv::norm(mapped[i] - b[i]));
  return MedianInPlace(&distances);
}

// Medians over pairs of the medians within them, of the matches as `rectify` sees them.
std::optional<RegistrationError> Register(
    const std::vector<FramePair>& pairs,
    const std::function<std::vector<Match>(const FramePair&)>& rectify) {
  std::vector<double> turned, homography;
  for (const FramePair& pair : pairs) {
    const std::vector<Match> matches = rectify(pair);
    if (matches.size() < kMinMatches) continue;
    std::vector<double> distances;
    for (const Match& match : matches) distances.push_back((match.px_b - match.px_a).norm());
    turned.push_back(MedianInPlace(&distances));
    if (const auto error = HomographyError(matches)) homography.push_back(*error);
  }
  if (turned.empty() || homography.empty()) return std::nullopt;
  return RegistrationError{MedianInPlace(&turned), MedianInPlace(&homography)};
}

}  // namespace

RegistrationError RegisterAsRecorded(const std::vector<FramePair>& pairs) {
  return Register(pairs, [](const FramePair& pair) { return pair.matches; })
      .value_or(RegistrationError());
}

std::optional<RegistrationError> RegisterRectified(const Recording& recording,
                                                   const Calibration& calibration,
                                                   const std::vector<FramePair>& pairs) {
  const CameraPath path(recording, calibration);
  const VirtualCamera camera(calibration, calibration.width_px, calibration.height_px, 1.0);
  return Register(pairs, [&](const FramePair& pair) {
    std::vector<Match> rectified;
    if (!path.Covers(pair.frame_a) || !path.Covers(pair.frame_b)) return rectified;
    const Eigen::Quaterniond q_world_virtual(
        path.R_world_cam(pair.frame_a, 0.5 * calibration.height_px));
    const FrameWarp a(path, calibration, pair.frame_a, q_world_virtual, camera);
    const FrameWarp b(path, calibration, pair.frame_b, q_world_virtual, camera);
    for (const Match& match : pair.matches) {
      const auto px_a = a.ToVirtual(match.px_a), px_b = b.ToVirtual(match.px_b);
      if (px_a && px_b) rectified.push_back({*px_a, *px_b});
    }
    return rectified;
  });
}

}  // namespace camgyro
