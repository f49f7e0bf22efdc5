// What the binary says about recordings that cannot be used: issue 2, "Bad input".
#include <gmock/gmock.h>

#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr char kHandheld[] = R"(
duration_s: 3
camera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}
tracks: {count: 40, noise_px: 0.3}
)";
constexpr char kNoRotation[] = R"(
duration_s: 3
motion: {rotation_rms_rad_s: [0, 0, 0]}
camera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}
tracks: {count: 40, noise_px: 0.3}
)";
constexpr char kSlow[] = R"(
duration_s: 3
motion: {rotation_rms_rad_s: [0.1, 0.1, 0.1]}
camera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}
tracks: {count: 40, noise_px: 0.3}
)";

class BadInputTest : public CamgyroTest {
 protected:
  // Refused with this code and message, and nothing is left behind.
  void ExpectRefusal(const std::string& recording, int exit_code,
                     const testing::Matcher<const std::string&>& message) const {
    const RunResult result = Run("calibrate " + recording + " --out=result");
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_THAT(result.err, message);
    EXPECT_FALSE(Exists("result"));
  }
  void ScaleGyro(double factor) const {
    EditCsv("a/imu0/data.csv", [&](int, Row& row) {
      for (size_t i = 1; i <= 3; ++i) row[i] = std::to_string(factor * std::stod(row[i]));
      return true;
    });
  }
};

TEST_F(BadInputTest, MissingFolder) { ExpectRefusal("no_such", 3, HasSubstr("no_such")); }

TEST_F(BadInputTest, NanCell) {
  Simulate(kHandheld, "a");
  EditCsv("a/imu0/data.csv", [](int index, Row& row) {
    if (index == 6) row[2] = "nan";
    return true;
  });
  ExpectRefusal("a", 3, HasSubstr("a/imu0/data.csv:8"));  // header and six rows before it
}

TEST_F(BadInputTest, EmptyCell) {
  Simulate(kHandheld, "a");
  EditCsv("a/cam0/tracks.csv", [](int index, Row& row) {
    if (index == 10) row[2] = "";
    return true;
  });
  ExpectRefusal("a", 3, HasSubstr("a/cam0/tracks.csv:12"));
}

TEST_F(BadInputTest, StampGoesBack) {
  Simulate(kHandheld, "a");
  EditCsv("a/imu0/data.csv", [](int index, Row& row) {
    if (index == 20) row[0] = "1";
    return true;
  });
  ExpectRefusal("a --strict", 3, HasSubstr("a/imu0/data.csv:22"));
  const RunResult mended = Run("calibrate a --out=result");
  EXPECT_EQ(mended.exit_code, 0) << mended.err;
  EXPECT_THAT(mended.out, HasSubstr("a/imu0/data.csv:22"));
}

TEST_F(BadInputTest, ClocksWithoutOverlapAndNoRotation) {
  Simulate(kNoRotation, "a");
  EditCsv("a/imu0/data.csv", [](int, Row& row) {
    row[0] = std::to_string(std::stoll(row[0]) + 1'000'000'000'000);
    return true;
  });
  ExpectRefusal("a", 4, AllOf(HasSubstr("no overlap in time"), HasSubstr("no rotation")));
}

TEST_F(BadInputTest, NoRotation) {
  Simulate(kNoRotation, "a");
  ExpectRefusal("a", 4, HasSubstr("no rotation in the recording"));
}

TEST_F(BadInputTest, GyroInDegrees) {
  Simulate(kHandheld, "a");
  ScaleGyro(57.29577951308232);
  ExpectRefusal("a", 3, HasSubstr("deg/s"));  // by the size of the rates alone
}

TEST_F(BadInputTest, GyroInDegreesOnSlowMotion) {
  Simulate(kSlow, "a");
  ScaleGyro(57.29577951308232);
  ExpectRefusal("a", 4, HasSubstr("deg/s"));  // against the camera
}

TEST_F(BadInputTest, TooFewFeatures) {
  Simulate(kHandheld, "a");
  std::string stamp;
  int count = 0;
  EditCsv("a/cam0/tracks.csv", [&](int, Row& row) {
    count = row[0] == stamp ? count + 1 : 1;
    stamp = row[0];
    return count <= 3;
  });
  ExpectRefusal("a", 4, AllOf(HasSubstr("too few features"), HasSubstr("at least 8")));
}

TEST_F(BadInputTest, NothingMoves) {
  Simulate(kHandheld, "a");
  // Every frame shows the first one's points.
  std::string first;
  std::vector<Row> points;
  EditCsv("a/cam0/tracks.csv", [&](int, Row& row) {
    if (first.empty()) first = row[0];
    if (row[0] != first) return false;
    points.push_back(row);
    return true;
  });
  std::ofstream tracks(Path("a/cam0/tracks.csv"), std::ios::app);
  std::stringstream frames(ReadFile(Path("a/cam0/data.csv")));
  std::string line;
  std::getline(frames, line);
  std::getline(frames, line);
  while (std::getline(frames, line)) {
    for (const Row& point : points) {
      tracks << line.substr(0, line.find(',')) << "," << point[1] << "," << point[2] << ","
             << point[3] << "\n";
    }
  }
  tracks.close();
  ExpectRefusal("a", 4, HasSubstr("no motion in the recording: features move by 0.00 px"));
}

TEST_F(BadInputTest, VideoWithoutTelemetry) {
  Simulate(
      "{duration_s: 0.3, scene: {kind: room}, motion: {path_radius_m: 1}, video: {format: mp4},"
      " camera: {resolution: [160, 120], focal_px: 130}}",
      "a");
  ExpectRefusal("a/cam0/video.mp4", 3, HasSubstr("telemetry"));
}

// An older result survives a run that fails.
TEST_F(BadInputTest, FailureLeavesEarlierResultsAlone) {
  std::filesystem::create_directories(Path("result"));
  std::ofstream(Path("result/calibration.yaml")) << "earlier";
  EXPECT_EQ(Run("calibrate no_such --out=result").exit_code, 3);
  EXPECT_EQ(ReadFile(Path("result/calibration.yaml")), "earlier");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(Path("result")), {}), 1);
}

}  // namespace
}  // namespace camgyro
