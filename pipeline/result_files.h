// The files of a result: calibration.yaml, trace.csv, delay.csv (docs/result_format.md).
#ifndef CAMGYRO_PIPELINE_RESULT_FILES_H_
#define CAMGYRO_PIPELINE_RESULT_FILES_H_

#include <functional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "core/calibration.h"
#include "core/recording.h"
#include "core/result.h"
#include "estimator/calibrate.h"

namespace camgyro {

// Text files that appear together or not at all: all are written under temporary names in their
// folder first, then renamed.
class FileSet {
 public:
  explicit FileSet(std::string folder) : folder_(std::move(folder)) {}

  // Is the folder there, or can it be made? Asked before hours of work, not after them.
  Status CheckWritable() const;
  void Add(const std::string& name, std::string text) {
    Add(name, [text = std::move(text)](std::ostream* out) { *out << text; });
  }
  // The same for a text that is too long to be held: Write() calls `write`.
  void Add(const std::string& name, std::function<void(std::ostream*)> write) {
    files_.emplace_back(name, std::move(write));
  }
  // Makes the folder (names may hold folders too). On failure nothing new is left behind.
  Status Write() const;

  const std::string& folder() const { return folder_; }

 private:
  std::string folder_;
  std::vector<std::pair<std::string, std::function<void(std::ostream*)>>> files_;
};

// attitudes: no pixels were used; noise and residuals are then in rad, under the keys noise_rad and
// rms_rad, and what needs pixels is .nan and among the unobservable.
std::string CalibrationYaml(const CalibrationReport& report, bool attitudes);

// One row per solved window, at the stamp of its last frame [camera clock]; only the header without
// an online pass. The sigmas of the rotation are three angles about the camera's axes [rad].
std::string TraceCsv(const std::vector<WindowUpdate>& trace);

// The frames' own times [ns, camera clock]: recorded stamp, repaired stamp, and its sigma. A
// repaired stamp + delay of row 0 is on the gyro's clock.
std::string FrameTimesCsv(const Recording& recording, const std::vector<FrameOffset>& frame_times);

// The delay search's curve: fraction of the gyro's power that is not explained at each delay.
std::string DelayCsv(const std::vector<DelayResidual>& curve);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_RESULT_FILES_H_
