// camgyro COMMAND: finds the command, and turns its result into a message and an exit code.
#include <glog/logging.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "tools/commands.h"
#include "tools/report/build_info.h"

namespace camgyro {
namespace {

Status Run(const std::vector<std::string>& words) {
  if (words.empty()) {
    std::fputs(ProgramHelp().c_str(), stderr);
    return BadUsage("no command given");
  }
  if (words[0] == "--help" || words[0] == "-h") return HelpCommand().run({});
  if (words[0] == "--version") {
    std::printf("camgyro %s (commit %s; %s)\n", kVersion, kGitCommit, kPlatform);
    return {};
  }
  const Result<Command> command = FindCommand(words[0]);
  if (!command) return tl::unexpected(command.error());
  const Result<ParsedCommandLine> parsed =
      ParseCommandLine(*command, {words.begin() + 1, words.end()});
  if (!parsed) return tl::unexpected(parsed.error());
  if (parsed->wants_help) return HelpCommand().run({command->name});
  return command->run(parsed->arguments);
}

// Says what is left of a run that is interrupted, and ends as if nobody had listened. Only
// functions that may be called in the middle of any other.
extern "C" void SayWhatIsKept(int signal) {
  constexpr char kSaid[] =
      "\ncamgyro: interrupted. What is not written yet is lost, what is written is whole. camgyro "
      "track keeps the tracks of pictures, so that other commands begin with them, and camgyro "
      "batch goes on where it was.\n";
  const ssize_t written = write(STDERR_FILENO, kSaid, sizeof(kSaid) - 1);
  static_cast<void>(written);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace
}  // namespace camgyro

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = google::GLOG_FATAL;  // what Ceres warns about ends up in the results
  std::signal(SIGINT, camgyro::SayWhatIsKept);
  const camgyro::Status status = camgyro::Run({argv + 1, argv + argc});
  if (status) return EXIT_SUCCESS;
  std::fprintf(
      stderr, "camgyro: %s%s\n",
      status.error().kind == camgyro::ErrorKind::kCannotEstimate ? "cannot estimate: " : "",
      status.error().message.c_str());
  return static_cast<int>(status.error().kind);
}
