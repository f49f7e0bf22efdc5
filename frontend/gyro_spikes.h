// Single samples of a gyro that are no rotation.
#ifndef CAMGYRO_FRONTEND_GYRO_SPIKES_H_
#define CAMGYRO_FRONTEND_GYRO_SPIKES_H_

#include <cstddef>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Indices, ascending, of samples that jump away from those on both sides and back: read with a bit
// wrong, or as zero while the device turns. About some axis, such a sample is away from the middle
// of its neighbours by more than kSpikeScales of what samples around it usually are, while they
// agree with each other, and nothing goes on beyond them: a movement or a knock does. Samples in
// time order.
std::vector<size_t> FindSpikes(const std::vector<GyroSample>& gyro);

// Puts the line between the neighbours in the place of spikes, and records them as the fault
// "gyro_spikes". Nothing is done where they are in fewer than kLeastPlaces seconds of the
// recording: a device that is knocked shakes like that.
void MendSpikes(Recording* recording);

// Of 24 measured recordings one has such a sample (MendSpikes.MeasuredRecordingsHaveNone prints how
// many).
constexpr double kSpikeScales = 20.0;
constexpr size_t kLeastPlaces = 5;

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_GYRO_SPIKES_H_
