// What became of a recording of a batch: kept in its folder, so that a batch that is called again
// goes on where it stopped.
#ifndef CAMGYRO_TOOLS_BATCH_OUTCOME_H_
#define CAMGYRO_TOOLS_BATCH_OUTCOME_H_

#include <functional>
#include <optional>
#include <string>

#include "core/result.h"

namespace camgyro::batch {

struct Outcome {
  std::string command;  // that made it, with its flags, and the program's version: a result of
                        // another one does not count as done
  int exit_code = 0;    // of that command
  std::string message;  // the complaint, if there was one
  double seconds = 0.0;
};

// outcome.yaml of a result's folder; nothing where there is none, or none that is whole.
std::optional<Outcome> ReadOutcome(const std::string& folder);

// Runs `work` in this process with the terminal's output in FOLDER/log.txt, and writes outcome.yaml
// last, after all that `work` has written: where it is, the result is whole. What an earlier run
// has left is deleted first. Errors: kBadUsage, the folder cannot be written.
Result<Outcome> RunLogged(const std::string& folder, const std::string& command,
                          const std::function<Status()>& work);

}  // namespace camgyro::batch

#endif  // CAMGYRO_TOOLS_BATCH_OUTCOME_H_
