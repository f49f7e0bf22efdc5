#include "tools/command_line.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "core/nearest_name.h"

namespace camgyro {
namespace {

constexpr size_t kHelpWidth = 96;
constexpr size_t kFlagColumn = 30;  // where the descriptions start

std::string UnknownFlag(const Command& command, const std::string& name) {
  const std::string nearest = NearestName(name, command.flags);
  return "unknown flag --" + name + " of `camgyro " + command.name + "`" +
         (nearest.empty() ? "" : "; did you mean --" + nearest + "?") + " (see `camgyro help " +
         command.name + "`)";
}

std::string TypeInWords(const std::string& type) {
  if (type == "bool") return "true or false";
  if (type == "double") return "a number";
  if (type == "string") return "text";
  return "a whole number";
}

std::string Wrap(const std::string& text, size_t indent) {
  std::istringstream words(text);
  std::string wrapped, word;
  size_t column = indent;
  while (words >> word) {
    if (column > indent && column + 1 + word.size() > kHelpWidth) {
      wrapped += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (column > indent) {
      wrapped += " ";
      ++column;
    }
    wrapped += word;
    column += word.size();
  }
  return wrapped;
}

}  // namespace

std::string CommandLineOf(const Command& command, const std::vector<std::string>& arguments) {
  std::string line = "camgyro " + command.name;
  const auto add = [&](const std::string& word) {
    // As a shell wants it.
    const bool plain = word.find_first_of(" \t\n'\"\\$&|;<>()*?[]#~`!{}") == std::string::npos;
    std::string quoted = word;
    for (size_t i = 0; (i = quoted.find('\'', i)) != std::string::npos; i += 4) {
      quoted.replace(i, 1, "'\\''");
    }
    line += plain ? " " + word : " '" + quoted + "'";
  };
  for (const std::string& argument : arguments) add(argument);
  for (const auto& [name, value] : FlagValues(command)) {
    if (FlagGiven(name.c_str())) add("--" + name + "=" + value);
  }
  return line;
}

std::vector<std::pair<std::string, std::string>> FlagValues(const Command& command) {
  std::vector<std::pair<std::string, std::string>> values;
  for (const std::string& name : command.flags) {
    values.emplace_back(name, gflags::GetCommandLineFlagInfoOrDie(name.c_str()).current_value);
  }
  return values;
}

Result<ParsedCommandLine> ParseCommandLine(const Command& command,
                                           const std::vector<std::string>& words) {
  ParsedCommandLine parsed;
  const auto is_flag = [&](const std::string& name) {
    return std::find(command.flags.begin(), command.flags.end(), name) != command.flags.end();
  };
  for (size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--help" || word == "-h") {
      parsed.wants_help = true;
      continue;
    }
    if (word.size() < 2 || word[0] != '-') {
      parsed.arguments.push_back(word);
      continue;
    }
    const size_t begin = word.find_first_not_of('-'), equals = word.find('=');
    if (begin == std::string::npos) return BadUsage("`" + word + "` is no flag");
    std::string name = word.substr(begin, equals == std::string::npos ? equals : equals - begin);
    std::replace(name.begin(), name.end(), '-', '_');
    std::string value = equals == std::string::npos ? "" : word.substr(equals + 1);
    gflags::CommandLineFlagInfo info;
    if (is_flag(name)) {
      info = gflags::GetCommandLineFlagInfoOrDie(name.c_str());
      if (equals == std::string::npos && info.type == "bool") {
        value = "true";
      } else if (equals == std::string::npos) {
        if (i + 1 == words.size()) return BadUsage("--" + name + " needs a value");
        value = words[++i];
      }
    } else if (name.rfind("no", 0) == 0 && is_flag(name.substr(2)) && equals == std::string::npos) {
      name = name.substr(2);
      info = gflags::GetCommandLineFlagInfoOrDie(name.c_str());
      if (info.type != "bool") return BadUsage(UnknownFlag(command, "no" + name));
      value = "false";
    } else {
      return BadUsage(UnknownFlag(command, name));
    }
    if (gflags::SetCommandLineOption(name.c_str(), value.c_str()).empty()) {
      return BadUsage("--" + name + ": expected " + TypeInWords(info.type) + ", got `" + value +
                      "`");
    }
  }
  const auto expected =
      static_cast<size_t>(command.arguments.empty() ? 0
                                                    : 1 + std::count(command.arguments.begin(),
                                                                     command.arguments.end(), ' '));
  const bool open_end = command.arguments.find("...") != std::string::npos;
  const size_t least = command.arguments.find('[') == std::string::npos ? expected : expected - 1;
  if (!parsed.wants_help &&
      (parsed.arguments.size() < least || (parsed.arguments.size() > expected && !open_end))) {
    return BadUsage("expected `camgyro " + command.name + " " + command.arguments + "`, got " +
                    std::to_string(parsed.arguments.size()) + " arguments (see `camgyro help " +
                    command.name + "`)");
  }
  return parsed;
}

std::string CommandHelp(const Command& command) {
  std::string help = "camgyro " + command.name + " " + command.arguments +
                     (command.flags.empty() ? "" : " [--flags]") + "\n\n" +
                     Wrap(command.summary, 0) + "\n";
  if (!command.flags.empty()) help += "\n";
  for (const std::string& name : command.flags) {
    const auto info = gflags::GetCommandLineFlagInfoOrDie(name.c_str());
    std::string left = "  --" + name;
    if (info.type == "bool") {
      left = info.default_value == "true" ? "  --no" + name : left;
    } else {
      const bool none = info.default_value.empty() || info.default_value == "0";
      left += "=" + (none ? (info.type == "string" ? "..." : "NUMBER") : info.default_value);
    }
    left += left.size() + 2 > kFlagColumn ? "\n" + std::string(kFlagColumn, ' ')
                                          : std::string(kFlagColumn - left.size(), ' ');
    help += left + Wrap(info.description, kFlagColumn) + "\n";
  }
  return help;
}

bool FlagGiven(const char* name) { return !gflags::GetCommandLineFlagInfoOrDie(name).is_default; }

}  // namespace camgyro
