// Puts a recording's gyro on its sampling clock, where its stamps are arrival times.
#ifndef CAMGYRO_FRONTEND_READERS_REPAIR_STAMPS_H_
#define CAMGYRO_FRONTEND_READERS_REPAIR_STAMPS_H_

#include "core/recording.h"

namespace camgyro {

enum class StampsMode {
  kAuto,      // where the evidence is clear, and the rates do not speak against it
  kRecorded,  // never
  kRepaired,  // wherever a clock is found, also behind clean stamps
};

// Sets gyro_stamps and camera_stamps of the recording, and with them the stamps of gyro and
// accelerometer, strictly increasing afterwards; notes what was found. Frames keep their stamps:
// how late each of them is, their pictures tell better. Where no steady clock explains frame
// stamps, as times of arrival or at all, camera_stamps->repaired has the fit begin with
// frame_stamp_jitter (not if kRecorded): a camera whose intervals vary turns out to have a spread
// of nothing.
void RepairStamps(StampsMode mode, Recording* recording);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_REPAIR_STAMPS_H_
