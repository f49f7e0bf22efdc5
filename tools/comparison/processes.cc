#include "tools/comparison/processes.h"

#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <map>

namespace camgyro::comparison {
namespace {

bool WriteAll(int file, const std::string& bytes) {
  for (size_t at = 0; at < bytes.size();) {
    const ssize_t written = write(file, bytes.data() + at, bytes.size() - at);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    at += static_cast<size_t>(written);
  }
  return true;
}

struct Child {
  pid_t id = 0;
  int task = 0;
  std::string bytes;  // first one: the kind of the result, 0 for success
};

// The task in a process of its own; the file its answer comes from, or -1.
int Start(int task, const std::function<Result<std::string>(int)>& work, pid_t* id) {
  int ends[2];
  if (pipe(ends) != 0) return -1;
  std::fflush(nullptr);  // or the child would print it again
  *id = fork();
  if (*id < 0) {
    close(ends[0]);
    close(ends[1]);
    return -1;
  }
  if (*id == 0) {
    close(ends[0]);
    const Result<std::string> result = work(task);
    const bool sent =
        result ? WriteAll(ends[1], std::string(1, '\0') + *result)
               : WriteAll(ends[1], std::string(1, static_cast<char>(result.error().kind)) +
                                       result.error().message);
    _exit(sent ? 0 : 1);
  }
  close(ends[1]);
  return ends[0];
}

Result<std::string> Finish(const Child& child) {
  int status = 0;
  while (waitpid(child.id, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || child.bytes.empty()) {
    return CannotEstimate(WIFSIGNALED(status)
                              ? std::string("the process ended by ") + strsignal(WTERMSIG(status))
                              : "the process ended without an answer");
  }
  if (child.bytes[0] == '\0') return child.bytes.substr(1);
  return tl::unexpected(Error{static_cast<ErrorKind>(child.bytes[0]), child.bytes.substr(1)});
}

}  // namespace

std::vector<Result<std::string>> RunInProcesses(int count, int jobs,
                                                const std::function<Result<std::string>(int)>& work,
                                                const std::function<void(int done)>& done) {
  std::vector<Result<std::string>> results(static_cast<size_t>(count), std::string());
  std::map<int, Child> running;  // by the file their answer comes from
  int next = 0, finished = 0;
  while (finished < count) {
    while (next < count && static_cast<int>(running.size()) < std::max(1, jobs)) {
      Child child;
      child.task = next++;
      const int file = Start(child.task, work, &child.id);
      if (file < 0) {
        results[static_cast<size_t>(child.task)] =
            CannotEstimate(std::string("no process could be started: ") + std::strerror(errno));
        ++finished;
        continue;
      }
      running.emplace(file, std::move(child));
    }
    std::vector<pollfd> files;
    for (const auto& entry : running) files.push_back({entry.first, POLLIN, 0});
    if (files.empty()) continue;
    if (poll(files.data(), files.size(), -1) < 0 && errno != EINTR) break;
    for (const pollfd& file : files) {
      if (file.revents == 0) continue;
      Child& child = running.at(file.fd);
      char buffer[1 << 16];
      const ssize_t got = read(file.fd, buffer, sizeof buffer);
      if (got < 0 && errno == EINTR) continue;
      if (got > 0) {
        child.bytes.append(buffer, static_cast<size_t>(got));
        continue;
      }
      close(file.fd);
      results[static_cast<size_t>(child.task)] = Finish(child);
      running.erase(file.fd);
      ++finished;
      if (done) done(finished);
    }
  }
  return results;
}

}  // namespace camgyro::comparison
