// The list of recordings that `camgyro batch` works through.
#ifndef CAMGYRO_TOOLS_BATCH_MANIFEST_H_
#define CAMGYRO_TOOLS_BATCH_MANIFEST_H_

#include <string>
#include <vector>

#include "core/result.h"

namespace camgyro::batch {

struct BatchRecording {
  std::string device;  // also the name of a folder: letters, digits, and - _ . but not in front
  std::string path;    // of the recording; one that is relative is relative to the manifest
  std::string folder;  // of its result, below that of all results: DEVICE/NAME
};

// A csv file with the columns `device` and `recording`, and perhaps others, which are passed over.
// Errors: kBadInput with file and line: no such columns, no rows, a device's name that is no
// folder's, a recording that is there twice.
Result<std::vector<BatchRecording>> ReadManifest(const std::string& file);

// The devices in the order of their first recordings.
std::vector<std::string> DevicesOf(const std::vector<BatchRecording>& recordings);

}  // namespace camgyro::batch

#endif  // CAMGYRO_TOOLS_BATCH_MANIFEST_H_
