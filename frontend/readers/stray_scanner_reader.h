// Folders of Stray Scanner for iPhones (docs.strayrobots.io/apps/scanner/format.html).
#ifndef CAMGYRO_FRONTEND_READERS_STRAY_SCANNER_READER_H_
#define CAMGYRO_FRONTEND_READERS_STRAY_SCANNER_READER_H_

#include <string>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// True if the folder holds odometry.csv and imu.csv.
bool IsStrayScanner(const std::string& folder);

//   imu.csv            timestamp [s], a_x, a_y, a_z, alpha_x, alpha_y, alpha_z: alpha is the
//   angular
//                      rate [rad/s]; a points as gravity does (Apple's sign), in m/s^2, or in g as
//                      some versions of the app write it, which its size tells
//   odometry.csv       timestamp [s], frame, x, y, z, qx, qy, qz, qw (camera -> world), and more:
//                      one row per picture
//   rgb.mp4            the pictures; without it the attitudes of odometry.csv serve
//   camera_matrix.csv  3 x 3, an initial guess; optional
// Errors as ReadRecording.
Result<Recording> ReadStrayScanner(const std::string& folder);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_STRAY_SCANNER_READER_H_
