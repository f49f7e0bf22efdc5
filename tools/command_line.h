// The command line: commands, their flags (gflags), and the help that is made from both.
#ifndef CAMGYRO_TOOLS_COMMAND_LINE_H_
#define CAMGYRO_TOOLS_COMMAND_LINE_H_

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"

namespace camgyro {

struct Command {
  std::string name;
  std::string arguments;  // as the usage line shows them, one word per argument
  std::string summary;    // one line
  // Names of its gflags, in the order of the help. Their descriptions are written where they are
  // defined, and nowhere else.
  std::vector<std::string> flags;
  std::function<Status(const std::vector<std::string>& arguments)> run;
};

struct ParsedCommandLine {
  std::vector<std::string> arguments;  // without flags
  bool wants_help = false;             // --help or -h
};

// Sets the command's flags from what follows it: --name=value, --name value, --name and --noname
// for switches; '-' and '_' in names are the same. Does not use gflags' own parser, which exits by
// itself and accepts the flags of every library. Errors: kBadUsage.
Result<ParsedCommandLine> ParseCommandLine(const Command& command,
                                           const std::vector<std::string>& words);

// The help of one command: usage, summary, flags with their defaults.
std::string CommandHelp(const Command& command);

// True if the user gave this flag.
bool FlagGiven(const char* name);

// How the user called this command, with the flags that were given; and all of its flags with their
// values.
std::string CommandLineOf(const Command& command, const std::vector<std::string>& arguments);
std::vector<std::pair<std::string, std::string>> FlagValues(const Command& command);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_COMMAND_LINE_H_
