// recording.yaml: where in files of any logger the samples and pictures are.
#ifndef CAMGYRO_FRONTEND_READERS_RECORDING_YAML_READER_H_
#define CAMGYRO_FRONTEND_READERS_RECORDING_YAML_READER_H_

#include <memory>
#include <string>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/frame_source.h"

namespace camgyro {

// True for a file recording.yaml, and for a folder that holds one.
bool IsRecordingYaml(const std::string& path);

// docs/recording_format.md has the keys. Files are named relative to recording.yaml, and are in its
// folder or below. Errors as ReadRecording; an unknown key is one.
Result<Recording> ReadRecordingYaml(const std::string& path);

// The pictures of a recording whose recording.yaml names a bag; it must outlive the source. (Those
// of other ones are images or a video, as the recording itself says.)
Result<std::unique_ptr<FrameSource>> OpenRecordingYamlFrames(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_RECORDING_YAML_READER_H_
