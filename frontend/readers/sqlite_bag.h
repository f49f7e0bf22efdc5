// The SQLite files of ROS 2 bags (github.com/ros2/rosbag2, rosbag2_storage_sqlite3).
#ifndef CAMGYRO_FRONTEND_READERS_SQLITE_BAG_H_
#define CAMGYRO_FRONTEND_READERS_SQLITE_BAG_H_

#include <memory>
#include <string>

#include "core/result.h"
#include "frontend/readers/bag.h"

namespace camgyro {

// Messages may be compressed one by one (rosbag2's compression mode "message", Zstandard). The file
// is opened for reading only, and as one that nobody vouches for. Errors: no such database.
Result<std::unique_ptr<Bag>> OpenSqliteBag(const std::string& path);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_SQLITE_BAG_H_
