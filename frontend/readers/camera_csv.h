// The tables of cam0/: frame stamps, tracks, pairwise matches, attitudes.
#ifndef CAMGYRO_FRONTEND_READERS_CAMERA_CSV_H_
#define CAMGYRO_FRONTEND_READERS_CAMERA_CSV_H_

#include <cstdint>
#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/readers/frame_order.h"

namespace camgyro {

// cam0/data.csv: #timestamp [ns][,filename[,exposure [s]]]. image_file is the name as written.
struct FrameTable {
  std::vector<Frame> frames;  // as the file has them; `order` mends their stamps
  std::vector<int> lines;     // of each frame, in the file
  FrameOrder order;
};
Result<FrameTable> ReadFrameTable(const std::string& file);

// The stamps that a table names in its first column (in its first two, for matches), sorted and
// unique: what frames are made of without cam0/data.csv.
Result<std::vector<int64_t>> ReadTrackStamps(const std::string& file);
Result<std::vector<int64_t>> ReadMatchStamps(const std::string& file);
Result<std::vector<int64_t>> ReadAttitudeStamps(const std::string& file);

// Each fills its part of the recording, whose frames and resolution (0: not checked) stand.
// A stamp that is not among the frames is an error.
//   cam0/tracks.csv    #timestamp [ns],track_id,u [px],v [px]
//   cam0/matches.csv   #timestamp_a [ns],timestamp_b [ns],u_a,v_a,u_b,v_b [px]
//   cam0/attitude.csv  #timestamp [ns],q_cam_world_w,x,y,z   one row for every frame
Status ReadTracks(const std::string& file, Recording* recording);
Status ReadMatches(const std::string& file, Recording* recording);
Status ReadAttitudes(const std::string& file, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_CAMERA_CSV_H_
