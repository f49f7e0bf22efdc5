// The tables of a recording in the EuRoC layout (docs/recording_format.md), as text.
#ifndef CAMGYRO_CORE_RECORDING_CSV_H_
#define CAMGYRO_CORE_RECORDING_CSV_H_

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// cam0/data.csv: stamps [ns], names of the image files without their folders, exposures [s], empty
// where a frame has none.
std::string FramesCsv(const std::vector<Frame>& frames);

// cam0/tracks.csv: one row per point, pixels with so many decimals. Its rows take more memory than
// the tracks, a gigabyte for an hour, so that they come frame by frame, after the header.
std::string TracksCsvHeader();
std::string TracksCsvRows(int64_t stamp_ns, const std::vector<TrackedPoint>& tracks, int decimals);
void WriteTracksCsv(const Recording& recording, int decimals, std::ostream* out);

// cam0/lens_shift.csv: stamps [ns], shift of the picture by the lens [px].
std::string LensShiftCsv(const std::vector<LensSample>& samples);

// imu0/data.csv: rates [rad/s] and, if the recording has an accelerometer, specific forces [m/s^2],
// all at the gyro's stamps: between its own samples the specific force is interpolated, and gyro
// samples before the first or after the last of them are left out.
std::string ImuCsv(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_RECORDING_CSV_H_
