// Plain types of the library's interface: no Eigen, OpenCV or Ceres, whose layout depends on how a
// program is compiled.
//
// Conventions. Time: int64 nanoseconds of a clock; t_gyro = t_camera + delay_s, and row v of h rows
// is exposed at t_gyro = stamp + delay_s + readout_s * v / h; of a picture that was turned, column
// u of w columns later by column_readout_s * u / w. Camera frame: x right, y down, z forward; pixel
// (0, 0) is the centre of the top-left pixel. q_gyro_cam maps camera vectors to the gyro frame
// (Hamilton, [w x y z]). Rates: measured = true + bias.
#ifndef CAMGYRO_TYPES_H_
#define CAMGYRO_TYPES_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "camgyro/export.h"

namespace camgyro::api {

using Vec3 = std::array<double, 3>;

// 8-bit grey; row r begins at pixels + r * stride_bytes. Only looked at during the call.
struct ImageView {
  const std::uint8_t* pixels = nullptr;
  int width_px = 0, height_px = 0;
  std::size_t stride_bytes = 0;
};

// A feature followed from frame to frame: the same id in every frame, once per frame.
struct TrackPoint {
  std::int64_t id = 0;
  double u_px = 0.0, v_px = 0.0;
};

enum class AddResult {
  kAccepted,
  kDuplicate,   // the stamp of the sample before
  kOutOfOrder,  // a stamp before that of the sample before
  kTooLate,     // a frame whose gyro samples were given up long ago
  kNotFinite,   // NaN or infinite
  kOutOfRange,  // no sensor says that: see the function
  kWrongSize,   // an image of another size than the options say, or a null view
  kQueueFull,   // the worker is behind: the frame is left out, as a camera that drops it would
  kStopped,     // the worker met an error: Snapshot::message says which
};
CAMGYRO_API const char* ToString(AddResult result) noexcept;

// Order of the parameters in covariances. The rotation is a right perturbation of q_gyro_cam: an
// angle about the camera's x, y, z.
enum Parameter : int {
  kFocal,  // of the rows, fy [px]
  kCx,     // principal point [px]
  kCy,
  kReadout,  // [s]
  kDelay,    // [s]
  kBiasX,    // gyro bias [rad/s]
  kBiasY,
  kBiasZ,
  kRotationX,  // of q_gyro_cam [rad]
  kRotationY,
  kRotationZ,
  kParameters
};
CAMGYRO_API const char* ParameterName(int parameter) noexcept;  // "focal_px", ...

enum class Distortion {
  kRadTan,         // k1, k2, p1, p2 as in OpenCV
  kKannalaBrandt,  // k1, k2, k3, k4 as OpenCV's fisheye, Kalibr's "equidistant"
};

struct Calibration {
  int width_px = 0, height_px = 0;
  double focal_px = 0.0;      // fy
  double aspect_ratio = 1.0;  // fx / fy
  std::array<double, 2> principal_px{};
  // Given, not estimated; all zero with kRadTan: none.
  Distortion distortion_model = Distortion::kRadTan;
  std::array<double, 4> distortion{};
  double readout_s = 0.0;
  // First to last column, beside readout_s: of pictures that are higher than wide, which were most
  // likely turned after they had been read. Zero for all others.
  double column_readout_s = 0.0;
  double delay_s = 0.0;
  Vec3 bias_gyro_rad_s{};
  std::array<double, 4> q_gyro_cam_wxyz{1.0, 0.0, 0.0, 0.0};
  std::array<double, kParameters * kParameters> covariance{};  // of noise; row after row
  // Mean squared error with what undeclared effects may add; all infinite: not known (yet).
  std::array<double, kParameters * kParameters> total_covariance{};
};

enum class Stamps {
  kAuto,      // repaired where they are clearly times of arrival
  kRecorded,  // used as they are
};

// What devices of its class usually have and nobody declares (docs/uncertainty.md).
enum class Device { kPhone, kActionCamera, kIndustrial };

// What is known before. Absent: to be found.
struct CameraGuess {
  int width_px = 0, height_px = 0;  // needed
  std::optional<double> focal_px;
  double aspect_ratio = 1.0;
  std::optional<std::array<double, 2>> principal_px;
  Distortion distortion_model = Distortion::kRadTan;
  std::array<double, 4> distortion{};
  std::optional<double> readout_s;
  std::optional<double> delay_s;  // centre of the search
  std::optional<std::array<double, 4>> q_gyro_cam_wxyz;
};

}  // namespace camgyro::api

#endif  // CAMGYRO_TYPES_H_
