// ROS 2 bags: a folder with metadata.yaml and its .db3 or .mcap files, or one such file.
#ifndef CAMGYRO_FRONTEND_READERS_ROS2_BAG_READER_H_
#define CAMGYRO_FRONTEND_READERS_ROS2_BAG_READER_H_

#include <memory>
#include <string>

#include "core/result.h"
#include "frontend/readers/bag.h"

namespace camgyro {

// True for X.db3, X.mcap, and a folder that holds such files, also compressed as whole files.
bool IsRos2Bag(const std::string& path);

// For ReadBag and OpenBagFrames. The files of a folder are those that metadata.yaml lists
// (rosbag2_storage, BagMetadata), in its order; without it all, in the order of their numbers.
Result<std::unique_ptr<Bag>> OpenRos2Bag(const std::string& path);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_ROS2_BAG_READER_H_
