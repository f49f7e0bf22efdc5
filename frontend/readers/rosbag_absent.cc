// In place of rosbag_reader.cc where the build has no librosbag.
#include "frontend/readers/rosbag_reader.h"

namespace camgyro {
namespace {

tl::unexpected<Error> Absent(const std::string& path) {
  return BadInput(path +
                  ": a ROS bag; this camgyro was built without librosbag, which reading it needs "
                  "(librosbag-storage-dev and libsensor-msgs-dev)");
}

}  // namespace

bool IsRosbag(const std::string& path) {
  return path.size() > 4 && path.compare(path.size() - 4, 4, ".bag") == 0;
}

Result<Recording> ReadRosbag(const std::string& path) { return Absent(path); }

Result<std::unique_ptr<FrameSource>> OpenRosbagFrames(const Recording& recording) {
  return Absent(recording.video_file);
}

}  // namespace camgyro
