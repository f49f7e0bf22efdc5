#include "pipeline/frame_times_file.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>

#include "core/time.h"
#include "frontend/readers/csv_reader.h"

namespace camgyro {
namespace {

// By recorded stamps. How many frames it changes.
size_t ReplaceStamps(const std::map<int64_t, int64_t>& repaired, Recording* recording) {
  size_t changed = 0;
  for (size_t i = 0; i < recording->frames.size(); ++i) {
    int64_t& stamp_ns = recording->frames[i].stamp_ns;
    const auto found = repaired.find(stamp_ns);
    if (found != repaired.end()) {
      stamp_ns = found->second;
      ++changed;
    }
    if (i > 0) stamp_ns = std::max(stamp_ns, recording->frames[i - 1].stamp_ns + 1);
  }
  return changed;
}

}  // namespace

void ApplyFrameTimes(const std::vector<FrameOffset>& frame_times, Recording* recording) {
  std::map<int64_t, int64_t> repaired;
  for (const FrameOffset& frame : frame_times) {
    const int64_t stamp_ns = recording->gyro.front().stamp_ns + frame.frame;
    repaired[stamp_ns] = StampAt(stamp_ns, frame.offset_s);
  }
  ReplaceStamps(repaired, recording);
}

Status ApplyFrameTimes(const std::string& calibration_path, Recording* recording) {
  const std::filesystem::path file =
      std::filesystem::path(calibration_path).replace_filename("frame_times.csv");
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return {};
  CsvReader csv(file.string(), {"stamp_ns", "repaired_stamp_ns", "sigma_ns"}, {3});
  std::map<int64_t, int64_t> repaired;
  while (csv.NextRow()) repaired[csv.Stamp(0)] = csv.Stamp(1);
  if (!csv.status()) return tl::unexpected(csv.status().error());

  const size_t changed = ReplaceStamps(repaired, recording);
  if (changed > 0) {
    recording->notes.push_back(std::to_string(changed) + " of " +
                               std::to_string(recording->frames.size()) +
                               " frames have the times of " + file.string());
  }
  return {};
}

}  // namespace camgyro
