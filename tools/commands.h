// What `camgyro` can do: one command per file of this folder, NAME_command.cc.
#ifndef CAMGYRO_TOOLS_COMMANDS_H_
#define CAMGYRO_TOOLS_COMMANDS_H_

#include <string>
#include <vector>

#include "tools/command_line.h"

namespace camgyro {

Command CalibrateCommand();
Command DiagnoseCommand();
Command CompareCommand();
Command DelayCommand();
Command TrackCommand();
Command SimulateCommand();
Command ExportCommand();
Command StabilizeCommand();
Command HelpCommand();

// All of them, in the order of the help.
std::vector<Command> AllCommands();

// The command of this name. Errors: kBadUsage, with the nearest name.
Result<Command> FindCommand(const std::string& name);

// The help of the program.
std::string ProgramHelp();

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_COMMANDS_H_
