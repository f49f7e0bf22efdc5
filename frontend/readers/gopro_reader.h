// Reader of GoPro MP4 files: video, and GPMF telemetry inside of the same container.
#ifndef CAMGYRO_FRONTEND_READERS_GOPRO_READER_H_
#define CAMGYRO_FRONTEND_READERS_GOPRO_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// All stamps count from the container's time 0. Frames have the container's stamps, and exposures
// from SHUT. Gyro and accelerometer samples lie on one line of constant rate (sample_clock.h)
// through the starts of their payloads, and in one frame for all models, GoPro's axes x, y, z:
// stored samples mapped by ORIN, or by the model's known order. The file does not say how these
// axes lie to the camera's, so q_gyro_cam stays empty. camera.readout_s is the median of SROT.
// Errors: not a video, no telemetry or none of a gyro, a telemetry item that is cut short.
Result<Recording> ReadGoPro(const std::string& file);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_GOPRO_READER_H_
