#include "frontend/readers/add_pictures.h"

#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"
#include "frontend/readers/video_container.h"

namespace camgyro {

Status SetResolution(int width_px, int height_px, const std::string& file,
                     const std::string& declared_in, CameraGuess* camera) {
  if (camera->width_px != 0 && (camera->width_px != width_px || camera->height_px != height_px)) {
    return BadInput(Concat(file, ": the picture has ", width_px, " x ", height_px, " pixels, but ",
                           declared_in, " says resolution [", camera->width_px, ", ",
                           camera->height_px, "]; expected the same"));
  }
  camera->width_px = width_px;
  camera->height_px = height_px;
  return {};
}

Status AddVideo(const std::string& video_file, const std::string& frames_file,
                const std::string& declared_in, Recording* recording) {
  const Result<VideoContainer> video = ReadVideoContainer(video_file);
  if (!video) return tl::unexpected(video.error());
  const size_t whole = video->stamps_ns.size();
  const auto missing = static_cast<size_t>(video->missing_frames);
  if (recording->frames.empty()) {
    for (const int64_t stamp_ns : video->stamps_ns) {
      recording->frames.emplace_back().stamp_ns = stamp_ns;
    }
  } else if (recording->frames.size() != whole + missing) {
    return BadInput(Concat(frames_file, ": has ", recording->frames.size(), " frames, but ",
                           video_file, " has ", whole + missing, "; expected the same number"));
  }
  if (missing > 0) {
    std::vector<int> left_out;
    for (size_t i = whole; i < recording->frames.size(); ++i) {
      left_out.push_back(static_cast<int>(i));
    }
    LeaveOutFrames(left_out, /*repeats=*/false, recording);
    // The pictures that are used end before those of the file do.
    for (size_t i = 0; i < whole; ++i) recording->frames[i].picture = static_cast<int>(i);
    AddFault("video_cut_short", static_cast<int>(missing),
             Concat(video_file, ": the file is cut short: its first ", whole, " frames are used, ",
                    missing, " are missing"),
             recording);
  }
  recording->video_file = video_file;
  if (video->display_rotation_deg != 0) {
    recording->notes.push_back(
        Concat(video_file, ": is to be shown rotated by ", video->display_rotation_deg,
               " deg clockwise; rows are read out as coded, so it is used without that rotation"));
  }
  return SetResolution(video->width_px, video->height_px, video_file, declared_in,
                       &recording->camera);
}

}  // namespace camgyro
