// Adds what the pictures themselves say: their size, and a video's stamps.
#ifndef CAMGYRO_FRONTEND_READERS_ADD_PICTURES_H_
#define CAMGYRO_FRONTEND_READERS_ADD_PICTURES_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Takes the size that the picture `file` has, or refuses if `declared_in` said another one.
Status SetResolution(int width_px, int height_px, const std::string& file,
                     const std::string& declared_in, CameraGuess* camera);

// Makes `video` the pictures of the recording. If it has frames (from `frames_file`) they must be
// as many as the video's; if not, they are the video's, with the container's stamps. A rotation for
// display is noted, not applied. `declared_in` as above. Of a video that is cut short, what is
// whole is used: fault video_cut_short.
Status AddVideo(const std::string& video, const std::string& frames_file,
                const std::string& declared_in, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_ADD_PICTURES_H_
