#include "pipeline/find_loops.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/format.h"
#include "core/imu_integral.h"
#include "core/time.h"
#include "estimator/odometry/loop_pose.h"
#include "frontend/frame_source.h"
#include "frontend/place_index.h"
#include "frontend/ray_pose.h"

namespace camgyro {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Younger keyframes may share landmarks with the one that looks: what they know is the same.
constexpr double kLeastLoopGapS = 10.0;
// Loops of neighbouring keyframes have the same landmarks, and would count them twice.
constexpr double kLoopIntervalS = 1.0;
// Candidates per keyframe, and the votes (place_index.h) that make one.
constexpr size_t kCandidates = 3;
constexpr int kLeastVotes = 12;
// What a loop needs: as VINS-Mono's 25 matches, of a wrong place four can fit by chance.
constexpr size_t kLeastSightings = 20;
// Of descriptors that match, RANSAC's inliers at least.
constexpr double kLeastShare = 0.3;
// RANSAC takes all rows for seen from one place: 1.4 m/s in 12 ms at 3 m are 6 mrad.
constexpr double kRansacRad = 0.01;
// Roll and pitch are known by gravity to better than a degree, and by RANSAC to about one.
constexpr double kMostTiltRad = 0.05;
// A landmark has to be where its keyframe sees it: others are from before a loss, or have moved.
constexpr double kMapErrorPx = 3.0;

// Pose of the camera when one of its rows was exposed.
struct RowCamera {
  Quaterniond q_world_cam = Quaterniond::Identity();
  Vector3d p_world_m = Vector3d::Zero();
};

class LoopFinder {
 public:
  LoopFinder(const Recording& recording, const OdometryRun& run, double gravity_m_s2)
      : recording_(recording),
        run_(run),
        gravity_m_s2_(gravity_m_s2),
        lens_(GetLens(run.calibration.distortion_model)),
        lens_parameters_(run.calibration.FullLens()) {
    for (const MappedPoint& point : run.points) points_[point.track_id] = point.p_world_m;
  }

  // The next keyframe, in the order of time, with its picture.
  void Add(size_t keyframe, size_t frame, const cv::Mat& gray) {
    const OdometryPose& pose = run_.keyframes[keyframe];
    const Vector3d down_cam =
        (pose.state.q_world_gyro * run_.calibration.q_gyro_cam).conjugate() * -Vector3d::UnitZ();
    PictureFeatures features = DescribePicture(gray, recording_.tracks[frame], down_cam);
    Look(keyframe, features);
    // What was tracked then is likely to be what is tracked now.
    Place place{keyframe, std::move(features.corners_px), features.corners};
    place.corners_px.insert(place.corners_px.end(), features.tracks_px.begin(),
                            features.tracks_px.end());
    if (!features.tracks.empty()) place.corners.push_back(features.tracks);
    index_.Add(place.corners);
    places_.push_back(std::move(place));
  }

  std::vector<FoundLoop> loops;
  int candidates = 0;

 private:
  struct Place {
    size_t keyframe = 0;
    std::vector<Eigen::Vector2d> corners_px;
    cv::Mat corners;
  };
  struct Landmarks {
    std::vector<Vector3d> points_m;
    cv::Mat descriptors;
  };

  void Look(size_t keyframe, const PictureFeatures& features) {
    const int64_t now_ns = run_.keyframes[keyframe].time_ns;
    if (last_loop_ns_ && SecondsSince(*last_loop_ns_, now_ns) < kLoopIntervalS) return;
    size_t end = places_.size();
    while (end > 0 && SecondsSince(run_.keyframes[places_[end - 1].keyframe].time_ns, now_ns) <
                          kLeastLoopGapS) {
      --end;
    }
    if (end == 0) return;
    const Landmarks landmarks = LandmarksOf(keyframe, features);
    std::vector<PlaceVotes> found = index_.Query(landmarks.descriptors, end, kLeastVotes);
    if (found.size() > kCandidates) found.resize(kCandidates);
    for (const PlaceVotes& candidate : found) {
      ++candidates;
      if (const auto loop = Verify(keyframe, landmarks, places_[candidate.place])) {
        loops.push_back(*loop);
        last_loop_ns_ = now_ns;
        return;
      }
    }
  }

  // What the keyframe sees of the map, where it is where it is seen.
  Landmarks LandmarksOf(size_t keyframe, const PictureFeatures& features) const {
    Landmarks landmarks;
    const auto imu = RowsOf(run_.keyframes[keyframe]);
    if (!imu) return landmarks;
    for (size_t i = 0; i < features.track_ids.size(); ++i) {
      const auto point = points_.find(features.track_ids[i]);
      if (point == points_.end()) continue;
      const Eigen::Vector2d& px = features.tracks_px[i];
      const RowCamera camera = CameraAt(run_.keyframes[keyframe], *imu, px);
      const auto projected = lens_.Project(
          camera.q_world_cam.conjugate() * (point->second - camera.p_world_m), lens_parameters_);
      if (!projected || (*projected - px).norm() > kMapErrorPx) continue;
      landmarks.points_m.push_back(point->second);
      landmarks.descriptors.push_back(features.tracks.row(static_cast<int>(i)));
    }
    return landmarks;
  }

  std::optional<FoundLoop> Verify(size_t newer, const Landmarks& landmarks,
                                  const Place& place) const {
    const std::vector<DescriptorMatch> matches =
        MatchDescriptors(landmarks.descriptors, place.corners);
    const OdometryPose& older = run_.keyframes[place.keyframe];
    const auto imu = RowsOf(older);
    if (matches.size() < kLeastSightings || !imu) return std::nullopt;
    const Vector3d& pivot_m = run_.keyframes[newer].state.p_world_m;
    // The camera at the time of the middle row, for RANSAC.
    const RowCamera middle = CameraAt(older, *imu, {0.0, 0.5 * run_.calibration.height_px});
    std::vector<Vector3d> points, rays;
    std::vector<TurnedProjection> sightings;
    for (const DescriptorMatch& match : matches) {
      const Eigen::Vector2d& px = place.corners_px[static_cast<size_t>(match.b)];
      TurnedProjection seen;
      if (!lens_.Unproject(px, lens_parameters_, &seen.ray, LensDerivatives::kNone)) continue;
      const RowCamera camera = CameraAt(older, *imu, px);
      const Vector3d ray =
          middle.q_world_cam.conjugate() * (camera.q_world_cam * seen.ray.ray.normalized());
      if (ray.z() < 0.1) continue;  // RANSAC's picture is a plane
      seen.point_m = landmarks.points_m[static_cast<size_t>(match.a)];
      seen.pivot_m = pivot_m;
      seen.q_world_cam = camera.q_world_cam;
      seen.p_cam_m = camera.p_world_m;
      points.push_back(seen.point_m);
      rays.push_back(ray);
      sightings.push_back(seen);
    }
    const auto pose = PoseFromRays(points, rays, kRansacRad);
    if (!pose || pose->inliers.size() < kLeastSightings ||
        static_cast<double>(pose->inliers.size()) <
            kLeastShare * static_cast<double>(matches.size())) {
      return std::nullopt;
    }
    const TurnAndTilt guess = TurnBetween(pose->q_world_cam, pose->p_world_m, middle.q_world_cam,
                                          middle.p_world_m, pivot_m);
    if (guess.tilt_rad > kMostTiltRad) return std::nullopt;
    std::vector<TurnedProjection> inliers;
    for (const int i : pose->inliers) inliers.push_back(sightings[static_cast<size_t>(i)]);
    const Result<LoopPose> fitted = FitLoopPose(inliers, guess.shift_turn);
    if (!fitted || fitted->inliers.size() < kLeastSightings) return std::nullopt;
    return LoopBetween(place.keyframe, newer, *fitted);
  }

  FoundLoop LoopBetween(size_t older, size_t newer, const LoopPose& pose) const {
    FoundLoop loop;
    loop.edge.older = older;
    loop.edge.newer = newer;
    loop.edge.measured.p_a_b_m = run_.keyframes[newer].state.p_world_m + pose.shift_turn.head<3>() -
                                 run_.keyframes[older].state.p_world_m;
    loop.edge.measured.yaw_a_b_rad = pose.shift_turn[3];
    loop.edge.measured.covariance = pose.covariance;
    loop.sightings = static_cast<int>(pose.inliers.size());
    loop.noise_px = pose.noise_px;
    return loop;
  }

  // The inertial way over a keyframe's rows, in seconds from its middle one.
  std::optional<ImuIntegral> RowsOf(const OdometryPose& pose) const {
    const double reach_s = 0.6 * std::abs(run_.calibration.readout_s) + 1e-3;
    const auto gyro = Around(recording_.gyro, pose.time_ns, reach_s);
    const auto accel = Around(recording_.accel, pose.time_ns, reach_s);
    if (gyro.size() < 2 || accel.empty()) return std::nullopt;
    return ImuIntegral(gyro, accel, pose.time_ns, pose.state.bias_gyro_rad_s,
                       pose.state.bias_accel_m_s2);
  }

  template <typename Sample>
  static std::vector<Sample> Around(const std::vector<Sample>& samples, int64_t time_ns,
                                    double reach_s) {
    const auto by_stamp = [](const Sample& s, int64_t stamp) { return s.stamp_ns < stamp; };
    auto first =
        std::lower_bound(samples.begin(), samples.end(), StampAt(time_ns, -reach_s), by_stamp);
    auto last = std::lower_bound(first, samples.end(), StampAt(time_ns, reach_s), by_stamp);
    if (first != samples.begin()) --first;
    if (last != samples.end()) ++last;
    return {first, last};
  }

  RowCamera CameraAt(const OdometryPose& pose, const ImuIntegral& imu,
                     const Eigen::Vector2d& px) const {
    const Calibration& c = run_.calibration;
    const double row_s = c.delay_s + c.readout_s * px.y() / c.height_px;
    const double from_node_s = SecondsSince(pose.time_ns, StampAt(pose.frame_stamp_ns, row_s));
    const NavigationState row = Predict(pose.state, imu.Between(0.0, from_node_s), gravity_m_s2_);
    return {row.q_world_gyro * c.q_gyro_cam, row.p_world_m + row.q_world_gyro * run_.p_gyro_cam_m};
  }

  const Recording& recording_;
  const OdometryRun& run_;
  const double gravity_m_s2_;
  const Lens& lens_;
  const LensParameters lens_parameters_;
  std::map<int64_t, Vector3d> points_;  // by track, in the world
  PlaceIndex index_;
  std::vector<Place> places_;
  std::optional<int64_t> last_loop_ns_;
};

}  // namespace

int LoopClosure::Believed() const {
  return static_cast<int>(std::count_if(loops.begin(), loops.end(),
                                        [](const FoundLoop& loop) { return loop.believed; }));
}

std::string LoopsInWords(const LoopClosure& closure) {
  if (!closure.unavailable.empty()) return "not looked for: " + closure.unavailable;
  return Format("%d closed; %zu of %d pairs of keyframes that look alike were verified",
                closure.Believed(), closure.loops.size(), closure.candidates);
}

Result<LoopClosure> FindLoops(const Recording& recording, const OdometryRun& run,
                              double gravity_m_s2, const std::function<void(double)>& progress) {
  LoopClosure closure;
  if (!recording.HasImages()) {
    closure.unavailable = "no pictures: tracks alone do not say what a place looks like";
    return closure;
  }
  std::map<int64_t, size_t> keyframe_by_stamp;
  for (size_t i = 0; i < run.keyframes.size(); ++i) {
    keyframe_by_stamp.emplace(run.keyframes[i].frame_stamp_ns, i);
  }
  auto source = OpenFrames(recording);
  if (!source) return tl::unexpected(source.error());
  LoopFinder finder(recording, run, gravity_m_s2);
  for (size_t frame = 0; frame < recording.frames.size(); ++frame) {
    cv::Mat picture;
    std::string complaint;
    const Result<bool> next = (*source)->NextOfAnySize(&picture, &complaint);
    if (!next) return tl::unexpected(next.error());
    if (!*next) break;
    const auto keyframe = keyframe_by_stamp.find(recording.frames[frame].stamp_ns);
    if (keyframe != keyframe_by_stamp.end() && !picture.empty()) {
      finder.Add(keyframe->second, frame, picture);
    }
    if (progress) {
      progress(static_cast<double>(frame + 1) / static_cast<double>(recording.frames.size()));
    }
  }
  closure.loops = std::move(finder.loops);
  closure.candidates = finder.candidates;
  std::vector<LoopEdge> edges;
  for (const FoundLoop& loop : closure.loops) edges.push_back(loop.edge);
  Result<ClosedLoops> closed = CloseLoops(run.keyframes, edges);
  if (!closed) return tl::unexpected(closed.error());
  for (size_t i = 0; i < edges.size(); ++i) closure.loops[i].believed = closed->believed[i];
  if (closure.Believed() == 0) return closure;
  closure.keyframes = std::move(closed->keyframes);
  closure.poses = MoveWithKeyframes(run.poses, closure.keyframes);
  return closure;
}

}  // namespace camgyro
