#include <cstdio>

#include "tools/commands.h"

namespace camgyro {
namespace {

constexpr size_t kUsageWidth = 40;  // the longest is simulate's

}  // namespace

std::vector<Command> AllCommands() {
#define CAMGYRO_ROW(name) name##Command(),
  return {CAMGYRO_COMMANDS(CAMGYRO_ROW)};
#undef CAMGYRO_ROW
}

Result<Command> FindCommand(const std::string& name) {
  std::vector<std::string> names;
  for (Command& command : AllCommands()) {
    if (command.name == name) return std::move(command);
    names.push_back(command.name);
  }
  const std::string nearest = NearestName(name, names);
  return BadUsage("unknown command `" + name + "`" +
                  (nearest.empty() ? "" : "; did you mean `" + nearest + "`?") +
                  " (see `camgyro help`)");
}

std::string ProgramHelp() {
  std::string help =
      "camgyro: calibrates and synchronises a rolling-shutter camera with a gyroscope\n\n";
  for (const Command& command : AllCommands()) {
    const std::string usage = command.name + " " + command.arguments;
    help += "  camgyro " + usage + std::string(kUsageWidth - usage.size(), ' ');
    help += command.summary.substr(0, command.summary.find(':')) + "\n";
  }
  help +=
      "\n`camgyro help COMMAND` lists its flags. A recording is a folder, ours or of an app for\n"
      "phones, a GoPro MP4, a .gcsv or a ROS bag (docs/recording_format.md). Exit codes: 0 done;\n"
      "2 bad usage; 3 bad input; 4 could not estimate.\n";
  return help;
}

Command HelpCommand() {
  Command command;
  command.name = "help";
  command.arguments = "[COMMAND]";
  command.summary = "lists commands, or one command's flags";
  command.run = [](const std::vector<std::string>& arguments) -> Status {
    std::string help = ProgramHelp();
    if (!arguments.empty()) {
      const Result<Command> found = FindCommand(arguments[0]);
      if (!found) return tl::unexpected(found.error());
      help = CommandHelp(*found);
    }
    std::fputs(help.c_str(), stdout);
    return {};
  };
  return command;
}

}  // namespace camgyro
