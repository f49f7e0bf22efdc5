#include "tools/command_line.h"

#include <gmock/gmock.h>

#include "tests/paths.h"
#include "tests/tools/run_camgyro.h"
#include "tools/commands.h"
#include "tools/report/build_info.h"

namespace camgyro {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::Not;

using CommandLineTest = CamgyroTest;

TEST_F(CommandLineTest, BadUsageIsTwoAndSaysWhat) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "no command given"},
      {"calibrat x", "unknown command `calibrat`; did you mean `calibrate`?"},
      {"calibrate", "expected `camgyro calibrate RECORDING...`, got 0 arguments"},
      {"diagnose a b", "got 2 arguments"},
      {"calibrate a --residul=plane",
       "unknown flag --residul of `camgyro calibrate`; did you mean "
       "--residual?"},
      {"calibrate a --logtostderr", "unknown flag --logtostderr"},
      {"calibrate a --residual=point", "--residual=point: expected plane, determinant or transfer"},
      {"calibrate a --residual=transfer --effects=radial_distortion",
       "--effects=radial_distortion: expected none with --residual=transfer"},
      {"calibrate a --robust=perhaps", "--robust: expected true or false, got `perhaps`"},
      {"calibrate a --estimator=magic", "--estimator=magic: expected window or ekf"},
      {"calibrate a --search_s=long", "--search_s: expected a number, got `long`"},
      {"calibrate a --search_s=-1", "--search_s: expected a positive number"},
      {"calibrate a --focal_px=0", "--focal_px: expected a positive number"},
      {"calibrate a --refine=perhaps", "--refine: expected true or false, got `perhaps`"},
      {"calibrate a --noout", "unknown flag --noout"},
      {"calibrate a --out", "--out needs a value"},
      {"calibrate a --out=/dev/null/x", "cannot write into /dev/null"},
      {"track a.mp4", "needs --out=DIR"},
      {"simulate a.yaml", "--out=DIR is needed"},
      {"help no_such", "unknown command `no_such`"}};
  for (const auto& [arguments, message] : cases) {
    SCOPED_TRACE(arguments);
    const RunResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(message));
    EXPECT_THAT(result.out, IsEmpty());
  }
}

TEST_F(CommandLineTest, FlagsHaveTheUsualForms) {
  // All of these get as far as the recording, which is not there.
  for (const char* flags :
       {"--out x --quiet", "--out=x --norefine", "-search-s 3", "--refine=false",
        "--residual=transfer --robust=false", "--norobust", "--delay_ms=-3.5", "--delay_ms -3.5"}) {
    SCOPED_TRACE(flags);
    const RunResult result = Run("calibrate no_such_folder " + std::string(flags));
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr("no_such_folder"));
    EXPECT_FALSE(Exists("x"));
  }
}

TEST_F(CommandLineTest, HelpListsEveryCommandAndItsFlags) {
  const RunResult all = Run("help");
  EXPECT_EQ(all.exit_code, 0);
  EXPECT_EQ(Run("--help").out, all.out);
  for (const Command& command : AllCommands()) {
    SCOPED_TRACE(command.name);
    EXPECT_THAT(all.out, HasSubstr("camgyro " + command.name));
    const RunResult one = Run("help " + command.name);
    EXPECT_EQ(one.exit_code, 0);
    EXPECT_EQ(Run(command.name + " --help").out, one.out);
    for (const std::string& flag : command.flags) EXPECT_THAT(one.out, HasSubstr(flag));
    EXPECT_THAT(one.out, Not(HasSubstr("logtostderr")));
  }
}

TEST_F(CommandLineTest, VersionSaysWhichBuildThisIs) {
  const RunResult result = Run("--version");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(kVersion, MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+"));
  EXPECT_EQ(result.out, std::string("camgyro ") + kVersion + " (commit " + kGitCommit + "; " +
                            kPlatform + ")\n");
}

// Every command but help has a page, which quotes its help word by word.
TEST_F(CommandLineTest, DocumentationQuotesTheHelp) {
  for (const Command& command : AllCommands()) {
    if (command.name == "help") continue;
    SCOPED_TRACE(command.name);
    std::stringstream help(Run("help " + command.name).out);
    std::string quoted, line;
    while (std::getline(help, line)) quoted += (line.empty() ? "" : "    " + line) + "\n";
    EXPECT_THAT(ReadFile(SourceDir() + "/docs/" + command.name + ".md"), HasSubstr(quoted));
  }
}

}  // namespace
}  // namespace camgyro
