// ROS 1 bags (format 2.0), through librosbag. Of builds that have it: see formats.cc.
#ifndef CAMGYRO_FRONTEND_READERS_ROSBAG_READER_H_
#define CAMGYRO_FRONTEND_READERS_ROSBAG_READER_H_

#include <memory>
#include <string>

#include "core/result.h"
#include "frontend/readers/bag.h"

namespace camgyro {

// For ReadBag and OpenBagFrames. Errors: not a bag, or one that was not closed.
Result<std::unique_ptr<Bag>> OpenRosbag(const std::string& path);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_ROSBAG_READER_H_
