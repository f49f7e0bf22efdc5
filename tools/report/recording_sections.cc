#include "tools/report/recording_sections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/format.h"
#include "core/so3.h"
#include "core/standard_distortion.h"
#include "core/time.h"
#include "estimator/window/estimation_input.h"
#include "frontend/camera_rotations.h"
#include "frontend/frame_source.h"
#include "tools/report/charts.h"

namespace camgyro {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 57.29577951308232;
constexpr size_t kMaxGyroPoints = 12000;  // of a chart; beyond, every n-th sample
constexpr size_t kMaxCameraPoints = 600;
constexpr size_t kMaxMatchesOfAPoint = 100;  // what more would tell is not seen in a chart
constexpr size_t kShownPairs = 4;
constexpr int kJpegQuality = 60;

int64_t StampOf(const Recording& recording, int frame) {
  return recording.frames[static_cast<size_t>(frame)].stamp_ns;
}

struct RatePoint {
  double time_s = 0.0;  // gyro clock, from the first frame's exposure
  Eigen::Vector3d gyro = Eigen::Vector3d::Constant(kNaN);    // camera frame [rad/s]
  Eigen::Vector3d camera = Eigen::Vector3d::Constant(kNaN);  // the same
};

// Rotations between neighbouring frames from the camera alone.
std::vector<CameraRotation> RotationsOfNeighbours(const Recording& recording,
                                                  const Calibration& calibration) {
  std::vector<CameraRotation> rotations;
  std::vector<TimedPair> neighbours;
  for (const TimedPair& pair : OutlineOf(recording).pairs) {
    if (pair.num_matches == 0) {
      rotations.push_back(pair.rotation);
    } else {
      neighbours.push_back(pair);
    }
  }
  if (neighbours.empty()) return rotations;
  std::vector<FramePair> pairs;
  for (const size_t i : SpreadIndices(neighbours.size(), kMaxCameraPoints)) {
    const TimedPair& pair = neighbours[i];
    pairs.push_back(
        Thinned({pair.frame_a, pair.frame_b, MatchesOf(recording, pair)}, kMaxMatchesOfAPoint));
  }
  Recording shown;
  shown.camera = recording.camera;
  if (!recording.lens_shift.empty()) {
    shown.frames = recording.frames;
    shown.lens_shift = recording.lens_shift;
  }
  CameraGuess& camera = shown.camera;
  const LensParameters lens = calibration.FullLens();
  camera.aspect_ratio = lens[kAspect];
  camera.principal_px = Eigen::Vector2d(lens[kCx], lens[kCy]);
  const Eigen::Vector2d size_px(calibration.width_px, calibration.height_px);
  const DistortionCoefficients distortion =
      StandardDistortion(calibration.distortion_model, lens, size_px);
  camera.distortion_model = distortion.model;
  camera.distortion.assign(distortion.k.data(), distortion.k.data() + 4);
  return CameraRotationsOf(shown, pairs, {{lens[kFocal], {}}}).front();
}

std::vector<RatePoint> RatePoints(const Recording& recording, const Calibration& calibration) {
  // The middle row stands for its frame.
  const double shift_s = calibration.delay_s + 0.5 * calibration.readout_s;
  const int64_t first_ns = recording.frames.front().stamp_ns;
  const double last_s = SecondsSince(first_ns, recording.frames.back().stamp_ns);
  std::vector<RatePoint> points;
  std::vector<const GyroSample*> samples;
  for (const GyroSample& sample : recording.gyro) {
    const double time_s = SecondsSince(first_ns, sample.stamp_ns) - shift_s;
    if (time_s >= 0.0 && time_s <= last_s) samples.push_back(&sample);
  }
  const size_t step = samples.size() / kMaxGyroPoints + 1;
  for (size_t i = 0; i < samples.size(); i += step) {
    RatePoint point;
    point.time_s = SecondsSince(first_ns, samples[i]->stamp_ns) - shift_s;
    point.gyro = calibration.q_gyro_cam.conjugate() *
                 (samples[i]->omega_gyro_rad_s - calibration.bias_gyro_rad_s);
    points.push_back(point);
  }
  for (const CameraRotation& rotation : RotationsOfNeighbours(recording, calibration)) {
    const auto stamp = [&](int frame) { return SecondsSince(first_ns, StampOf(recording, frame)); };
    const double a_s = stamp(rotation.frame_a), b_s = stamp(rotation.frame_b);
    RatePoint point;
    point.time_s = 0.5 * (a_s + b_s);
    point.camera = Log<double>(rotation.q_a_b) / (b_s - a_s);
    points.push_back(point);
  }
  std::sort(points.begin(), points.end(),
            [](const RatePoint& a, const RatePoint& b) { return a.time_s < b.time_s; });
  return points;
}

// The number of some (ascending, not empty) that is nearest to `wanted`.
size_t Nearest(const std::vector<size_t>& some, size_t wanted) {
  const auto at = std::lower_bound(some.begin(), some.end(), wanted);
  if (at == some.begin()) return *at;
  if (at == some.end() || wanted - *(at - 1) <= *at - wanted) return *(at - 1);
  return *at;
}

// Of some frames (ascending indices).
Result<SmallPictures> DecodePictures(const Recording& recording, const std::vector<int>& frames) {
  SmallPictures pictures;
  if (!recording.HasImages() || frames.empty()) return pictures;
  Result<std::unique_ptr<FrameSource>> source = OpenFrames(recording);
  if (!source) return tl::unexpected(source.error());
  for (const int frame : frames) {
    cv::Mat gray;
    if (Status there = (*source)->SkipTo(static_cast<size_t>(frame)); !there) {
      return tl::unexpected(there.error());
    }
    const Result<bool> read = (*source)->Next(&gray);
    if (!read) return tl::unexpected(read.error());
    if (!*read) break;
    pictures[StampOf(recording, frame)] = SmallPicture(gray);
  }
  return pictures;
}

std::vector<unsigned char> Jpeg(const SmallPictures& pictures, int64_t stamp_ns) {
  std::vector<unsigned char> jpeg;
  if (const auto found = pictures.find(stamp_ns); found != pictures.end()) {
    cv::imencode(".jpg", found->second, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  }
  return jpeg;
}

}  // namespace

ReportSection RatesSection(const Recording& recording, const Calibration& calibration) {
  const std::vector<RatePoint> points = RatePoints(recording, calibration);
  constexpr std::array<const char*, 3> kAxes = {"About x: tilting", "About y: panning",
                                                "About z: rolling"};
  std::string html = Paragraph(
      "On one clock and in one frame, the camera's. Drag over a stretch to zoom into all "
      "three, double click to go back. The camera's rates come from neighbouring frames "
      "alone; strong parallax scatters them.",
      "note");
  for (int axis = 0; axis < 3; ++axis) {
    LineChart chart;
    chart.id = std::string("rates-") + "xyz"[axis];
    chart.title = kAxes[static_cast<size_t>(axis)];
    chart.x_label = "time since the first frame [s]";
    chart.y_label = "deg/s";
    chart.group = "rates";
    ChartSeries gyro{"gyro", {}, {}, false, false}, camera{"camera", {}, {}, true, false};
    for (const RatePoint& point : points) {
      chart.x.push_back(point.time_s);
      gyro.y.push_back(kDegrees * point.gyro[axis]);
      camera.y.push_back(kDegrees * point.camera[axis]);
    }
    chart.series = {gyro, camera};
    html += LineChartHtml(chart);
  }
  return {"rates", "Gyro and camera, synchronised", html};
}

Result<ReportSection> MatchesSection(const Recording& recording, const SmallPictures& pictures,
                                     const std::vector<MatchResidual>& residuals) {
  ReportSection section{"matches", "Matched features", ""};
  std::vector<std::pair<int, int>> pairs;  // begin of each pair's rows, and its second frame
  for (size_t i = 0; i < residuals.size(); ++i) {
    if (pairs.empty() || pairs.back().second != residuals[i].frame_b) {
      pairs.emplace_back(static_cast<int>(i), residuals[i].frame_b);
    }
  }
  if (pairs.empty()) {
    section.html = Paragraph("This recording has no matched features.");
    return section;
  }
  std::vector<size_t> with_picture;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (pictures.count(StampOf(recording, pairs[i].second)) > 0) with_picture.push_back(i);
  }
  std::vector<size_t> shown;
  for (size_t k = 0; k < kShownPairs; ++k) {
    size_t index = (2 * k + 1) * pairs.size() / (2 * kShownPairs);
    if (!with_picture.empty()) index = Nearest(with_picture, index);
    if (shown.empty() || shown.back() != index) shown.push_back(index);
  }
  std::vector<int> frames;
  for (const size_t index : shown) frames.push_back(pairs[index].second);
  const Result<SmallPictures> drawn =
      with_picture.empty() ? DecodePictures(recording, frames) : pictures;
  if (!drawn) return tl::unexpected(drawn.error());
  section.html =
      Paragraph(
          "Lines: from where a feature was in the frame before. Circles: inliers; crosses: "
          "outliers, further off their epipolar line than noise explains.",
          "note") +
      "<div class=\"side-by-side pictures\">";
  for (const size_t index : shown) {
    const size_t begin = static_cast<size_t>(pairs[index].first);
    std::vector<DrawnMatch> matches;
    size_t outliers = 0;
    for (size_t i = begin; i < residuals.size() && residuals[i].frame_b == pairs[index].second;
         ++i) {
      matches.push_back({residuals[i].match.px_a, residuals[i].match.px_b, residuals[i].inlier});
      outliers += residuals[i].inlier ? 0 : 1;
    }
    const int64_t stamp_ns = StampOf(recording, pairs[index].second);
    const double time_s = SecondsSince(recording.frames.front().stamp_ns, stamp_ns);
    section.html +=
        "<div>" +
        MatchesHtml(Format("matches-%d", pairs[index].second),
                    Format("Frame %d, at %.2f s: %zu inliers, %zu outliers", pairs[index].second,
                           time_s, matches.size() - outliers, outliers),
                    recording.camera.width_px, recording.camera.height_px, Jpeg(*drawn, stamp_ns),
                    matches) +
        "</div>";
  }
  section.html += "</div>\n";
  return section;
}

}  // namespace camgyro
