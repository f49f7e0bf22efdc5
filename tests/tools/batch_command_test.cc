// Many recordings at a time: results, tables, resuming, and what is refused.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class BatchCommandTest : public CamgyroTest {
 protected:
  // f 290 px, or another one; the simulator's defaults for everything else.
  void Record(const std::string& name, int seed, const std::string& more = "") const {
    Simulate("seed: " + std::to_string(seed) +
                 "\nduration_s: 3\ncamera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}\n"
                 "tracks: {count: 40, noise_px: 0.2}\n" +
                 more,
             name);
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name)) << text;
  }
  // The row of recordings.csv that begins so.
  std::string RowOf(const std::string& begin) const {
    std::stringstream lines(ReadFile(Path("out/recordings.csv")));
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind(begin, 0) == 0) return line;
    }
    return "";
  }
};

// Two recordings of one device; one at rest and one that is not there of another.
TEST_F(BatchCommandTest, GivesWhatCalibrateGivesAndKeepsExitCodes) {
  Record("a", 1);
  Record("more/a", 2);
  Record("rest", 3, "motion: {rotation_rms_rad_s: [0, 0, 0], speed_m_s: 0, sway_rms_m_s: 0}\n");
  Write("list.csv",
        "device,owner,recording\nphone,x,a\nphone,y,more/a\nother,z,rest\nother,z,missing\n");
  const RunResult run = Run("batch list.csv --out=out --jobs=2");
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr("2 of 4 recordings failed; out/recordings.csv says why"));
  EXPECT_THAT(run.out, AllOf(HasSubstr("4 recordings, 0 of them done before"),
                             HasSubstr("phone: one device, 2 recordings"),
                             HasSubstr("other: none of its recordings could be calibrated")));
  EXPECT_THAT(RowOf("phone,a,"), HasSubstr("phone,a,phone/a,0,true,,2"));
  EXPECT_THAT(RowOf("phone,more/a,"), HasSubstr("phone/a_2,0,true,"));
  EXPECT_THAT(RowOf("other,rest,"), HasSubstr("other/rest,4,false,"));
  EXPECT_THAT(RowOf("other,missing,"),
              AllOf(HasSubstr("other/missing,3,false,"), HasSubstr("does not exist")));
  EXPECT_THAT(ReadFile(Path("out/other/rest/log.txt")), HasSubstr("camgyro: "));
  EXPECT_FALSE(Exists("out/other/calibration.yaml"));
  EXPECT_TRUE(Exists("out/phone/a_2/report.html"));

  // The same as in one process, but for the ten digits that files have.
  ASSERT_EQ(Run("calibrate a more/a --out=device").exit_code, 0);
  const YAML::Node expected = YAML::LoadFile(Path("device/calibration.yaml"));
  const YAML::Node device = YAML::LoadFile(Path("out/phone/calibration.yaml"));
  for (const auto& [section, key] : std::vector<std::pair<std::string, std::string>>{
           {"camera", "focal_px"}, {"shutter", "readout_s"}, {"clock", "delay_s"}}) {
    for (const char* number : {"value", "sigma", "sigma_total"}) {
      const auto truth = expected[section][key][number].as<double>();
      EXPECT_NEAR(device[section][key][number].as<double>(), truth, 1e-6 * std::abs(truth))
          << key << " " << number;
    }
  }
  EXPECT_EQ(device["recordings"]["names"].as<std::vector<std::string>>(),
            (std::vector<std::string>{"a", "a_2"}));
  EXPECT_THAT(ReadFile(Path("out/phone/device.csv")), HasSubstr("\nfocal_px,29"));
  EXPECT_THAT(ReadFile(Path("out/phone/device.html")), HasSubstr("focal length"));
}

TEST_F(BatchCommandTest, DoesWhatIsMissingOnly) {
  Record("a", 1);
  Record("b", 2);
  Write("list.csv", "device,recording\nphone,a\nphone,b\n");
  ASSERT_EQ(Run("batch list.csv --out=out --quiet").exit_code, 0);
  const std::string table = ReadFile(Path("out/recordings.csv"));
  const auto time_of = [&](const char* name) {
    return std::filesystem::last_write_time(
        Path(std::string("out/phone/") + name + "/calibration.yaml"));
  };
  const auto before_a = time_of("a"), before_b = time_of("b");
  // As a worker leaves it that was killed before its end: without an outcome.
  std::filesystem::remove(Path("out/phone/b/outcome.yaml"));
  const RunResult again = Run("batch list.csv --out=out");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("2 recordings, 1 of them done before"));
  EXPECT_EQ(time_of("a"), before_a);
  EXPECT_NE(time_of("b"), before_b);
  EXPECT_EQ(ReadFile(Path("out/recordings.csv")), table);
  EXPECT_THAT(Run("batch list.csv --out=out").out, HasSubstr("2 of them done before"));
  // A result of other flags is not what is asked for.
  EXPECT_THAT(Run("batch list.csv --out=out --delay_ms=15").out,
              HasSubstr("0 of them done before"));
}

// Parts of the work, as machines share it out, make what one machine makes; the last run has only
// the tables left to do.
TEST_F(BatchCommandTest, DevicesOneByOneGiveTheSame) {
  Record("a", 1);
  Record("b", 2);
  Record("c", 3);
  Write("list.csv", "device,recording\nphone,a\nother,b\nphone,c\n");
  ASSERT_EQ(Run("batch list.csv --out=whole --quiet").exit_code, 0);
  for (const char* device : {"other", "phone"}) {
    const RunResult run = Run(std::string("batch list.csv --out=out --only=") + device);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr(std::string("out/") + device + "/recordings.csv"));
  }
  EXPECT_FALSE(Exists("out/recordings.csv"));
  EXPECT_THAT(ReadFile(Path("out/other/recordings.csv")),
              AllOf(HasSubstr("other,b,other/b,0,"), Not(HasSubstr("phone"))));
  EXPECT_THAT(Run("batch list.csv --out=out").out,
              HasSubstr("3 recordings, 3 of them done before"));
  for (const char* file : {"recordings.csv", "phone/device.csv", "phone/calibration.yaml",
                           "other/device.csv", "other/b/calibration.yaml"}) {
    EXPECT_EQ(ReadFile(Path(std::string("out/") + file)),
              ReadFile(Path(std::string("whole/") + file)))
        << file;
  }
  const RunResult none = Run("batch list.csv --out=out --only=tablet");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("--only: list.csv has no device tablet"));
}

// Killed at any moment, everything that has an outcome is whole, and the next run goes on from it.
TEST_F(BatchCommandTest, GoesOnAfterItWasKilled) {
  Record("a", 1);
  Record("b", 2);
  Write("list.csv", "device,recording\nphone,a\nphone,b\n");
  ASSERT_EQ(Run("batch list.csv --out=whole --quiet").exit_code, 0);
  for (const char* after_s : {"0.05", "0.3", "0.6"}) {
    SCOPED_TRACE(after_s);
    std::system(("cd " + Path("") + " && timeout -s KILL " + after_s + " " + BinaryDir() +
                 "/tools/camgyro batch list.csv --out=out --jobs=1 >killed.txt 2>&1")
                    .c_str());
    for (const char* name : {"a", "b"}) {
      const std::string folder = std::string("out/phone/") + name;
      if (!Exists(folder + "/outcome.yaml")) continue;
      EXPECT_EQ(ReadFile(Path(folder + "/calibration.yaml")),
                ReadFile(Path(std::string("whole/phone/") + name + "/calibration.yaml")));
    }
  }
  ASSERT_EQ(Run("batch list.csv --out=out --quiet").exit_code, 0);
  const auto lines = [&](const std::string& out) {
    return ReadFile(Path(out + "/phone/device.csv"));
  };
  EXPECT_EQ(lines("out"), lines("whole"));
}

// Names are text in a table and on a page, whatever they hold.
TEST_F(BatchCommandTest, NamesAreEscaped) {
  const std::string name = "<img src=x onerror=alert(1)>\"q\"";
  Write("list.csv", "device,recording\nphone," + name + "\n");
  EXPECT_EQ(Run("batch list.csv --out=out").exit_code, 3);
  const std::string page = ReadFile(Path("out/phone/device.html"));
  EXPECT_THAT(page, AllOf(HasSubstr("&lt;img src=x"), Not(HasSubstr("<img src=x"))));
  EXPECT_THAT(RowOf("phone,"), HasSubstr("phone,\"<img src=x onerror=alert(1)>\"\"q\"\"\","));
}

TEST_F(BatchCommandTest, ManifestsThatCannotBeMeantAreRefused) {
  const std::pair<std::string, std::string> cases[] = {
      {"phone,a\n", "expected a column device"},
      {"device,recording\n", "has no rows"},
      {"device,recording\n../up,a\n", ":2: device '../up': expected letters"},
      {"device,recording\n.hidden,a\n", "device '.hidden'"},
      {"device,recording\nphone,\n", ":2: recording: the cell is empty"},
      {"device,recording\nphone,a\nphone,b/../a\n", ":3: recording a is there twice"},
      {"device,recording\nphone,a,b\n", "has 3 columns"}};
  for (const auto& [manifest, complaint] : cases) {
    SCOPED_TRACE(manifest);
    Write("list.csv", manifest);
    const RunResult run = Run("batch list.csv --out=out");
    EXPECT_EQ(run.exit_code, 3);
    EXPECT_THAT(run.err, HasSubstr(complaint));
    EXPECT_FALSE(Exists("out"));
  }
  EXPECT_EQ(Run("batch list.csv").exit_code, 2);
  EXPECT_EQ(Run("batch list.csv --out=out --device=toaster").exit_code, 2);
  EXPECT_EQ(Run("batch no.csv --out=out").exit_code, 3);
}

}  // namespace
}  // namespace camgyro
