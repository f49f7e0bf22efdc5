#include "tools/batch/outcome.h"

#include <fcntl.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "pipeline/result_files.h"

namespace camgyro::batch {
namespace {

namespace fs = std::filesystem;

constexpr char kFile[] = "outcome.yaml";

// Of a run that was stopped, or of another command. The folder may be the user's: only files that
// this program makes go.
void DeleteEarlier(const fs::path& folder) {
  std::error_code ignored;
  for (const char* name : {kFile, "calibration.yaml", "report.html", "trace.csv", "delay.csv",
                           "frame_times.csv", "log.txt"}) {
    fs::remove(folder / name, ignored);
  }
}

// Sends what is printed to a file.
bool PrintTo(const std::string& file) {
  const int log = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (log < 0) return false;
  std::fflush(nullptr);
  const bool good = dup2(log, STDOUT_FILENO) >= 0 && dup2(log, STDERR_FILENO) >= 0;
  close(log);
  return good;
}

}  // namespace

std::optional<Outcome> ReadOutcome(const std::string& folder) {
  try {
    const YAML::Node yaml = YAML::LoadFile((fs::path(folder) / kFile).string());
    return Outcome{yaml["command"].as<std::string>(), yaml["exit_code"].as<int>(),
                   yaml["message"].as<std::string>(), yaml["seconds"].as<double>()};
  } catch (const YAML::Exception&) {
    return std::nullopt;
  }
}

Result<Outcome> RunLogged(const std::string& folder, const std::string& command,
                          const std::function<Status()>& work) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return BadUsage("--out: cannot write " + folder + ": " + error.message());
  DeleteEarlier(folder);
  if (!PrintTo((fs::path(folder) / "log.txt").string())) {
    return BadUsage("--out: cannot write " + folder + "/log.txt");
  }
  const auto begin = std::chrono::steady_clock::now();
  const Status status = work();
  Outcome outcome;
  outcome.command = command;
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!status) {
    outcome.exit_code = static_cast<int>(status.error().kind);
    outcome.message = status.error().message;
    std::printf("camgyro: %s\n", outcome.message.c_str());
  }
  std::fflush(nullptr);
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "command" << YAML::Value << command << YAML::Key
      << "exit_code" << YAML::Value << outcome.exit_code << YAML::Key << "message" << YAML::Value
      << YAML::DoubleQuoted << outcome.message << YAML::Key << "seconds" << YAML::Value
      << outcome.seconds << YAML::EndMap;
  FileSet files(folder);
  files.Add(kFile, std::string(out.c_str()) + "\n");
  if (Status written = files.Write(); !written) return tl::unexpected(written.error());
  return outcome;
}

}  // namespace camgyro::batch
