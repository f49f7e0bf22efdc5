// Cuts tracks where a match is wrong, frame after frame.
#ifndef CAMGYRO_FRONTEND_TRACK_CLEANER_H_
#define CAMGYRO_FRONTEND_TRACK_CLEANER_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/recording.h"
#include "frontend/gyro_rotation.h"

namespace camgyro {

// An id above all of these tracks' (one entry per frame, by ascending id).
int64_t FreeTrackId(const std::vector<std::vector<TrackedPoint>>& tracks);

// From a wrong match on, a track goes on under a new id: what lies before and after it are two
// features, as far as anybody knows.
class TrackCleaner {
 public:
  // first_new_id: above every id that the tracker gives; cut tracks are numbered from there.
  TrackCleaner(int width_px, int height_px, int64_t first_new_id)
      : width_px_(width_px), height_px_(height_px), next_id_(first_new_id) {}

  // The points of the next frame, by ascending id of the tracker; returned by ascending new id.
  // rotation: the gyro's, from the frame before to this one: wrong is then what is off its epipolar
  // line; without it, what RejectByBinHomography rejects (outliers.h).
  std::vector<TrackedPoint> Add(const std::vector<TrackedPoint>& points,
                                const std::optional<GyroRotation>& rotation = std::nullopt);

  // Share of the matches so far that were wrong.
  double wrong_ratio() const {
    return all_ > 0 ? static_cast<double>(wrong_) / static_cast<double>(all_) : 0.0;
  }

 private:
  const int width_px_, height_px_;
  int64_t next_id_;
  std::vector<TrackedPoint> before_;
  // The tracker's id -> ours, of the cut tracks that are seen now: bounded, however long it runs.
  std::map<int64_t, int64_t> renamed_;
  size_t wrong_ = 0, all_ = 0;
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_TRACK_CLEANER_H_
