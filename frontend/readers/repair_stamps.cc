#include "frontend/readers/repair_stamps.h"

#include <cstdint>
#include <vector>

#include "frontend/readers/recording_checks.h"
#include "frontend/stamp_clock.h"

namespace camgyro {
namespace {

// The rates speak against a clock if they are foretold worse with it by more than chance, which is
// 1 to 2 % in a minute of samples.
constexpr double kWorseForetold = 1.05;

template <typename Stamped>
void SetStamps(const std::vector<int64_t>& stamps_ns, std::vector<Stamped>* items) {
  for (size_t i = 0; i < items->size(); ++i) (*items)[i].stamp_ns = stamps_ns[i];
}

}  // namespace

void RepairStamps(StampsMode mode, Recording* recording) {
  const std::vector<int64_t> recorded_ns = StampsOf(recording->gyro);
  const bool forced = mode == StampsMode::kRepaired;
  StampClock clock = FindStampClock(recorded_ns, forced);
  StampReport& report = clock.report;
  bool repair = mode != StampsMode::kRecorded && !clock.sampled_ns.empty();
  if (repair && !forced &&
      InterpolationError(recording->gyro, clock.sampled_ns) >
          kWorseForetold * InterpolationError(recording->gyro, recorded_ns)) {
    report.kind = StampKind::kIrregular;
    repair = false;
  }
  report.repaired = repair;
  if (repair) {
    if (StampsOf(recording->accel) == recorded_ns) {
      SetStamps(clock.sampled_ns, &recording->accel);
    } else if (const StampClock accel = FindStampClock(StampsOf(recording->accel), forced);
               !accel.sampled_ns.empty()) {
      SetStamps(accel.sampled_ns, &recording->accel);
    }
    SetStamps(clock.sampled_ns, &recording->gyro);
  }
  const int equal = DropRepeatedStamps(recording);  // none after a repair
  if (equal > 0) {
    AddFault("stamps_repeat", equal,
             std::to_string(equal) +
                 " gyro samples that have the stamp of the one before them are "
                 "left out",
             recording);
  }
  if (repair || report.kind != StampKind::kMeasured) {
    recording->notes.push_back("gyro stamps are " + DescribeStamps(report));
  }
  recording->gyro_stamps = report;

  recording->camera_stamps = FindStampClock(StampsOf(recording->frames)).report;
  StampReport& frames = *recording->camera_stamps;
  const bool own_times = mode != StampsMode::kRecorded && frames.kind != StampKind::kMeasured;
  if (frames.kind != StampKind::kMeasured) {
    recording->notes.push_back("frame stamps are " + DescribeStamps(frames) +
                               (own_times ? "; each frame has a time of its own in the fit" : ""));
  }
  frames.repaired = own_times;
}

}  // namespace camgyro
