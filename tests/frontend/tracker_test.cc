#include "frontend/tracker.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>

#include "tests/frontend/waves.h"

namespace camgyro {
namespace {

std::map<int64_t, Eigen::Vector2d> ById(const std::vector<TrackedPoint>& points) {
  std::map<int64_t, Eigen::Vector2d> by_id;
  for (const TrackedPoint& point : points) by_id[point.track_id] = point.px;
  return by_id;
}

constexpr int kWidth = 320, kHeight = 240;

TrackerOptions SmallImageOptions() {
  TrackerOptions options;
  options.max_points = 100;
  options.grid = 5;
  return options;
}

// Fraction of the points of `before` that moved by `motion` to within 0.1 px.
double FollowedFraction(const std::vector<TrackedPoint>& before,
                        const std::vector<TrackedPoint>& after, const Eigen::Vector2d& motion) {
  const auto a = ById(before), b = ById(after);
  int good = 0;
  for (const auto& [id, px] : b) {
    const auto it = a.find(id);
    if (it != a.end() && (px - it->second - motion).norm() < 0.1) ++good;
  }
  return static_cast<double>(good) / static_cast<double>(a.size());
}

TEST(KltTracker, FollowsSubPixelMotion) {
  const Waves scene(1);
  KltTracker tracker(SmallImageOptions());
  const Eigen::Vector2d motion(3.37, -2.61);
  auto previous = tracker.Add(scene.Render(kWidth, kHeight, {0, 0}));
  ASSERT_GT(previous.size(), 60u);
  double sum_sq = 0.0, worst = 0.0;
  int count = 0;
  for (int frame = 1; frame <= 5; ++frame) {
    const auto points = tracker.Add(scene.Render(kWidth, kHeight, frame * motion));
    EXPECT_GT(FollowedFraction(previous, points, motion), 0.9);
    const auto a = ById(previous);
    for (const auto& [id, px] : ById(points)) {
      const auto it = a.find(id);
      if (it == a.end()) continue;
      const double error = (px - it->second - motion).norm();
      sum_sq += error * error;
      worst = std::max(worst, error);
      ++count;
    }
    previous = points;
  }
  // Rounding to 8 bits is all the noise there is: sqrt(1/12) levels against gradients of tens.
  EXPECT_LT(std::sqrt(sum_sq / count), 0.025);
  EXPECT_LT(worst, 0.1);
}

// A patch that turns would be found beside its place, towards where its texture is, each time.
TEST(KltTracker, TurningDoesNotMoveAPoint) {
  const Waves scene(1, 0.0);
  KltTracker tracker(SmallImageOptions());
  const double turn_rad = 0.03;
  const Eigen::Vector2d middle(0.5 * kWidth, 0.5 * kHeight);
  std::map<int64_t, Eigen::Vector2d> before;
  double sum_sq = 0.0;
  int count = 0;
  for (int frame = 0; frame <= 5; ++frame) {
    const Eigen::Rotation2Dd turn(frame * turn_rad);
    const auto now =
        ById(tracker.Add(scene.Render(kWidth, kHeight, turn * middle - middle, turn.angle())));
    for (const auto& [id, px] : now) {
      const auto it = before.find(id);
      if (it == before.end()) continue;
      const Eigen::Vector2d truth = Eigen::Rotation2Dd(-turn_rad) * (it->second - middle) + middle;
      sum_sq += (px - truth).squaredNorm();
      ++count;
    }
    before = now;
  }
  ASSERT_GT(count, 200);
  EXPECT_LT(std::sqrt(sum_sq / count), 0.02);
}

TEST(KltTracker, IdsAscendAndAreNeverReused) {
  const Waves scene(2);
  KltTracker tracker(SmallImageOptions());
  std::set<int64_t> gone, present;
  int64_t highest = -1;
  for (int frame = 0; frame < 12; ++frame) {
    const auto points = tracker.Add(scene.Render(kWidth, kHeight, {9.0 * frame, 0.0}));
    std::set<int64_t> now;
    for (size_t i = 0; i < points.size(); ++i) {
      if (i > 0) {
        EXPECT_LT(points[i - 1].track_id, points[i].track_id);
      }
      EXPECT_EQ(gone.count(points[i].track_id), 0u);
      if (present.count(points[i].track_id) == 0) {
        EXPECT_GT(points[i].track_id, highest);
      }
      now.insert(points[i].track_id);
    }
    for (const int64_t id : present) {
      if (now.count(id) == 0) gone.insert(id);
    }
    present = now;
    highest = std::max(highest, *now.rbegin());
  }
  EXPECT_GT(gone.size(), 10u);  // 99 px of motion carried some out of the picture
}

TEST(KltTracker, SpreadsPointsAndKeepsTheirDistance) {
  const Waves scene(3);
  TrackerOptions options = SmallImageOptions();
  options.max_points = 50;
  KltTracker tracker(options);
  const auto points = tracker.Add(scene.Render(kWidth, kHeight, {0, 0}));
  EXPECT_LE(points.size(), 50u);
  const double half_patch = 0.5 * options.window_px;
  std::map<std::pair<int, int>, int> cells;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d& px = points[i].px;
    EXPECT_GE(px.minCoeff(), half_patch);
    EXPECT_LE(px.x(), kWidth - 1 - half_patch);
    EXPECT_LE(px.y(), kHeight - 1 - half_patch);
    ++cells[{static_cast<int>(px.x()) * 5 / kWidth, static_cast<int>(px.y()) * 5 / kHeight}];
    for (size_t j = 0; j < i; ++j) {
      EXPECT_GE((px - points[j].px).norm(), options.min_distance_px);
    }
  }
  EXPECT_GE(cells.size(), 22u);  // of 25: texture is everywhere
  for (const auto& [cell, count] : cells) EXPECT_LE(count, 2);
}

// In one cell for the whole picture, corners are those that OpenCV finds at half its size.
TEST(KltTracker, BeginsWithTheStrongestCorners) {
  TrackerOptions options = SmallImageOptions();
  options.grid = 1;
  const cv::Mat picture = Waves(3).Render(kWidth, kHeight, {0, 0});
  const auto points = KltTracker(options).Add(picture);
  cv::Mat half;
  cv::pyrDown(picture, half);
  // Half of the patch that is aligned, and two pixels for its derivatives, of the whole picture.
  const int border = (options.aligned_px / 2 + 2 + 1) / 2;
  cv::Mat mask = cv::Mat::zeros(half.size(), CV_8U);
  const cv::Point last((kWidth - 1) / 2 - border, (kHeight - 1) / 2 - border);
  mask(cv::Rect({border, border}, last + cv::Point(1, 1))) = 255;
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(half, corners, options.max_points, options.min_quality,
                          0.5 * options.min_distance_px, mask);
  ASSERT_GT(corners.size(), 50u);
  ASSERT_EQ(points.size(), corners.size());
  for (size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].px, Eigen::Vector2d(2.0 * corners[i].x, 2.0 * corners[i].y)) << i;
  }
}

TEST(KltTracker, ReachesAQuarterOfTheWidth) {
  const Waves scene(4);
  KltTracker tracker(SmallImageOptions());
  const Eigen::Vector2d motion(0.25 * kWidth, 0.0);
  const auto before = tracker.Add(scene.Render(kWidth, kHeight, {0, 0}));
  const auto after = tracker.Add(scene.Render(kWidth, kHeight, motion));
  EXPECT_GT(FollowedFraction(before, after, motion), 0.5);
}

// Without a pyramid, most points need the motion of the frame before to find large ones.
TEST(KltTracker, MotionGoesOnAsItWas) {
  const Waves scene(5);
  TrackerOptions options = SmallImageOptions();
  options.max_motion = 0.02;
  KltTracker tracker(options), suddenly(options);
  auto previous = tracker.Add(scene.Render(kWidth, kHeight, {0, 0}));
  double x = 0.0;
  for (const double step : {15.0, 30.0, 45.0, 60.0}) {
    x += step;
    const auto points = tracker.Add(scene.Render(kWidth, kHeight, {x, 0}));
    EXPECT_GT(FollowedFraction(previous, points, {step, 0}), 0.6) << step;
    previous = points;
  }
  const auto at_rest = suddenly.Add(scene.Render(kWidth, kHeight, {0, 0}));
  const auto jumped = suddenly.Add(scene.Render(kWidth, kHeight, {60.0, 0}));
  EXPECT_LT(FollowedFraction(at_rest, jumped, {60.0, 0}), 0.3);
}

TEST(KltTracker, PredictionReplacesTheSearch) {
  const Waves scene(5);
  TrackerOptions options = SmallImageOptions();
  options.max_motion = 0.02;  // 6 px: no level above the half, whose patches reach 21 px
  const Eigen::Vector2d motion(40.0, -25.0);
  const cv::Mat first = scene.Render(kWidth, kHeight, {0, 0});
  const cv::Mat second = scene.Render(kWidth, kHeight, motion);

  KltTracker blind(options);
  const auto before = blind.Add(first);
  // Some of the scene's waves are so long that a patch finds them from further away.
  EXPECT_LT(FollowedFraction(before, blind.Add(second), motion), 0.3);

  KltTracker guided(options);
  guided.Add(first);
  const auto after = guided.Add(second, [&](const Eigen::Vector2d& px) -> Eigen::Vector2d {
    return px + motion + Eigen::Vector2d(2, -1);
  });
  EXPECT_GT(FollowedFraction(before, after, motion), 0.6);  // a quarter leaves the picture
}

TEST(KltTracker, ExposureMayChange) {
  const Waves scene(11, 0.0);  // fine texture
  const Eigen::Vector2d motion(4.3, -2.2);
  const cv::Mat first = scene.Render(kWidth, kHeight, {0, 0});
  cv::Mat darker;
  scene.Render(kWidth, kHeight, motion).convertTo(darker, CV_8U, 0.8, 5.0);
  KltTracker tracker(SmallImageOptions());
  const auto before = tracker.Add(first);
  const auto after = tracker.Add(darker);
  EXPECT_GT(FollowedFraction(before, after, motion), 0.85);
}

TEST(KltTracker, PredictionThatIsNotFiniteIsNoPrediction) {
  const Waves scene(6);
  const Eigen::Vector2d motion(4.0, 3.0);
  KltTracker with(SmallImageOptions()), without(SmallImageOptions());
  const cv::Mat first = scene.Render(kWidth, kHeight, {0, 0});
  const cv::Mat second = scene.Render(kWidth, kHeight, motion);
  with.Add(first);
  without.Add(first);
  const auto a = with.Add(second, [](const Eigen::Vector2d&) -> Eigen::Vector2d {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  });
  const auto b = without.Add(second);
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].px, b[i].px);
}

// A picture that moves to the right is blurred along x: corners are found less well there.
TEST(KltTracker, KnowsWhereItsNoiseIs) {
  const Waves scene(5, 0.0);
  std::mt19937 generator(6);
  std::normal_distribution<double> noise(0.0, 2.0);
  KltTracker tracker;
  std::vector<TrackedPoint> before;
  double raw_x = 0.0, raw_y = 0.0, x = 0.0, y = 0.0;
  int count = 0;
  for (int i = 0; i < 12; ++i) {
    cv::Mat picture = scene.Render(320, 240, Eigen::Vector2d(3.0 * i, 0.0));
    if (i >= 2) cv::blur(picture, picture, cv::Size(13, 1));
    for (int v = 0; v < picture.rows; ++v) {
      for (int u = 0; u < picture.cols; ++u) {
        picture.at<uchar>(v, u) =
            cv::saturate_cast<uchar>(picture.at<uchar>(v, u) + noise(generator));
      }
    }
    const std::vector<TrackedPoint> now = tracker.Add(picture);
    for (const TrackedPoint& point : now) {
      const auto old = std::find_if(before.begin(), before.end(), [&](const TrackedPoint& p) {
        return p.track_id == point.track_id;
      });
      if (i < 3 || old == before.end()) continue;
      const Eigen::Vector2d error = point.px - old->px - Eigen::Vector2d(3.0, 0.0);
      const Eigen::Vector3d L = point.noise_factor.cast<double>();
      const Eigen::Vector2d whitened(error.x() / L[0],
                                     (error.y() - L[1] * error.x() / L[0]) / L[2]);
      raw_x += error.x() * error.x();
      raw_y += error.y() * error.y();
      x += whitened.x() * whitened.x();
      y += whitened.y() * whitened.y();
      ++count;
    }
    before = now;
  }
  ASSERT_GT(count, 500);
  EXPECT_GT(raw_x / raw_y, 4.0);
  EXPECT_LT(x / y, 0.3 * raw_x / raw_y);
  EXPECT_GT(x / y, 0.6);
}

TEST(KltTracker, DropsWhatTheOtherPictureDoesNotShow) {
  KltTracker tracker(SmallImageOptions());
  const auto before = ById(tracker.Add(Waves(7).Render(kWidth, kHeight, {0, 0})));
  ASSERT_GT(before.size(), 60u);
  // Another scene: forward and backward search must disagree for almost all.
  size_t survivors = 0;
  for (const TrackedPoint& point : tracker.Add(Waves(8).Render(kWidth, kHeight, {0, 0}))) {
    survivors += before.count(point.track_id);
  }
  EXPECT_LT(survivors, before.size() / 4);
}

TEST(KltTracker, FindsNothingInAnEmptyWall) {
  KltTracker tracker(SmallImageOptions());
  EXPECT_TRUE(tracker.Add(cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(90))).empty());
}

TEST(KltTracker, AFrameItCannotUseEndsEveryTrack) {
  const Waves scene(9);
  const cv::Mat image = scene.Render(kWidth, kHeight, {0, 0});
  KltTracker tracker(SmallImageOptions());
  const auto first = tracker.Add(image);
  ASSERT_FALSE(first.empty());
  const int64_t last_id = first.back().track_id;

  EXPECT_TRUE(tracker.Add(cv::Mat()).empty());
  const auto again = tracker.Add(image);
  ASSERT_FALSE(again.empty());
  EXPECT_GT(again.front().track_id, last_id);

  EXPECT_TRUE(tracker.Add(cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar::all(0))).empty());
  tracker.Add(image);
  const auto smaller = tracker.Add(image(cv::Rect(0, 0, 200, 200)).clone());
  ASSERT_FALSE(smaller.empty());
  EXPECT_GT(smaller.front().track_id,
            again.back().track_id + static_cast<int64_t>(again.size()) - 1);
}

TEST(KltTracker, TheSameFramesGiveTheSameTracks) {
  const Waves scene(10);
  KltTracker one(SmallImageOptions()), two(SmallImageOptions());
  for (int frame = 0; frame < 3; ++frame) {
    const cv::Mat image = scene.Render(kWidth, kHeight, {5.3 * frame, -1.7 * frame}, 0.01 * frame);
    const auto a = one.Add(image), b = two.Add(image);
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].track_id, b[i].track_id);
      EXPECT_EQ(a[i].px, b[i].px);
    }
  }
}

TEST(PyramidLevels, ReachTheMotion) {
  EXPECT_EQ(PyramidLevels(21, 10.0), 0);
  EXPECT_EQ(PyramidLevels(21, 11.0), 1);
  EXPECT_EQ(PyramidLevels(21, 84.0), 3);  // 10.5 * 8
  EXPECT_EQ(PyramidLevels(21, 480.0), 6);
}

}  // namespace
}  // namespace camgyro
