// What every command does with a recording first: read it and take the user's guesses.
#ifndef CAMGYRO_TOOLS_RECORDING_INPUT_H_
#define CAMGYRO_TOOLS_RECORDING_INPUT_H_

#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"
#include "frontend/readers/read_recording.h"

namespace camgyro {

// Names of the flags that OpenRecording obeys: guesses that win over the recording's own, what is
// to be done about stamps and faults of the data, and the threads to work in.
std::vector<std::string> InputFlags();

// --stamps and --strict, for commands that read a recording without the guesses.
Result<ReadOptions> ReadOptionsFromFlags();

Result<Recording> OpenRecording(const std::string& path);

// With --strict, an error if the recording has got a fault mended; after tracking, which sees
// pictures that repeat.
Status CheckStrict(const Recording& recording);

// One line about what the recording holds.
std::string DescribeRecording(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_RECORDING_INPUT_H_
