// GPMF, the telemetry of GoPro cameras: nested key-length-value items in big-endian order.
// Source: github.com/gopro/gpmf-parser (the format's description in its README).
#ifndef CAMGYRO_FRONTEND_READERS_GPMF_H_
#define CAMGYRO_FRONTEND_READERS_GPMF_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "frontend/readers/bytes.h"

namespace camgyro {

// One item: key (four characters), type, `repeat` samples of `sample_size` bytes. Type 0: nested.
struct GpmfItem {
  std::string key;
  char type = 0;
  size_t sample_size = 0;
  size_t repeat = 0;
  ByteView value;

  std::string Text() const;             // type 'c', up to the first zero, blanks trimmed
  std::vector<double> Numbers() const;  // all elements of all samples; empty for other types
};

// The items of one level. Error: an item that is longer than what is left.
Result<std::vector<GpmfItem>> ParseGpmf(ByteView bytes);

// A stream of a payload (STRM) that holds samples, with what the stream declares about them.
struct GpmfStream {
  std::string key;  // of the samples: GYRO, ACCL, SHUT, ...
  size_t samples = 0, elements = 0;
  std::vector<double> values;           // samples x elements, divided by SCAL
  std::string unit;                     // SIUN, of the first element
  std::string orientation;              // ORIN, e.g. "YxZ"
  std::optional<double> stamp_us;       // STMP, of the first sample, on the camera's own clock
  std::optional<double> total_samples;  // TSMP, of this stream since its start, these included
};

struct GpmfPayload {
  std::string device_name;  // DVNM of the first device
  std::vector<GpmfStream> streams;
};

// The streams GYRO, ACCL, SHUT and SROT of a payload, of the first device that has them.
Result<GpmfPayload> ReadGpmfPayload(ByteView bytes);

// The matrix that maps stored samples to the camera's axes x, y, z. orientation: for each stored
// element its axis, lower case where the sign is reversed ("YxZ": y, -x, z were stored). Nothing
// if it is not a permutation of three axes that keeps the frame right-handed.
std::optional<Eigen::Matrix3d> AxesFromOrientation(const std::string& orientation);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_GPMF_H_
