// How the oldest keyframe leaves the odometry's window.
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/odometry/odometry_window.h"
#include "estimator/odometry/window_program.h"

namespace camgyro {
namespace {

using Eigen::Vector3d;

// What the prior says of a landmark is linearised where the landmark is believed to be when its
// first keyframe leaves. With less than this from there to the newest keyframe, that is not well
// enough known: sigmas of the way become too small (docs/lab/odometry.md).
constexpr double kMinKeptParallaxRad = 0.3;

}  // namespace

double OdometryWindow::ParallaxRad(const OdometrySighting& a, const OdometrySighting& b) const {
  const Vector3d from = LineOf(a).direction, to = LineOf(b).direction;
  return std::atan2(from.cross(to).norm(), from.dot(to));
}

// Landmarks that have been seen longest come first.
void OdometryWindow::ChooseKept() {
  size_t kept = 0;
  std::vector<OdometryLandmark*> candidates;
  for (auto& [track_id, landmark] : landmarks_) {
    kept += landmark.in_prior;
    if (landmark.in_prior || !landmark.used()) continue;
    if (landmark.sightings.front().keyframe == &keyframes_.front() &&
        landmark.sightings.back().keyframe == &keyframes_.back() &&
        ParallaxRad(landmark.sightings.front(), landmark.sightings.back()) > kMinKeptParallaxRad) {
      candidates.push_back(&landmark);
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto* a, const auto* b) {
    return a->sightings.size() > b->sightings.size();
  });
  for (OdometryLandmark* candidate : candidates) {
    if (kept++ >= static_cast<size_t>(options_.kept_landmarks)) return;
    candidate->in_prior = true;
  }
}

size_t OdometryWindow::OlderSightings(const OdometryLandmark& landmark) const {
  const int64_t half_ns = keyframes_[keyframes_.size() / 2].time_ns;
  const auto newer =
      std::find_if(landmark.sightings.begin(), landmark.sightings.end(),
                   [&](const OdometrySighting& s) { return s.keyframe->time_ns >= half_ns; });
  return static_cast<size_t>(newer - landmark.sightings.begin());
}

size_t OdometryWindow::LeavingSightings(const OdometryLandmark& landmark) const {
  const std::vector<OdometrySighting>& sightings = landmark.sightings;
  const size_t older = OlderSightings(landmark);
  if (landmark.in_prior && older == sightings.size()) return older;
  if (sightings.empty() || sightings.front().keyframe != &keyframes_.front()) return 0;
  if (landmark.in_prior) return 1;
  return landmark.used() && older >= 2 ? older : 1;
}

int OdometryWindow::LayOutMarginalisation(Program* program, ReducedInformation* information,
                                          std::vector<PriorBlock>* staying) {
  Program::AddKeyframe(&keyframes_.front(), information);
  std::vector<PriorBlock> kept_points;
  for (auto& [track_id, landmark] : landmarks_) {
    if (!landmark.in_prior) continue;
    if (LeavingSightings(landmark) == landmark.sightings.size()) {
      information->AddBlock(landmark.point.data(), 3);
    } else {
      kept_points.push_back({landmark.point.data(), 4, MarginalPrior::Kind::kHomogeneousPoint});
    }
  }
  const int leading = information->size();
  for (size_t k = 1; k <= keyframes_.size() / 2; ++k) {
    OdometryNode& other = keyframes_[k];
    Program::AddKeyframe(&other, information);
    staying->push_back({other.q(), 4, MarginalPrior::Kind::kRotation});
    for (double* block : {other.p(), other.v(), other.bias_gyro(), other.bias_accel()}) {
      staying->push_back({block});
    }
  }
  program->AddShared(information);
  staying->push_back({calibration_.data(), kStateSize});
  staying->push_back({arm_.data()});
  for (const PriorBlock& point : kept_points) {
    information->AddBlock(point.values, 3);
    staying->push_back(point);
  }
  return leading;
}

bool OdometryWindow::AddWhatLeaves(const Program& program, ReducedInformation* information) const {
  if (!information->Add(program.problem(), program.prior())) return false;
  for (const ceres::ResidualBlockId id : program.LinksOf(1)) {
    if (!information->Add(program.problem(), id)) return false;
  }
  for (const auto& [track_id, landmark] : landmarks_) {
    const size_t leaving = LeavingSightings(landmark);
    // One sighting of a point that has to be found by it as well says nothing.
    if (leaving == 0 || (!landmark.in_prior && leaving < 2)) continue;
    std::vector<ceres::ResidualBlockId> ids = program.SightingsOf(track_id);
    ids.resize(leaving);
    if (!landmark.in_prior) {
      if (!information->AddWithout(program.problem(), ids, landmark.point.data(), 3)) return false;
      continue;
    }
    for (const ceres::ResidualBlockId id : ids) {
      if (!information->Add(program.problem(), id)) return false;
    }
  }
  return true;
}

void OdometryWindow::RemoveWhatLeaves() {
  for (auto it = landmarks_.begin(); it != landmarks_.end();) {
    OdometryLandmark& landmark = it->second;
    const size_t leaving = LeavingSightings(landmark);
    std::vector<OdometrySighting>& sightings = landmark.sightings;
    sightings.erase(sightings.begin(), sightings.begin() + static_cast<std::ptrdiff_t>(leaving));
    if (leaving > 0 && !landmark.in_prior && sightings.size() < 2) landmark.point.setZero();
    it = sightings.empty() ? landmarks_.erase(it) : std::next(it);
  }
  keyframes_.pop_front();
  OdometryNode& first = keyframes_.front();
  first.inertial.reset();
  first.gyro_walk.reset();
  first.accel_walk.reset();
}

// Biases of keyframes further on, which nothing has spoken of yet, are no part of the prior.
void OdometryWindow::SetPriorOfWhatIsKnown(const std::vector<PriorBlock>& blocks,
                                           const Quadratic& left) {
  std::vector<PriorBlock> known;
  std::vector<Eigen::Index> columns;
  Eigen::Index column = 0;
  for (const PriorBlock& block : blocks) {
    const Eigen::Index size = block.kind == MarginalPrior::Kind::kVector ? block.size : 3;
    if (!left.g.segment(column, size).isZero(0.0) ||
        !left.H.diagonal().segment(column, size).isZero(0.0)) {
      known.push_back(block);
      for (Eigen::Index i = 0; i < size; ++i) columns.push_back(column + i);
    }
    column += size;
  }
  SetPrior(std::move(known), RootOf({left.H(columns, columns), left.g(columns)}));
}

Result<WindowKeyframe> OdometryWindow::MarginaliseOldest() {
  CHECK_GT(keyframes_.size(), 2u);
  const WindowKeyframe leaving = keyframe(0);
  Program program(this);
  ChooseKept();
  ReducedInformation information;
  std::vector<PriorBlock> staying;
  const int leading = LayOutMarginalisation(&program, &information, &staying);
  if (!AddWhatLeaves(program, &information)) {
    return CannotEstimate("a keyframe cannot be marginalised");
  }
  SetPriorOfWhatIsKnown(staying, information.Without(leading));
  RemoveWhatLeaves();
  return leaving;
}

}  // namespace camgyro
