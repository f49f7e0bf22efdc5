#include "frontend/tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>
#include <tuple>

#include "core/robust_statistics.h"
#include "frontend/patch_alignment.h"

namespace camgyro {
namespace {

// KLT works on pictures of half the size, and ends at steps below this, in their pixels: where it
// ends is where AlignPatch begins, which needs it within a pixel.
const cv::TermCriteria kStop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 0.03);
constexpr float kHalf = 0.5F;
// Levels of the first search, from where a point is expected: the half and the quarter.
constexpr int kLevelsNearby = 1;
constexpr double kMinEigenvalue = 1e-4;  // of the patch, per pixel: below it KLT has no texture
// Variance that no texture takes away (interpolation, changes of shape), over that of the typical
// corner.
constexpr double kLeastVariance = 0.05;
constexpr size_t kPointsForReference = 20;
// Two numbers are asked of a line through grey values; cv::fitLine through all 190 of a frame took
// 2.6 % of the processor time of `camgyro calibrate tools/sample` (perf record).
constexpr size_t kPointsOfExposure = 50;
// Frames for which a cell is left alone when no corner has been found in it: where there is nothing
// to be found (a wall, the sky) a cell would be searched in every frame.
constexpr int kRestOfBarrenCell = 2;

// The patch, its derivatives and their interpolation.
int Border(const TrackerOptions& options) {
  return std::max(options.window_px, options.aligned_px) / 2 + 2;
}

bool Inside(const cv::Point2f& point, const cv::Size& size, int border) {
  const auto margin = static_cast<float>(border);
  return point.x >= margin && point.y >= margin &&
         point.x <= static_cast<float>(size.width - 1) - margin &&
         point.y <= static_cast<float>(size.height - 1) - margin;
}

// The new frame with the brightness of the previous one, judged by the points found in both (the
// mean and contrast of whole frames also change with what they show): a line through their grey
// values, smoothed by the pyramid. Nothing if that changes less than noise would.
std::optional<cv::Mat> LikePrevious(const cv::Mat& gray, const std::vector<cv::Mat>& previous,
                                    const std::vector<cv::Mat>& current,
                                    const std::vector<cv::Point2f>& from,
                                    const std::vector<cv::Point2f>& to,
                                    const std::vector<bool>& found) {
  const int level = std::min(1, static_cast<int>(current.size()) / 2 - 1);
  const auto at = [&](const std::vector<cv::Mat>& pyramid, const cv::Point2f& point) {
    const cv::Mat& image = pyramid[static_cast<size_t>(2 * level)];
    const cv::Point2f scaled = point * (kHalf / static_cast<float>(1 << level));
    return static_cast<float>(image.at<uchar>(std::min(cvRound(scaled.y), image.rows - 1),
                                              std::min(cvRound(scaled.x), image.cols - 1)));
  };
  std::vector<cv::Point2f> greys;
  for (size_t i = 0; i < from.size(); ++i) {
    if (found[i]) greys.emplace_back(at(current, to[i]), at(previous, from[i]));
  }
  if (greys.size() < 20) return std::nullopt;
  if (const size_t step = greys.size() / kPointsOfExposure; step > 1) {
    for (size_t i = 0; i * step < greys.size(); ++i) greys[i] = greys[i * step];
    greys.resize((greys.size() + step - 1) / step);
  }
  cv::Vec4f line;  // direction, point
  cv::fitLine(greys, line, cv::DIST_HUBER, 0, 0.01, 0.01);
  const double gain = line[1] / line[0];
  const double offset = line[3] - gain * line[2];
  if (!(gain > 0.25 && gain < 4.0)) return std::nullopt;  // the greys are all the same, or wrong
  if (std::abs(gain - 1.0) < 0.02 && std::abs(line[3] - line[2]) < 2.0) return std::nullopt;
  cv::Mat alike;
  gray.convertTo(alike, CV_8U, gain, offset);
  return alike;
}

// Shi and Tomasi's corners in some cells of a picture, where the mask lets them, the strongest
// first: the largest ones of their 3 x 3 pixels, and at least min_quality times the largest of all.
// cv::goodFeaturesToTrack finds the same ones, but always works on the whole picture, also where a
// few cells are short of corners.
std::vector<cv::Point2f> Corners(const cv::Mat& gray, const cv::Mat& mask,
                                 const std::vector<cv::Rect>& cells, double min_quality) {
  constexpr int kBlock = 3;
  struct Corner {
    float strength;
    cv::Point place;
  };
  struct Cell {
    std::vector<Corner> corners;
    float strongest = 0.0F;
  };
  std::vector<Cell> found(cells.size());
  const auto search = [&](size_t k) {
    const cv::Rect& cell = cells[k];
    // The strength of a pixel depends on two around it, and it is compared with one.
    const cv::Rect wide = cv::Rect(cell.x - 3, cell.y - 3, cell.width + 6, cell.height + 6) &
                          cv::Rect({0, 0}, gray.size());
    cv::Mat strength, largest;
    cv::cornerMinEigenVal(gray(wide), strength, kBlock);
    cv::dilate(strength, largest, cv::Mat());
    for (int y = cell.y; y < cell.y + cell.height; ++y) {
      const auto* allowed = mask.ptr(y);
      const auto* here = strength.ptr<float>(y - wide.y);
      const auto* around = largest.ptr<float>(y - wide.y);
      for (int x = cell.x; x < cell.x + cell.width; ++x) {
        if (allowed[x] == 0) continue;
        const float value = here[x - wide.x];
        found[k].strongest = std::max(found[k].strongest, value);
        if (value > 0.0F && value == around[x - wide.x])
          found[k].corners.push_back({value, {x, y}});
      }
    }
  };
  cv::parallel_for_(cv::Range(0, static_cast<int>(cells.size())), [&](const cv::Range& range) {
    for (int k = range.start; k < range.end; ++k) search(static_cast<size_t>(k));
  });
  std::vector<Corner> corners;
  float strongest = 0.0F;
  for (const Cell& of_cell : found) {
    corners.insert(corners.end(), of_cell.corners.begin(), of_cell.corners.end());
    strongest = std::max(strongest, of_cell.strongest);
  }
  const auto weakest = static_cast<float>(min_quality * strongest);
  corners.erase(std::remove_if(corners.begin(), corners.end(),
                               [&](const Corner& corner) { return corner.strength <= weakest; }),
                corners.end());
  std::sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return std::tie(b.strength, b.place.y, b.place.x) < std::tie(a.strength, a.place.y, a.place.x);
  });
  std::vector<cv::Point2f> places;
  for (const Corner& corner : corners) places.emplace_back(corner.place);
  return places;
}

int LevelsOf(const std::vector<cv::Mat>& pyramid) {
  return static_cast<int>(pyramid.size()) / 2 - 1;  // image and derivative each
}

}  // namespace

int PyramidLevels(int window_px, double motion_px) {
  int levels = 0;
  for (double reach = 0.5 * window_px; reach < motion_px; reach *= 2.0) ++levels;
  return levels;
}

KltTracker::KltTracker(const TrackerOptions& options) : options_(options) {}

KltTracker::Picture KltTracker::Prepare(cv::Mat gray) const {
  if (gray.type() != CV_8UC1) return {};
  Picture picture;
  if (!gray.empty()) picture.pyramid = Pyramid(gray);
  picture.gray = std::move(gray);
  return picture;
}

std::vector<TrackedPoint> KltTracker::Add(const cv::Mat& gray, const PointPredictor& predictor) {
  return Add(Prepare(gray.clone()), predictor);  // the caller may use its memory again
}

std::vector<TrackedPoint> KltTracker::Add(Picture picture, const PointPredictor& predictor) {
  if (picture.gray.empty() || picture.gray.size() != size_) {
    previous_ = {};
    ids_.clear();
    points_.clear();
    motions_.clear();
    noise_factors_.clear();
    rests_ = cv::Mat::zeros(options_.grid, options_.grid, CV_32S);
    size_ = picture.gray.size();
  }
  if (picture.gray.empty()) return {};

  if (!points_.empty()) FollowPoints(picture, predictor);
  previous_ = std::move(picture);
  AddCorners();

  std::vector<TrackedPoint> tracked(points_.size());
  for (size_t i = 0; i < points_.size(); ++i) {
    tracked[i] = {ids_[i], Eigen::Vector2d(points_[i].x, points_[i].y), noise_factors_[i]};
  }
  return tracked;
}

std::vector<cv::Mat> KltTracker::Pyramid(const cv::Mat& gray) const {
  cv::Mat half;
  cv::pyrDown(gray, half);
  std::vector<cv::Mat> pyramid;
  cv::buildOpticalFlowPyramid(half, pyramid, cv::Size(options_.window_px, options_.window_px),
                              PyramidLevels(options_.window_px, options_.max_motion * half.cols));
  return pyramid;
}

void KltTracker::SearchPoints(const std::vector<cv::Mat>& pyramid, int levels,
                              const std::vector<size_t>& which,
                              const std::vector<cv::Point2f>& start, Search* search) const {
  if (which.empty()) return;
  const cv::Size window(options_.window_px, options_.window_px);
  std::vector<cv::Point2f> from, to;
  for (const size_t i : which) {
    from.push_back(points_[i] * kHalf);
    to.push_back(start[i] * kHalf);
  }
  std::vector<uchar> found_ok, back_ok;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(previous_.pyramid, pyramid, from, to, found_ok, error, window, levels,
                           kStop, cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  // The way back starts from the same expected motion: it does not know where the way there began.
  std::vector<cv::Point2f> back;
  for (size_t k = 0; k < which.size(); ++k) {
    back.push_back(to[k] - (start[which[k]] - points_[which[k]]) * kHalf);
  }
  cv::calcOpticalFlowPyrLK(pyramid, previous_.pyramid, to, back, back_ok, error, window, levels,
                           kStop, cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  for (size_t k = 0; k < which.size(); ++k) {
    const cv::Point2f point = to[k] * (1.0F / kHalf);
    search->points[which[k]] = point;
    search->found[which[k]] =
        found_ok[k] && back_ok[k] && Inside(point, size_, Border(options_)) &&
        cv::norm(back[k] - from[k]) <= kHalf * options_.max_forward_backward_px;
  }
}

void KltTracker::SearchLost(const std::vector<cv::Mat>& pyramid,
                            const std::vector<cv::Point2f>& start,
                            const std::vector<cv::Point2f>& expected, Search* search) const {
  const auto lost = [&] {
    std::vector<size_t> which;
    for (size_t i = 0; i < points_.size(); ++i) {
      if (!search->found[i]) which.push_back(i);
    }
    return which;
  };
  SearchPoints(pyramid, std::min(kLevelsNearby, LevelsOf(pyramid)), lost(), expected, search);
  SearchPoints(pyramid, LevelsOf(pyramid), lost(), start, search);
}

std::vector<cv::Point2f> KltTracker::Expected() const {
  std::vector<cv::Point2f> expected = points_;
  for (size_t i = 0; i < points_.size(); ++i) {
    // A point that has not been followed yet moves like the nearest one that has.
    size_t like = i;
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t j = 0; i >= motions_.size() && j < motions_.size(); ++j) {
      const double distance = cv::norm(points_[i] - points_[j]);
      if (distance < nearest) {
        nearest = distance;
        like = j;
      }
    }
    if (like < motions_.size()) expected[i] += motions_[like];
  }
  return expected;
}

void KltTracker::FollowPoints(const Picture& picture, const PointPredictor& predictor) {
  std::vector<cv::Point2f> start = points_, expected = Expected();
  if (predictor) {
    for (size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector2d px = predictor(Eigen::Vector2d(points_[i].x, points_[i].y));
      if (!px.allFinite()) continue;
      start[i] = cv::Point2f(static_cast<float>(px.x()), static_cast<float>(px.y()));
      expected[i] = start[i];
    }
  }
  Search search{start, std::vector<bool>(start.size())};
  SearchLost(picture.pyramid, start, expected, &search);
  if (const auto alike = LikePrevious(picture.gray, previous_.pyramid, picture.pyramid, points_,
                                      search.points, search.found)) {
    SearchLost(Pyramid(*alike), start, expected, &search);
  }
  // KLT has found where each patch went; how it turned and grew on the way decides the last
  // hundredths of a pixel.
  std::vector<std::optional<AlignedPatch>> aligned(points_.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(points_.size())), [&](const cv::Range& range) {
    for (auto i = static_cast<size_t>(range.start); i < static_cast<size_t>(range.end); ++i) {
      if (!search.found[i]) continue;
      const cv::Point2f &from = points_[i], &to = search.points[i];
      aligned[i] = AlignPatch(previous_.gray, {from.x, from.y}, picture.gray, {to.x, to.y},
                              options_.aligned_px);
    }
  });

  // Ids ascend, so of two points that have run into one the older stays.
  const double too_close_px = 0.5 * options_.min_distance_px;
  size_t kept = 0;
  motions_.clear();
  std::vector<Eigen::Matrix2d> covariances;
  for (size_t i = 0; i < points_.size(); ++i) {
    if (!aligned[i]) continue;
    const cv::Point2f point(static_cast<float>(aligned[i]->px.x()),
                            static_cast<float>(aligned[i]->px.y()));
    bool good = true;
    for (size_t j = 0; j < kept && good; ++j) good = cv::norm(point - points_[j]) >= too_close_px;
    if (!good) continue;
    ids_[kept] = ids_[i];
    motions_.push_back(point - points_[i]);
    points_[kept] = point;
    covariances.push_back(aligned[i]->covariance);
    ++kept;
  }
  ids_.resize(kept);
  points_.resize(kept);
  noise_factors_ = NoiseFactors(covariances);
}

std::vector<Eigen::Vector3d> KltTracker::NoiseFactors(
    const std::vector<Eigen::Matrix2d>& covariances) {
  std::vector<Eigen::Vector3d> factors(covariances.size(), Eigen::Vector3d(1.0, 0.0, 1.0));
  if (!(reference_ > 0.0)) {
    if (covariances.size() < kPointsForReference) return factors;
    std::vector<double> variances;
    for (const Eigen::Matrix2d& covariance : covariances) {
      variances.push_back(0.5 * covariance.trace());
    }
    reference_ = MedianInPlace(&variances);
  }
  for (size_t i = 0; i < covariances.size(); ++i) {
    const Eigen::Matrix2d covariance =
        covariances[i] / reference_ + kLeastVariance * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d L = covariance.llt().matrixL();
    factors[i] << L(0, 0), L(1, 0), L(1, 1);
  }
  return factors;
}

void KltTracker::AddCorners() {
  if (static_cast<int>(points_.size()) >= options_.max_points) return;
  const int grid = options_.grid;
  const int share = (options_.max_points + grid * grid - 1) / (grid * grid);
  const auto cell_of = [&](const cv::Point2f& point) {
    return cv::Point(static_cast<int>(point.x) * grid / size_.width,
                     static_cast<int>(point.y) * grid / size_.height);
  };
  cv::Mat count = cv::Mat::zeros(grid, grid, CV_32S);
  for (const cv::Point2f& point : points_) ++count.at<int>(cell_of(point));

  // The mask, of the half picture, keeps new corners away from the border and from points that are
  // followed already.
  const cv::Mat& half = previous_.pyramid.front();
  cv::Mat mask = cv::Mat::zeros(half.size(), CV_8U);
  const int border = (Border(options_) + 1) / 2;
  cv::rectangle(mask, cv::Point(border, border),
                cv::Point((size_.width - 1) / 2 - border, (size_.height - 1) / 2 - border), 255,
                cv::FILLED);
  for (const cv::Point2f& point : points_) {
    cv::circle(mask, point * kHalf, static_cast<int>(kHalf * options_.min_distance_px), 0,
               cv::FILLED);
  }

  std::vector<cv::Rect> cells;  // that have less than their share
  for (int row = 0; row < grid; ++row) {
    for (int column = 0; column < grid; ++column) {
      if (count.at<int>(row, column) >= share) continue;
      int& rest = rests_.at<int>(row, column);
      if (rest > 0) {
        --rest;
        continue;
      }
      rest = kRestOfBarrenCell;  // unless a corner is found
      const cv::Point begin(column * half.cols / grid, row * half.rows / grid);
      const cv::Point end((column + 1) * half.cols / grid, (row + 1) * half.rows / grid);
      cells.emplace_back(begin, end);
    }
  }
  const auto far_from_new = [&, first = points_.size()](const cv::Point2f& corner) {
    return std::none_of(points_.begin() + static_cast<ptrdiff_t>(first), points_.end(),
                        [&](const cv::Point2f& point) {
                          return cv::norm(point - corner) < options_.min_distance_px;
                        });
  };
  for (const cv::Point2f& place : Corners(half, mask, cells, options_.min_quality)) {
    const cv::Point2f corner = place * (1.0F / kHalf);
    if (static_cast<int>(points_.size()) >= options_.max_points) break;
    int& in_cell = count.at<int>(cell_of(corner));
    if (in_cell >= share || !far_from_new(corner)) continue;
    ++in_cell;
    rests_.at<int>(cell_of(corner)) = 0;
    ids_.push_back(next_id_++);
    points_.push_back(corner);
    noise_factors_.emplace_back(1.0, 0.0, 1.0);
  }
}

}  // namespace camgyro
