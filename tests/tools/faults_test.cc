// Faults in mid-recording, and of the machine, as a user sees them: docs/faults.md has a row for
// each. A recording that is sound otherwise is calibrated with the fault and without; each test
// prints by how many sigmas the result has moved.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <regex>
#include <set>

#include "core/so3.h"
#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

constexpr char kScenario[] =
    "duration_s: 5\nmotion: {kind: walking}\n"
    "camera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}\n"
    "tracks: {count: 40, noise_px: 0.3}\n";
constexpr std::array<double, 3> kTruth = {290.0, 0.020, 0.015};  // f, t_r, t_d of the simulator

class FaultsTest : public CamgyroTest {
 protected:
  struct Estimate {
    std::array<double, 3> value, sigma;
  };
  Estimate Read(const std::string& result) const {
    const YAML::Node yaml = YAML::LoadFile(Path(result + "/calibration.yaml"));
    Estimate e;
    const std::pair<const char*, const char*> keys[] = {
        {"camera", "focal_px"}, {"shutter", "readout_s"}, {"clock", "delay_s"}};
    for (size_t i = 0; i < 3; ++i) {
      const YAML::Node quantity = yaml[keys[i].first][keys[i].second];
      e.value[i] = quantity["value"].as<double>();
      e.sigma[i] = quantity["sigma"].as<double>();
    }
    return e;
  }
  // Of the recording without a fault; calibrated once.
  Estimate Undisturbed() const {
    static const Estimate estimate = [this] {
      Simulate(kScenario, "sound");
      EXPECT_EQ(Run("calibrate sound --out=without --quiet").exit_code, 0);
      return Read("without");
    }();
    return estimate;
  }
  // Edits the rows of a table by their time since the first frame [s].
  using EditRow = std::function<bool(double time_s, int index, Row& row)>;
  void Edit(const std::string& table, const EditRow& edit) const {
    constexpr int64_t kFirst = 1000485000000;  // of the scenario
    EditCsv("a/" + table, [&](int index, Row& row) {
      return edit(1e-9 * static_cast<double>(std::stoll(row[0]) - kFirst), index, row);
    });
  }
  void EditFrames(const EditRow& edit) const {
    Edit("cam0/data.csv", edit);
    Edit("cam0/tracks.csv", edit);
  }

  // The result of `a` is within four sigmas of the truth, and of that of an undisturbed recording.
  RunResult ExpectRecovery(const std::string& fault) const {
    return ExpectRecovery(fault, Undisturbed());
  }
  RunResult ExpectRecovery(const std::string& fault, const Estimate& without) const {
    RunResult run = Run("calibrate a --out=with");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    if (run.exit_code != 0) return run;
    const Estimate with = Read("with");
    std::string moved;
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_LT(std::abs(with.value[i] - kTruth[i]), 4.0 * with.sigma[i]) << i;
      const double sigmas = (with.value[i] - without.value[i]) / with.sigma[i];
      EXPECT_LT(std::abs(sigmas), 4.0) << i;
      moved += " " + std::to_string(sigmas).substr(0, 5);
    }
    std::printf("[ MEASURED ] %s: f, t_r, t_d moved by%s sigmas\n", fault.c_str(), moved.c_str());
    run.out += ReadFile(Path("with/calibration.yaml"));
    return run;
  }
};

TEST_F(FaultsTest, CameraPauses) {
  Simulate(kScenario, "a");
  EditFrames([](double time_s, int, Row&) { return time_s < 1.0 || time_s > 3.0; });
  EXPECT_THAT(ExpectRecovery("camera pauses for 2 s").out, HasSubstr("name: dropped_frames"));
}

TEST_F(FaultsTest, GyroHasAGap) {
  Simulate(kScenario, "a");
  Edit("imu0/data.csv", [](double time_s, int, Row&) { return time_s < 2.0 || time_s > 3.0; });
  EXPECT_THAT(ExpectRecovery("gyro gap of 1 s").out, HasSubstr("name: dropped_samples"));
}

TEST_F(FaultsTest, AThirdOfTheFramesIsDropped) {
  Simulate(kScenario, "a");
  std::set<std::string> dropped;
  Edit("cam0/data.csv", [&](double, int index, Row& row) {
    const bool drop = index % 10 == 3 || index % 7 == 5 || index % 9 == 8;
    if (drop) dropped.insert(row[0]);
    return !drop;
  });
  EXPECT_GT(dropped.size(), 28u);  // of 101
  Edit("cam0/tracks.csv", [&](double, int, Row& row) { return dropped.count(row[0]) == 0; });
  EXPECT_THAT(ExpectRecovery("30 % of the frames dropped").out, HasSubstr("name: dropped_frames"));
}

TEST_F(FaultsTest, GyroChangesItsRate) {
  Simulate(kScenario, "a");
  Edit("imu0/data.csv",
       [](double time_s, int index, Row&) { return time_s < 2.5 || index % 2 == 0; });
  ExpectRecovery("gyro rate halved in mid-recording");
}

TEST_F(FaultsTest, FeaturesAreLostAndFoundAgain) {
  Simulate(kScenario, "a");
  Edit("cam0/tracks.csv", [](double time_s, int, Row& row) {
    if (time_s > 3.0) row[1] += "000000";  // other tracks than before
    return time_s < 2.0 || time_s > 3.01;
  });
  ExpectRecovery("all features lost for 1 s");
}

TEST_F(FaultsTest, HalfOfTheSceneMovesByItself) {
  Simulate(std::string(kScenario) + "scene: {moving_fraction: 0.5}\n", "a");
  ExpectRecovery("half of the points move by themselves");
}

// A rigid object, a truck that passes, say: it takes all tracks that begin in the right half of the
// picture with it, up to 60 px/s to one side and then back, besides what they do by the camera.
TEST_F(FaultsTest, AMovingObjectFillsHalfOfThePicture) {
  Simulate(kScenario, "a");
  std::map<std::string, bool> on_object;  // by track
  int moved = 0, rows = 0;
  Edit("cam0/tracks.csv", [&](double time_s, int, Row& row) {
    ++rows;
    const double u = std::stod(row[2]);
    if (!on_object.emplace(row[1], u > 160.0).first->second) return true;
    ++moved;
    const double shifted = u + 60.0 * std::sin(time_s) - 60.0 * std::sin(0.5 * time_s);
    row[2] = std::to_string(shifted);
    return shifted > 0.0 && shifted < 319.0;
  });
  EXPECT_GT(moved, 0.4 * rows);
  ExpectRecovery("a moving object fills half of the picture");
}

// A pair of frames has a wrong match where either of its points is wrong: half of them.
TEST_F(FaultsTest, HalfOfTheMatchesIsWrong) {
  std::string scenario = kScenario;
  scenario.insert(scenario.rfind('}'), ", outlier_fraction: 0.29");
  Simulate(scenario, "a");
  ExpectRecovery("50 % of the matches wrong");
}

// Five seconds of motion with a rest in the middle, which begins and ends within half a second.
std::string MotionWithRest(double rest_s) {
  constexpr double kMoves = 2.0, kStops = 0.5, kStep = 0.02;
  std::string tum;
  double moved_s = 0.0;
  for (double time_s = 0.0; time_s < 6.0 + rest_s; time_s += kStep) {
    const double into_stop = std::min(time_s - kMoves, kMoves + 2.0 * kStops + rest_s - time_s);
    const double speed = 0.5 + 0.5 * std::cos(M_PI * std::clamp(into_stop / kStops, 0.0, 1.0));
    const Eigen::Vector3d turn(0.10 * std::sin(5.7 * moved_s), 0.08 * std::sin(8.2 * moved_s + 1.0),
                               0.12 * std::sin(4.4 * moved_s + 2.0));
    const Eigen::Quaterniond q = Exp(turn);
    char row[200];
    std::snprintf(row, sizeof(row), "%.3f %.6f %.6f 0 %.9f %.9f %.9f %.9f\n", time_s, 1.4 * moved_s,
                  0.1 * std::sin(3.0 * moved_s), q.x(), q.y(), q.z(), q.w());
    tum += row;
    moved_s += speed * kStep;
  }
  return tum;
}

TEST_F(FaultsTest, TheCameraRestsForMinutes) {
  const auto simulate = [&](double rest_s, const std::string& name) {
    std::ofstream(Path(name + ".tum")) << MotionWithRest(rest_s);
    std::string scenario = kScenario;
    scenario.replace(0, scenario.find("camera:"),
                     "duration_s: " + std::to_string(5.0 + rest_s) +
                         "\nmotion: {kind: file, file: " + Path(name + ".tum") + "}\n");
    Simulate(scenario, name);
  };
  simulate(0.0, "b");
  ASSERT_EQ(Run("calibrate b --out=without --quiet").exit_code, 0);
  simulate(120.0, "a");
  const RunResult run = ExpectRecovery("the camera rests for two minutes", Read("without"));
  EXPECT_THAT(run.out, Not(HasSubstr("doubt")));
}

// Light of 100 Hz makes bands that move from picture to picture; a control of the exposure that
// does not settle makes every other picture brighter.
TEST_F(FaultsTest, TheLightFlickers) {
  Simulate(
      "duration_s: 5\nscene: {kind: room}\n"
      "motion: {kind: handheld, speed_m_s: 0.9, path_radius_m: 1.5, heading_deg: 60}\n"
      "camera: {resolution: [320, 240], focal_px: 290, rate_hz: 30, exposure_s: 0.004}\n"
      "video: {format: png}\n",
      "sound");
  ASSERT_EQ(Run("calibrate sound --out=without --quiet").exit_code, 0);
  // light: of a row, by its time; 1 without flicker.
  const auto flicker = [&](const std::function<double(double time_s, int frame)>& light) {
    std::filesystem::remove_all(Path("a"));
    std::filesystem::copy(Path("sound"), Path("a"), std::filesystem::copy_options::recursive);
    int frame = 0;
    EditCsv("sound/cam0/data.csv", [&](int, Row& row) {
      const std::string file = Path("a/cam0/data/" + row[1]);
      cv::Mat picture = cv::imread(file, cv::IMREAD_GRAYSCALE);
      EXPECT_FALSE(picture.empty()) << file;
      for (int v = 0; v < picture.rows; ++v) {
        picture.row(v) *= light(1e-9 * std::stod(row[0]) + kTruth[1] * v / picture.rows, frame);
      }
      EXPECT_TRUE(cv::imwrite(file, picture));
      ++frame;
      return true;
    });
    EXPECT_EQ(frame, 151);
  };
  const auto bands = [](double depth) {
    return
        [depth](double time_s, int) { return 1.0 + depth * std::sin(2.0 * M_PI * 100.0 * time_s); };
  };
  flicker(bands(0.1));
  ExpectRecovery("bands of light, 10 %", Read("without"));
  flicker([](double, int frame) { return frame % 2 == 0 ? 0.85 : 1.15; });
  ExpectRecovery("every other picture is brighter by 30 %", Read("without"));
  flicker(bands(0.3));
  ExpectRecovery("bands of light, 30 %", Read("without"));
}

// No constant delay fits both parts, and none is given.
TEST_F(FaultsTest, AClockSteps) {
  for (const bool camera : {true, false}) {
    Simulate(kScenario, "a");
    const EditRow step = [](double time_s, int, Row& row) {
      if (time_s > 2.5) row[0] = std::to_string(std::stoll(row[0]) + 50'000'000);
      return true;
    };
    if (camera) {
      EditFrames(step);
    } else {
      Edit("imu0/data.csv", step);
    }
    const RunResult run = Run("calibrate a --out=with");
    EXPECT_THAT(run.exit_code, AnyOf(0, 4)) << run.err;
    EXPECT_THAT(run.out, HasSubstr("two halves of the recording disagree"));
    const Estimate with = Read("with");
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_LT(std::abs(with.value[i] - kTruth[i]), 4.0 * with.sigma[i]) << i;
    }
    EXPECT_GT(with.sigma[2], 0.025);  // half of the step
  }
}

// Interrupted or killed at any moment: a file of the result is there whole, or is not there.
TEST_F(FaultsTest, InterruptedOrKilled) {
  Simulate(kScenario, "a");
  ASSERT_EQ(Run("calibrate a --out=whole --quiet").exit_code, 0);
  for (const char* how : {"INT 0.2", "KILL 0.4", "KILL 0.8"}) {
    SCOPED_TRACE(how);
    std::filesystem::remove_all(Path("with"));
    const int status = std::system(("cd " + Path("") + " && timeout -s " + how + " " + BinaryDir() +
                                    "/tools/camgyro calibrate a --out=with >log.txt 2>&1")
                                       .c_str());
    EXPECT_TRUE(WIFEXITED(status));
    for (const char* file : {"trace.csv", "delay.csv", "calibration.yaml"}) {
      const std::string name = std::string("with/") + file;
      if (Exists(name)) {
        EXPECT_EQ(ReadFile(Path(name)), ReadFile(Path(std::string("whole/") + file)));
      }
    }
  }
}

// The handler is there before the first line is printed, which is waited for. Nothing but the pipe
// keeps the run, so that its end is that of the signal.
TEST_F(FaultsTest, AnInterruptedRunSaysWhatIsKept) {
  Simulate(kScenario, "a");
  const std::string command =
      "cd " + Path("") + " && exec bash -c '" + BinaryDir() +
      "/tools/camgyro calibrate a --out=with >out.txt 2>err.txt & run=$!; while kill -0 $run && ! "
      "grep -q frames out.txt; do sleep 0.01; done; kill -INT $run; wait $run' 2>/dev/null";
  EXPECT_NE(std::system(command.c_str()), 0);
  EXPECT_THAT(ReadFile(Path("err.txt")),
              AllOf(HasSubstr("interrupted"), HasSubstr("camgyro track keeps the tracks")));
  EXPECT_FALSE(Exists("with/calibration.yaml"));
}

// Files that may not grow beyond a block stand for a full disk.
TEST_F(FaultsTest, DiskFull) {
  Simulate(kScenario, "a");
  const std::string command = "cd " + Path("") + " && (trap '' XFSZ; ulimit -f 1; " + BinaryDir() +
                              "/tools/camgyro calibrate a --out=with --quiet 2>&1) | tail -n 1";
  FILE* output = popen(command.c_str(), "r");
  ASSERT_NE(output, nullptr);
  std::string said;
  for (int c = std::fgetc(output); c != EOF; c = std::fgetc(output)) said += static_cast<char>(c);
  pclose(output);
  EXPECT_THAT(
      said, AllOf(HasSubstr("cannot write with/"), HasSubstr("the disk is full, or not writable")));
  EXPECT_TRUE(!Exists("with") || std::filesystem::is_empty(Path("with")));
}

// Every test that the page names is there, and every test here is on the page.
TEST(FaultsPage, NamesTests) {
  std::string sources;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(SourceDir() + "/tests")) {
    if (entry.path().extension() != ".cc") continue;
    std::stringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    sources += text.str();
  }
  std::stringstream page;
  page << std::ifstream(SourceDir() + "/docs/faults.md").rdbuf();
  const std::string text = page.str();
  const std::regex name("`([A-Z]\\w+)\\.([A-Z]\\w+)`");
  int named = 0;
  for (std::sregex_iterator i(text.begin(), text.end(), name), end; i != end; ++i, ++named) {
    const std::string test = "(" + (*i)[1].str() + ", " + (*i)[2].str() + ")";
    EXPECT_NE(sources.find(test), std::string::npos) << test;
  }
  EXPECT_GT(named, 15);
  for (const std::string own :
       {"CameraPauses", "GyroHasAGap", "AThirdOfTheFramesIsDropped", "GyroChangesItsRate",
        "FeaturesAreLostAndFoundAgain", "HalfOfTheSceneMovesByItself", "HalfOfTheMatchesIsWrong",
        "AClockSteps", "InterruptedOrKilled", "DiskFull", "TheCameraRestsForMinutes",
        "TheLightFlickers"}) {
    EXPECT_NE(text.find("`FaultsTest." + own + "`"), std::string::npos) << own;
  }
}

}  // namespace
}  // namespace camgyro
