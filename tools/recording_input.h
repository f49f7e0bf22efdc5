// What every command does with a recording first: read it and take the user's guesses.
#ifndef CAMGYRO_TOOLS_RECORDING_INPUT_H_
#define CAMGYRO_TOOLS_RECORDING_INPUT_H_

#include <string>
#include <vector>

#include "core/recording.h"
#include "core/result.h"

namespace camgyro {

// Names of the flags that OpenRecording obeys: guesses that win over the recording's own.
std::vector<std::string> GuessFlags();

Result<Recording> OpenRecording(const std::string& path);

// One line about what the recording holds.
std::string DescribeRecording(const Recording& recording);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_RECORDING_INPUT_H_
