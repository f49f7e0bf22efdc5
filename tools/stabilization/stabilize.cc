#include "tools/stabilization/stabilize.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <utility>
#include <vector>

#include "core/time.h"
#include "frontend/frame_source.h"
#include "frontend/readers/video_container.h"
#include "frontend/tracker.h"
#include "tools/stabilization/camera_path.h"
#include "tools/stabilization/frame_warp.h"
#include "tools/stabilization/video_writer.h"

namespace camgyro {
namespace {

constexpr int kMaxRegisteredPairs = 60;

// Planes of an I420 picture, without copying.
struct Planes {
  explicit Planes(const cv::Mat& i420) {
    const int width = i420.cols, height = i420.rows * 2 / 3;
    y = i420.rowRange(0, height);
    uint8_t* const chroma = i420.data + i420.step * static_cast<size_t>(height);
    const size_t size = static_cast<size_t>(width / 2) * static_cast<size_t>(height / 2);
    u = cv::Mat(height / 2, width / 2, CV_8UC1, chroma);
    v = cv::Mat(height / 2, width / 2, CV_8UC1, chroma + size);
  }
  cv::Mat y, u, v;
};

// Does the source picture fill the virtual one up to its edges?
bool FillsThePicture(const FrameWarp& warp, const VirtualCamera& camera, const cv::Size& source) {
  constexpr int kSteps = 8;
  const double w = camera.width_px - 1, h = camera.height_px - 1;
  const auto inside = [&](double x, double y) {
    const auto px = warp.ToSource({x, y});
    return px && px->x() >= 0.0 && px->y() >= 0.0 && px->x() <= source.width - 1 &&
           px->y() <= source.height - 1;
  };
  for (int i = 0; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    if (!inside(share * w, 0.0) || !inside(share * w, h) || !inside(0.0, share * h) ||
        !inside(w, share * h)) {
      return false;
    }
  }
  return true;
}

class Stabilizer {
 public:
  Stabilizer(const Recording& recording, const Calibration& calibration,
             const StabilizeOptions& options)
      : calibration_(calibration),
        options_(options),
        path_(recording, calibration),
        size_(calibration.width_px & ~1, calibration.height_px & ~1),
        camera_(calibration, size_.width, size_.height, options.zoom) {}

  const CameraPath& path() const { return path_; }
  const cv::Size& size() const { return size_; }

  void Plan(StabilizeReport* report) {
    orientations_ = SmoothOrientations(path_, MiddleRow(), options_.smooth_s);
    if (options_.border == BorderPolicy::kAvoid && options_.smooth_s > 0.0) AvoidBorders();
    int with_border = 0;
    for (int frame = path_.first_frame(); frame <= path_.last_frame(); ++frame) {
      with_border += Fills(frame, Orientation(frame)) ? 0 : 1;
    }
    report->border_share =
        static_cast<double>(with_border) / static_cast<double>(orientations_.size());
  }

  // The stabilised picture of a frame that the path covers.
  cv::Mat Render(int frame, const cv::Mat& i420) {
    FrameWarp(path_, calibration_, frame, Orientation(frame), camera_).Maps(&map_x_, &map_y_);
    // A chroma sample lies between two by two luma samples.
    cv::resize(map_x_, half_x_, size_ / 2, 0.0, 0.0, cv::INTER_AREA);
    cv::resize(map_y_, half_y_, size_ / 2, 0.0, 0.0, cv::INTER_AREA);
    half_x_ = 0.5f * (half_x_ - 0.5f);
    half_y_ = 0.5f * (half_y_ - 0.5f);
    cv::Mat out(i420.size(), CV_8UC1);
    const Planes from(i420);
    Planes to(out);
    const int border = options_.border == BorderPolicy::kStretch  ? cv::BORDER_REPLICATE
                       : options_.border == BorderPolicy::kMirror ? cv::BORDER_REFLECT_101
                                                                  : cv::BORDER_CONSTANT;
    cv::remap(from.y, to.y, map_x_, map_y_, cv::INTER_LINEAR, border, cv::Scalar(16));
    cv::remap(from.u, to.u, half_x_, half_y_, cv::INTER_LINEAR, border, cv::Scalar(128));
    cv::remap(from.v, to.v, half_x_, half_y_, cv::INTER_LINEAR, border, cv::Scalar(128));
    return options_.side_by_side ? Beside(from, to) : out;
  }

 private:
  double MiddleRow() const { return 0.5 * calibration_.height_px; }
  Eigen::Quaterniond& Orientation(int frame) {
    return orientations_[static_cast<size_t>(frame - path_.first_frame())];
  }
  bool Fills(int frame, const Eigen::Quaterniond& q_world_virtual) const {
    return FillsThePicture(FrameWarp(path_, calibration_, frame, q_world_virtual, camera_), camera_,
                           size_);
  }

  // Moves each orientation towards the camera's own, as far as it takes to see no border. How far
  // changes over time as slowly as the view does: each share of the way is an average of minima
  // over stretches that all hold the frame itself, so it is never more than that frame allows.
  void AvoidBorders() {
    std::vector<double> times, allowed;
    std::vector<Eigen::Quaterniond> own;
    for (int frame = path_.first_frame(); frame <= path_.last_frame(); ++frame) {
      times.push_back(path_.RowTime(frame, MiddleRow()));
      own.emplace_back(path_.R_world_cam(times.back()));
      const Eigen::Quaterniond& smooth = Orientation(frame);
      double low = 0.0, high = 1.0;
      if (Fills(frame, smooth)) low = high;
      while (high - low > 0.02) {
        const double middle = 0.5 * (low + high);
        (Fills(frame, own.back().slerp(middle, smooth)) ? low : high) = middle;
      }
      allowed.push_back(low);
    }
    const double half_s = options_.smooth_s;
    const auto stretch = [&](size_t i) {
      const auto first = std::lower_bound(times.begin(), times.end(), times[i] - half_s);
      const auto last = std::upper_bound(times.begin(), times.end(), times[i] + half_s);
      return std::pair(first - times.begin(), last - times.begin());
    };
    std::vector<double> least;
    for (size_t i = 0; i < times.size(); ++i) {
      const auto [first, last] = stretch(i);
      least.push_back(*std::min_element(allowed.begin() + first, allowed.begin() + last));
    }
    for (size_t i = 0; i < times.size(); ++i) {
      const auto [first, last] = stretch(i);
      const double share = std::accumulate(least.begin() + first, least.begin() + last, 0.0) /
                           static_cast<double>(last - first);
      orientations_[i] = own[i].slerp(share, orientations_[i]);
    }
  }

  cv::Mat Beside(const Planes& left, const Planes& right) const {
    cv::Mat both(size_.height * 3 / 2, 2 * size_.width, CV_8UC1);
    Planes to(both);
    cv::hconcat(left.y, right.y, to.y);
    cv::hconcat(left.u, right.u, to.u);
    cv::hconcat(left.v, right.v, to.v);
    return both;
  }

  const Calibration& calibration_;
  const StabilizeOptions& options_;
  const CameraPath path_;
  const cv::Size size_;
  const VirtualCamera camera_;
  std::vector<Eigen::Quaterniond> orientations_;
  cv::Mat map_x_, map_y_, half_x_, half_y_;
};

// Second frames of the pairs to register, spread over first + 1 .. last.
std::set<int> RegisteredFrames(int first, int last) {
  std::set<int> frames;
  const int pairs = last - first, count = std::min(pairs, kMaxRegisteredPairs);
  for (int i = 0; i < count; ++i) {
    frames.insert(first + 1 + static_cast<int>(static_cast<int64_t>(i) * pairs / count));
  }
  return frames;
}

FramePair MatchFrames(int frame, const cv::Mat& before, const cv::Mat& now) {
  KltTracker tracker;
  const std::vector<TrackedPoint> a = tracker.Add(before), b = tracker.Add(now);
  return {frame - 1, frame, MatchesBetween(a, b)};
}

}  // namespace

Result<StabilizeReport> Stabilize(const Recording& recording, const Calibration& calibration,
                                  const StabilizeOptions& options, const std::string& file,
                                  const std::string& container,
                                  const std::function<void(double done)>& progress) {
  const auto begin = std::chrono::steady_clock::now();
  Stabilizer stabilizer(recording, calibration, options);
  const CameraPath& path = stabilizer.path();
  if (!recording.HasImages()) {
    return BadInput(recording.path + ": has neither images nor a video to stabilise");
  }
  if (Status sound = CheckCalibrationFits(recording, calibration, path); !sound) {
    return tl::unexpected(sound.error());
  }
  StabilizeReport report;
  stabilizer.Plan(&report);
  const int first = path.first_frame(), last = path.last_frame();
  const auto stamp = [&](int frame) {
    return recording.frames[static_cast<size_t>(frame)].stamp_ns;
  };
  report.frames_dropped = static_cast<int>(recording.frames.size()) - (last - first + 1);
  report.video_seconds = SecondsSince(stamp(first), stamp(last));
  report.width_px = options.side_by_side ? 2 * stabilizer.size().width : stabilizer.size().width;
  report.height_px = stabilizer.size().height;

  Result<std::unique_ptr<FrameSource>> source = OpenFrames(recording, PictureFormat::kI420);
  if (!source) return tl::unexpected(source.error());
  VideoWriterOptions writing;
  writing.width_px = report.width_px;
  writing.height_px = report.height_px;
  writing.rate_hz = 1.0 / MedianInterval(recording.frames);
  writing.crf = options.crf;
  writing.source_file = recording.video_file;
  if (!recording.video_file.empty()) {
    const Result<VideoContainer> video = ReadVideoContainer(recording.video_file);
    if (!video) return tl::unexpected(video.error());
    writing.source_start_s =
        1e-9 *
        static_cast<double>(video->stamps_ns[recording.PictureOf(static_cast<size_t>(first))]);
  }
  Result<std::unique_ptr<VideoWriter>> writer = VideoWriter::Open(file, container, writing);
  if (!writer) return tl::unexpected(writer.error());
  report.sound = (*writer)->sound();

  const std::set<int> registered = RegisteredFrames(first, last);
  std::vector<FramePair> pairs;
  cv::Mat picture, before;
  for (int frame = 0; frame <= last; ++frame) {
    const Result<bool> more = (*source)->Next(&picture);
    if (!more) return tl::unexpected(more.error());
    if (!*more) break;
    if (frame < first) continue;
    if (registered.count(frame) > 0) {
      pairs.push_back(MatchFrames(frame, before, Planes(picture).y));
    }
    if (registered.count(frame + 1) > 0) before = Planes(picture).y.clone();
    if (Status written =
            (*writer)->Write(stabilizer.Render(frame, picture), stamp(frame) - stamp(first));
        !written) {
      return tl::unexpected(written.error());
    }
    ++report.frames;
    if (progress) progress(static_cast<double>(frame - first + 1) / (last - first + 1));
  }
  if (Status closed = (*writer)->Close(); !closed) return tl::unexpected(closed.error());

  report.pairs = static_cast<int>(pairs.size());
  report.as_recorded = RegisterAsRecorded(pairs);
  report.calibrated =
      RegisterRectified(recording, calibration, pairs).value_or(RegistrationError());
  Calibration unsynchronised = calibration;
  unsynchronised.delay_s = unsynchronised.readout_s = 0.0;
  report.unsynchronised = RegisterRectified(recording, unsynchronised, pairs);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

}  // namespace camgyro
