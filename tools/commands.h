// What `camgyro` can do: one command per file of this folder, NAME_command.cc.
#ifndef CAMGYRO_TOOLS_COMMANDS_H_
#define CAMGYRO_TOOLS_COMMANDS_H_

#include <string>
#include <vector>

#include "tools/command_line.h"

namespace camgyro {

// One row per command, in the order of the help: a row X is the command of XCommand() in
// x_command.cc.
#define CAMGYRO_COMMANDS(ROW) \
  ROW(Calibrate)              \
  ROW(Diagnose)               \
  ROW(Delay)                  \
  ROW(Track)                  \
  ROW(Simulate)               \
  ROW(Compare)                \
  ROW(Export)                 \
  ROW(Stabilize)              \
  ROW(Rectify)                \
  ROW(Odometry)               \
  ROW(Batch)                  \
  ROW(Help)

#define CAMGYRO_DECLARE(name) Command name##Command();
CAMGYRO_COMMANDS(CAMGYRO_DECLARE)
#undef CAMGYRO_DECLARE

std::vector<Command> AllCommands();

// The command of this name. Errors: kBadUsage, with the nearest name.
Result<Command> FindCommand(const std::string& name);

// The help of the program.
std::string ProgramHelp();

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_COMMANDS_H_
