// Folders of MARSLogger (github.com/OSUPCVLab/mobile-ar-sensor-logger), Android and iOS.
#ifndef CAMGYRO_FRONTEND_READERS_MARS_LOGGER_READER_H_
#define CAMGYRO_FRONTEND_READERS_MARS_LOGGER_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// True if the folder holds gyro_accel.csv.
bool IsMarsLogger(const std::string& folder);

//   gyro_accel.csv        Timestamp[nanosec],gx[rad/s],gy[rad/s],gz[rad/s],ax[m/s^2],..., or [sec]
//   movie.mp4             the video (iOS: movie.MP4 or movie.mov)
//   frame_timestamps.txt  Frame timestamp[nanosec]: one line per picture of the video (Android)
//   movie_metadata.csv    Timestamp[nanosec],fx[px],fy[px],...,Exposure time[nanosec],...,
//                         Frame readout time[nanosec]: one line per capture. They are more than the
//                         pictures on Android, and belong to the picture whose stamp they have
// Initial guesses: focal length and readout, medians of the captures. Errors as ReadRecording.
Result<Recording> ReadMarsLogger(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_MARS_LOGGER_READER_H_
