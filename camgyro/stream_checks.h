// What samples and frames of a producer have to be, before they are copied and queued. Each check
// answers with what is wrong, or with nothing. The limits are far beyond any sensor: what they keep
// out are wrong units and memory that is not a sample.
#ifndef CAMGYRO_STREAM_CHECKS_H_
#define CAMGYRO_STREAM_CHECKS_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "camgyro/types.h"
#include "core/recording.h"

namespace camgyro::api {

// kNotFinite, or kOutOfRange: |stamp| from 4e18 ns on, beyond 200 rad/s or 2000 m/s^2.
std::optional<AddResult> CheckSample(const GyroSample& sample);
std::optional<AddResult> CheckSample(const AccelSample& sample);

// Against the stream's last stamp, if there is one: kDuplicate or kOutOfOrder.
std::optional<AddResult> CheckOrder(std::int64_t stamp_ns,
                                    const std::optional<std::int64_t>& last_ns);

// kOutOfRange of the stamp; kWrongSize for a view that is not of the camera's size.
std::optional<AddResult> CheckImage(std::int64_t stamp_ns, const ImageView& view,
                                    const camgyro::CameraGuess& camera);

// Copies the points of a frame, in the order of their ids. kNotFinite, or kOutOfRange: the stamp,
// more than 5000 points, a point further outside of the picture than its size, an id twice.
std::optional<AddResult> TakePoints(std::int64_t stamp_ns, const TrackPoint* points,
                                    std::size_t count, const camgyro::CameraGuess& camera,
                                    std::vector<TrackedPoint>* taken);

}  // namespace camgyro::api

#endif  // CAMGYRO_STREAM_CHECKS_H_
