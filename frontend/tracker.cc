#include "frontend/tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace camgyro {
namespace {

const cv::TermCriteria kStop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.005);
constexpr double kMinEigenvalue = 1e-4;  // of the patch, per pixel: below it KLT has no texture

// Interpolation takes one pixel more than the patch.
int Border(const TrackerOptions& options) { return options.window_px / 2 + 1; }

bool Inside(const cv::Point2f& point, const cv::Size& size, int border) {
  const auto margin = static_cast<float>(border);
  return point.x >= margin && point.y >= margin &&
         point.x <= static_cast<float>(size.width - 1) - margin &&
         point.y <= static_cast<float>(size.height - 1) - margin;
}

}  // namespace

int PyramidLevels(int window_px, double motion_px) {
  int levels = 0;
  for (double reach = 0.5 * window_px; reach < motion_px; reach *= 2.0) ++levels;
  return levels;
}

KltTracker::KltTracker(const TrackerOptions& options) : options_(options) {}

std::vector<TrackedPoint> KltTracker::Add(const cv::Mat& gray, const PointPredictor& predictor) {
  if (gray.empty() || gray.type() != CV_8UC1 || gray.size() != size_) {
    pyramid_.clear();
    ids_.clear();
    points_.clear();
    size_ = gray.size();
  }
  if (gray.empty() || gray.type() != CV_8UC1) return {};

  const cv::Size window(options_.window_px, options_.window_px);
  std::vector<cv::Mat> pyramid;
  cv::buildOpticalFlowPyramid(gray, pyramid, window,
                              PyramidLevels(options_.window_px, options_.max_motion * gray.cols));
  if (!points_.empty()) FollowPoints(pyramid, predictor);
  pyramid_ = std::move(pyramid);
  AddCorners(gray);

  std::vector<TrackedPoint> tracked(points_.size());
  for (size_t i = 0; i < points_.size(); ++i) {
    tracked[i] = {ids_[i], Eigen::Vector2d(points_[i].x, points_[i].y)};
  }
  return tracked;
}

void KltTracker::FollowPoints(const std::vector<cv::Mat>& pyramid,
                              const PointPredictor& predictor) {
  // Both directions start from the same expected motion: the way back does not know where the
  // way there began.
  std::vector<cv::Point2f> found = points_;
  if (predictor) {
    for (cv::Point2f& point : found) {
      const Eigen::Vector2d px = predictor(Eigen::Vector2d(point.x, point.y));
      if (px.allFinite())
        point = cv::Point2f(static_cast<float>(px.x()), static_cast<float>(px.y()));
    }
  }
  std::vector<cv::Point2f> expected_motion(points_.size());
  for (size_t i = 0; i < points_.size(); ++i) expected_motion[i] = found[i] - points_[i];

  const cv::Size window(options_.window_px, options_.window_px);
  const int levels = static_cast<int>(pyramid.size()) / 2 - 1;  // image and derivative each
  std::vector<uchar> found_ok, back_ok;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(pyramid_, pyramid, points_, found, found_ok, error, window, levels,
                           kStop, cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  std::vector<cv::Point2f> back(found.size());
  for (size_t i = 0; i < found.size(); ++i) back[i] = found[i] - expected_motion[i];
  cv::calcOpticalFlowPyrLK(pyramid, pyramid_, found, back, back_ok, error, window, levels, kStop,
                           cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);

  // Ids ascend, so of two points that have run into one the older stays.
  const double too_close_px = 0.5 * options_.min_distance_px;
  size_t kept = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    bool good = found_ok[i] && back_ok[i] && Inside(found[i], size_, Border(options_)) &&
                cv::norm(back[i] - points_[i]) <= options_.max_forward_backward_px;
    for (size_t j = 0; j < kept && good; ++j) {
      good = cv::norm(found[i] - points_[j]) >= too_close_px;
    }
    if (!good) continue;
    ids_[kept] = ids_[i];
    points_[kept] = found[i];
    ++kept;
  }
  ids_.resize(kept);
  points_.resize(kept);
}

void KltTracker::AddCorners(const cv::Mat& gray) {
  if (static_cast<int>(points_.size()) >= options_.max_points) return;
  const int grid = options_.grid;
  const int share = (options_.max_points + grid * grid - 1) / (grid * grid);
  const auto cell_of = [&](const cv::Point2f& point) {
    return cv::Point(static_cast<int>(point.x) * grid / size_.width,
                     static_cast<int>(point.y) * grid / size_.height);
  };
  cv::Mat count = cv::Mat::zeros(grid, grid, CV_32S);
  for (const cv::Point2f& point : points_) ++count.at<int>(cell_of(point));

  // The mask keeps new corners away from the border, from points that are followed already, and
  // out of cells that have their share.
  cv::Mat mask = cv::Mat::zeros(size_, CV_8U);
  const int border = Border(options_);
  cv::rectangle(mask, cv::Point(border, border),
                cv::Point(size_.width - 1 - border, size_.height - 1 - border), 255, cv::FILLED);
  for (int row = 0; row < grid; ++row) {
    for (int column = 0; column < grid; ++column) {
      if (count.at<int>(row, column) < share) continue;
      cv::rectangle(
          mask, cv::Point(column * size_.width / grid, row * size_.height / grid),
          cv::Point((column + 1) * size_.width / grid - 1, (row + 1) * size_.height / grid - 1), 0,
          cv::FILLED);
    }
  }
  for (const cv::Point2f& point : points_) {
    cv::circle(mask, point, static_cast<int>(options_.min_distance_px), 0, cv::FILLED);
  }

  std::vector<cv::Point2f> corners;  // strongest first
  cv::goodFeaturesToTrack(gray, corners, /*maxCorners=*/0, options_.min_quality,
                          options_.min_distance_px, mask);
  for (const cv::Point2f& corner : corners) {
    if (static_cast<int>(points_.size()) >= options_.max_points) break;
    int& in_cell = count.at<int>(cell_of(corner));
    if (in_cell >= share) continue;
    ++in_cell;
    ids_.push_back(next_id_++);
    points_.push_back(corner);
  }
}

}  // namespace camgyro
