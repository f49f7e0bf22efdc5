// Runs the built binary as a user would, in a folder of the test's own.
#ifndef CAMGYRO_TESTS_TOOLS_RUN_CAMGYRO_H_
#define CAMGYRO_TESTS_TOOLS_RUN_CAMGYRO_H_

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "simulation/scenario.h"
#include "simulation/simulate.h"
#include "simulation/write_recording.h"
#include "tests/paths.h"

namespace camgyro {

struct RunResult {
  int exit_code = -1;  // -1: killed by a signal
  std::string out, err;
};

class CamgyroTest : public testing::Test {
 protected:
  void SetUp() override {
    // One folder per test: ctest runs them at the same time.
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    root_ = std::filesystem::path(testing::TempDir()) /
            (std::string("camgyro_tools_") + test->test_suite_name() + test->name());
    std::filesystem::remove_all(root_);
    std::filesystem::create_directories(root_);
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  std::string Path(const std::string& name) const { return (root_ / name).string(); }
  bool Exists(const std::string& name) const { return std::filesystem::exists(root_ / name); }

  static std::string ReadFile(const std::string& path) {
    std::stringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }

  RunResult Run(const std::string& arguments) const {
    const std::string out = Path("stdout.txt"), err = Path("stderr.txt");
    const int status = std::system(("cd " + root_.string() + " && " + BinaryDir() +
                                    "/tools/camgyro " + arguments + " >" + out + " 2>" + err)
                                       .c_str());
    RunResult result;
    if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
    result.out = ReadFile(out);
    result.err = ReadFile(err);
    return result;
  }

  // Writes the recording of a scenario (yaml) into the folder `name`.
  void Simulate(const std::string& yaml, const std::string& name) const {
    const auto scenario = simulation::ParseScenario(yaml);
    ASSERT_TRUE(scenario) << scenario.error().message;
    const auto simulated = scenario->video.format == simulation::VideoFormat::kNone
                               ? simulation::SimulateTracks(*scenario)
                               : simulation::SimulateSensors(*scenario);
    ASSERT_TRUE(simulated) << simulated.error().message;
    ASSERT_TRUE(simulation::WriteRecording(*simulated, *scenario, Path(name)));
  }

  // Rewrites a csv file row by row; the header stays. Rows come as their cells; false drops one.
  using Row = std::vector<std::string>;
  void EditCsv(const std::string& name,
               const std::function<bool(int index, Row& row)>& edit) const {
    std::stringstream lines(ReadFile(Path(name)));
    std::ofstream out(Path(name));
    std::string line;
    std::getline(lines, line);
    out << line << "\n";
    for (int index = 0; std::getline(lines, line); ++index) {
      Row row;
      std::stringstream cells(line);
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
      if (!edit(index, row)) continue;
      for (size_t i = 0; i < row.size(); ++i) out << (i > 0 ? "," : "") << row[i];
      out << "\n";
    }
  }

  std::filesystem::path root_;
};

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_TOOLS_RUN_CAMGYRO_H_
