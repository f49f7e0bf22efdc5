// The formats of recordings: one row per format. ReadRecording and OpenFrames walk the table; help
// and complaints are made of it.
#ifndef CAMGYRO_FRONTEND_READERS_FORMATS_H_
#define CAMGYRO_FRONTEND_READERS_FORMATS_H_

#include <memory>
#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/frame_source.h"
#include "frontend/readers/bag.h"

namespace camgyro {

struct RecordingFormat {
  const char* name;        // as in docs/recording_format.md
  const char* looks_like;  // the files that tell it, for people
  // True if the path, which exists, is of this format: by the names and the first bytes of files.
  // The first row that says so is taken.
  bool (*matches)(const std::string& path);
  // Null in a build without the library that it needs.
  Result<Recording> (*read)(const std::string& path);
  const char* needs = "";  // Debian's packages of that library
  // The pictures of a recording whose video_file is of this format. Null where they are images, or
  // a video that FFmpeg decodes. The recording must outlive the source.
  Result<std::unique_ptr<FrameSource>> (*open_frames)(const Recording& recording) = nullptr;
  OpenBag open_bag = nullptr;  // null where it is no bag
};

const std::vector<RecordingFormat>& RecordingFormats();

// The format of a path; null if it is of none.
const RecordingFormat* FindFormat(const std::string& path);

// What is wrong with using a format that this build has no library for.
Status CheckBuilt(const RecordingFormat& format, const std::string& path);

// "NAME (LOOKS LIKE); NAME (LOOKS LIKE); ...", for complaints.
std::string ListFormats();

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_FORMATS_H_
