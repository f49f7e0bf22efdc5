#include <algorithm>
#include <cstdio>

#include "core/nearest_name.h"
#include "frontend/readers/formats.h"
#include "tools/commands.h"

namespace camgyro {
namespace {

constexpr size_t kUsageWidth = 40;   // the longest is simulate's
constexpr size_t kFormatWidth = 21;  // of their names

std::string PadRight(std::string text, size_t width) {
  text.resize(std::max(width, text.size() + 1), ' ');
  return text;
}

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
    help += "  camgyro " + PadRight(usage, kUsageWidth);
    help += command.summary.substr(0, command.summary.find(':')) + "\n";
  }
  help += "\nA recording is one of these (docs/recording_format.md):\n";
  for (const RecordingFormat& format : RecordingFormats()) {
    help += "  " + PadRight(format.name, kFormatWidth) + format.looks_like;
    help += format.read == nullptr ? " (not in this build)\n" : "\n";
  }
  help +=
      "\n`camgyro help COMMAND` lists its flags. Exit codes: 0 done; 2 bad usage; 3 bad input;\n"
      "4 could not estimate, or nothing (or not what --require names) was determined.\n";
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
