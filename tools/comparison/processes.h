// Runs tasks in processes of their own, several at a time: estimators keep their memory, and a
// crash of one costs one.
#ifndef CAMGYRO_TOOLS_COMPARISON_PROCESSES_H_
#define CAMGYRO_TOOLS_COMPARISON_PROCESSES_H_

#include <functional>
#include <string>
#include <vector>

#include "core/result.h"

namespace camgyro::comparison {

// Calls work(0) ... work(count - 1), each in a forked process, at most `jobs` at a time, and
// returns what they returned, in order. done(i) is called here as tasks end. An error for a task
// that crashed. Call it while this process has no other threads.
std::vector<Result<std::string>> RunInProcesses(
    int count, int jobs, const std::function<Result<std::string>(int)>& work,
    const std::function<void(int done)>& done = nullptr);

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_PROCESSES_H_
