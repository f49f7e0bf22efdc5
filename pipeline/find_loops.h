// Loops of an odometry over a recording with pictures: which keyframes see an older one's place
// again, and where they are from there.
#ifndef CAMGYRO_PIPELINE_FIND_LOOPS_H_
#define CAMGYRO_PIPELINE_FIND_LOOPS_H_

#include <functional>
#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "estimator/odometry/follow_recording.h"
#include "estimator/odometry/pose_graph.h"

namespace camgyro {

struct FoundLoop {
  LoopEdge edge;        // of OdometryRun::keyframes
  int sightings = 0;    // of the newer one's landmarks in the older one's picture
  double noise_px = 0;  // of them
  bool believed = false;
};

// What a recording's loops make of its odometry.
struct LoopClosure {
  std::string unavailable;  // why nobody has looked for loops; empty: somebody has
  std::vector<FoundLoop> loops;
  int candidates = 0;  // pairs of keyframes that looked alike
  // OdometryRun::keyframes and poses with the loops closed. Empty where none is believed: an hour
  // of poses takes 200 MB, which nobody needs twice.
  std::vector<OdometryPose> keyframes, poses;
  int Believed() const;
};

// One line for people: how many loops, or why nobody has looked for any.
std::string LoopsInWords(const LoopClosure& closure);

// Decodes the pictures once more. Places are recognised by what they look like (place_index.h),
// whatever the odometry says of where they are; a candidate is verified by the perspective of the
// newer keyframe's landmarks in the older one's picture, whose rays are corrected to one time, and
// by gravity (what it says of roll and pitch); then the pose graph decides. Tracks without pictures
// have no loops, and say so. `progress` gets the share that is done and may be null. Errors: of
// the files; kCannotEstimate as CloseLoops.
Result<LoopClosure> FindLoops(const Recording& recording, const OdometryRun& run,
                              double gravity_m_s2, const std::function<void(double)>& progress);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_FIND_LOOPS_H_
