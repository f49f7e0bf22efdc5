// Recordings with one JSON object per line, as android-viotester, realsense-capture and other
// programs around VIO Benchmark write them (github.com/AaltoML/vio_benchmark, "JSONL format").
#ifndef CAMGYRO_FRONTEND_READERS_JSONL_READER_H_
#define CAMGYRO_FRONTEND_READERS_JSONL_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// True for a folder with data.jsonl.
bool IsJsonl(const std::string& folder);

//   data.jsonl                 {"time": s, "sensor": {"type": "gyroscope", "values": [x, y, z]}}
//                              [rad/s]; the same with "accelerometer" [m/s^2];
//                              {"time": s, "frames": [{"cameraInd": 0, "time": s,
//                              "exposureTimeSeconds": s, "cameraParameters": {"focalLengthX": px,
//                              "focalLengthY": px, "principalPointX": px, ...}}, ...]}; others are
//                              skipped
//   data.mp4, .mov, .mkv, .avi  the pictures of camera 0, one per line with its frame
// Medians of the camera's parameters are the initial guess. Errors as ReadRecording.
Result<Recording> ReadJsonl(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_JSONL_READER_H_
