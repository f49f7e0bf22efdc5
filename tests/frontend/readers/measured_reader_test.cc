// Every recording of the measured data is read without complaint, and says what is in the files.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "frontend/frame_source.h"
#include "frontend/readers/read_recording.h"
#include "tests/measured_data.h"

namespace camgyro {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Facts {
  const char* name;
  size_t frames, gyro, accel;
  int64_t first_frame_ns, last_frame_ns, first_gyro_ns, last_gyro_ns;
  size_t exposures, observations, pairs, matches, attitudes;
  int width_px, height_px;
  bool images;
};

// From the files themselves: wc -l, head, tail.
// clang-format off
const Facts kFacts[] = {
  {"euroc-v101-flight", 90, 3690, 3690, 1403715285262142976, 1403715289712143104,
   1403715273262142976, 1403715291707142912, 0, 0, 0, 0, 0, 752, 480, true},
  {"euroc-v101-rest", 30, 1340, 0, 1403715273262142976, 1403715274712143104,
   1403715273262142976, 1403715279957143040, 0, 0, 0, 0, 0, 752, 480, true},
  {"iphone-cards", 360, 3685, 0, 1451800000, 37343600000, 510600000, 37377200000,
   0, 0, 359, 18824, 0, 480, 640, false},
  {"ov_handheld_gs", 1800, 12001, 12001, 1520531836104474068, 1520531896071083546,
   1520531836106140852, 1520531896107514143, 0, 215984, 0, 0, 0, 752, 480, false},
  {"ov_handheld_rs", 1800, 12001, 12001, 1520531836104474068, 1520531896071083546,
   1520531836106140852, 1520531896107514143, 0, 215987, 0, 0, 0, 752, 480, false},
  {"ov_handheld_rs_skew", 1800, 12001, 12001, 1520531836104474545, 1520531896053094149,
   1520531836106140852, 1520531896107514143, 0, 215987, 0, 0, 0, 752, 480, false},
  {"phone-cc9-street", 103, 29466, 0, 4328043690897000, 4328047088799000,
   4328040426741000, 4328112148469000, 103, 0, 0, 0, 0, 800, 600, true},
  {"tablet-shield-burst", 7, 23, 0, 767700989000, 767900977000, 767705436983, 767925332483,
   7, 0, 0, 0, 0, 1920, 1080, true},
  {"tablet-attitude/D01", 1800, 6718, 0, 1218946934000, 1278943096000,
   1218994713625, 1286145164692, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D02", 1800, 6543, 0, 56680843000, 116643672000,
   57663396068, 123064651552, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D03", 1800, 6813, 0, 110118674000, 170081496000,
   120597256050, 188696702200, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D04", 1800, 7288, 0, 62387692000, 122350524000,
   103506095135, 176354115868, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D05", 1800, 6736, 0, 48196480000, 108192642000,
   48226929654, 115558617888, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D06", 1800, 8360, 0, 428783281000, 488746114000,
   893700352361, 977259032591, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D07", 1800, 8973, 0, 80331915000, 140294746000,
   118500706214, 208189794859, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D08", 1800, 9362, 0, 68440306000, 128403136000,
   70889079230, 164470326624, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D10", 1800, 9528, 0, 56633305000, 116596135000,
   56682232736, 151927402213, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D11", 1800, 6914, 0, 10158706658000, 10218669491000,
   10158731787661, 10227829173978, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D12", 1800, 6621, 0, 486446926000, 546409756000,
   505435100456, 571606454357, 0, 0, 0, 0, 1800, 0, 0, false},
  {"tablet-attitude/D13", 1800, 7062, 0, 188671457000, 248634276000,
   207302322363, 277885131429, 0, 0, 0, 0, 1800, 0, 0, false},
};
// clang-format on

size_t CountExposures(const Recording& recording) {
  return std::count_if(recording.frames.begin(), recording.frames.end(),
                       [](const Frame& frame) { return !std::isnan(frame.exposure_s); });
}

size_t CountDecodedFrames(const Recording& recording) {
  auto frames = OpenFrames(recording);
  EXPECT_TRUE(frames) << frames.error().message;
  cv::Mat gray;
  size_t count = 0;
  for (;; ++count) {
    const Result<bool> more = (*frames)->Next(&gray);
    EXPECT_TRUE(more) << more.error().message;
    if (!more || !*more) return count;
  }
}

class MeasuredFolder : public ::testing::TestWithParam<Facts> {};

TEST_P(MeasuredFolder, IsReadWhole) {
  const Facts& facts = GetParam();
  const auto path = MeasuredData(facts.name);
  if (!path) GTEST_SKIP() << facts.name << " is not on this machine (CAMGYRO_DATA)";
  const Result<Recording> recording = ReadRecording(*path);
  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), facts.frames);
  EXPECT_EQ(recording->frames.front().stamp_ns, facts.first_frame_ns);
  EXPECT_EQ(recording->frames.back().stamp_ns, facts.last_frame_ns);
  ASSERT_EQ(recording->gyro.size(), facts.gyro);
  EXPECT_EQ(recording->gyro.front().stamp_ns, facts.first_gyro_ns);
  EXPECT_EQ(recording->gyro.back().stamp_ns, facts.last_gyro_ns);
  EXPECT_EQ(recording->accel.size(), facts.accel);
  EXPECT_EQ(CountExposures(*recording), facts.exposures);
  size_t observations = 0, matches = 0;
  for (const auto& points : recording->tracks) observations += points.size();
  for (const FramePair& pair : recording->matches) matches += pair.matches.size();
  EXPECT_EQ(observations, facts.observations);
  EXPECT_EQ(recording->matches.size(), facts.pairs);
  EXPECT_EQ(matches, facts.matches);
  EXPECT_EQ(recording->q_cam_world.size(), facts.attitudes);
  EXPECT_EQ(recording->camera.width_px, facts.width_px);
  EXPECT_EQ(recording->camera.height_px, facts.height_px);
  EXPECT_EQ(recording->HasImages(), facts.images);
  EXPECT_FALSE(recording->declared_stabilisation);
  if (facts.images) {
    EXPECT_EQ(CountDecodedFrames(*recording), facts.frames);
  }
  if (std::string(facts.name) == "tablet-attitude/D06") {  // clocks 465 s apart
    EXPECT_THAT(recording->notes, Contains(HasSubstr("clocks do not overlap")));
  } else {
    EXPECT_THAT(recording->notes, IsEmpty());
  }
}

INSTANTIATE_TEST_SUITE_P(All, MeasuredFolder, ::testing::ValuesIn(kFacts), [](const auto& test) {
  std::string name = test.param.name;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
});

TEST(MeasuredFolders, DeclaredGuessesAreRead) {
  const auto path = MeasuredData("phone-cc9-street");
  if (!path) GTEST_SKIP() << "phone-cc9-street is not on this machine (CAMGYRO_DATA)";
  const Result<Recording> recording = ReadRecording(*path);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_DOUBLE_EQ(recording->camera.focal_px.value(), 600.0);
  EXPECT_EQ(recording->camera.principal_px.value(), Eigen::Vector2d(400, 300));
  Eigen::Matrix3d R_gyro_cam;
  R_gyro_cam << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  EXPECT_TRUE(recording->camera.q_gyro_cam->toRotationMatrix().isApprox(R_gyro_cam, 1e-12));
  EXPECT_DOUBLE_EQ(recording->frames[0].exposure_s, 0.005405);
}

TEST(MeasuredFolders, TimingFilesAreNoRecording) {
  for (const char* name : {"timing-nexus-s", "timing-pixel-ois", "gopro-hero5-karma"}) {
    const auto path = MeasuredData(name);
    if (!path) GTEST_SKIP() << name << " is not on this machine (CAMGYRO_DATA)";
    const Result<Recording> recording = ReadRecording(*path);
    ASSERT_FALSE(recording);
    EXPECT_THAT(recording.error().message, HasSubstr("not a recording of a known format"));
  }
}

// Rows of numbers after a header line.
std::vector<std::vector<double>> ReadTable(const std::string& file) {
  std::ifstream in(file);
  std::vector<std::vector<double>> rows;
  std::string line, cell;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    while (std::getline(cells, cell, ',')) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

struct GoProFacts {
  // Axes x, y, z of the stored columns of gyro.csv, which keeps the file's order.
  Eigen::Matrix3d axes;
  double clock_tolerance_s;
  int width_px, height_px;
};

// Compares with an extraction that another program made.
void ExpectEqualToExtraction(const GoProFacts& facts, const Recording& recording,
                             const std::string& folder) {
  EXPECT_EQ(recording.camera.width_px, facts.width_px);
  EXPECT_EQ(recording.camera.height_px, facts.height_px);
  const auto frames = ReadTable(folder + "/frames.csv");
  ASSERT_EQ(recording.frames.size(), frames.size());
  for (size_t i = 0; i < frames.size(); ++i) {
    ASSERT_NEAR(1e-9 * static_cast<double>(recording.frames[i].stamp_ns), frames[i][1], 1e-6);
  }
  const auto meta = ReadTable(folder + "/frame_meta.csv");
  EXPECT_EQ(CountExposures(recording), meta.size());
  for (size_t i = 0; i < meta.size(); ++i) {
    ASSERT_NEAR(recording.frames[i].exposure_s, meta[i][1], 1e-8) << i;
  }
  const auto gyro = ReadTable(folder + "/gyro.csv");
  ASSERT_EQ(recording.gyro.size(), gyro.size());
  for (size_t i = 0; i < gyro.size(); ++i) {
    ASSERT_NEAR(1e-9 * static_cast<double>(recording.gyro[i].stamp_ns), gyro[i][0],
                facts.clock_tolerance_s)
        << i;
    const Eigen::Vector3d expected = facts.axes * Eigen::Vector3d(&gyro[i][1]);
    ASSERT_LT((recording.gyro[i].omega_gyro_rad_s - expected).norm(), 2e-6) << i;
  }
  EXPECT_EQ(CountDecodedFrames(recording), frames.size());
}

TEST(MeasuredGoPro, Hero5IsReadLikeTheIndependentExtraction) {
  const auto folder = MeasuredData("gopro-hero5-karma");
  if (!folder) GTEST_SKIP() << "gopro-hero5-karma is not on this machine (CAMGYRO_DATA)";
  const Result<Recording> recording = ReadRecording(*folder + "/karma.mp4");
  ASSERT_TRUE(recording) << recording.error().message;
  Eigen::Matrix3d axes;  // z, x, y are stored
  axes << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  ExpectEqualToExtraction({axes, 2e-6, 854, 480}, *recording, *folder);
  EXPECT_FALSE(recording->declared_stabilisation);
  EXPECT_FALSE(recording->camera.readout_s);
  EXPECT_FALSE(recording->camera.q_gyro_cam);
  EXPECT_EQ(recording->accel.size(), 2397u);
  EXPECT_NEAR(1.0 / MedianInterval(recording->gyro), 397.2, 0.1);
  EXPECT_THAT(recording->notes, Contains(HasSubstr("GoPro HERO5, gyro axes ZXY")));
  // The flight is level: gravity's reaction is along the axis that points up, GoPro's z.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const AccelSample& sample : recording->accel) mean += sample.accel_gyro_m_s2;
  mean /= static_cast<double>(recording->accel.size());
  EXPECT_NEAR(mean.norm(), 9.8, 0.5);
  EXPECT_GT(mean.z(), 0.8 * mean.norm());
}

TEST(MeasuredGoPro, Hero7DeclaresItsStabilisation) {
  const auto folder = MeasuredData("gopro-hero7-hypersmooth");
  if (!folder) GTEST_SKIP() << "gopro-hero7-hypersmooth is not on this machine (CAMGYRO_DATA)";
  const Result<Recording> recording = ReadRecording(*folder + "/hero7.mp4");
  ASSERT_TRUE(recording) << recording.error().message;
  Eigen::Matrix3d axes;  // y, -x, z are stored
  axes << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  // The extraction's line is least squares, which the first two payloads turn by up to 8 ms.
  ExpectEqualToExtraction({axes, 9e-3, 848, 480}, *recording, *folder);
  EXPECT_EQ(recording->declared_stabilisation, "EISE=Y, EISA=HS EIS");
  EXPECT_NEAR(recording->camera.readout_s.value(), 8.015e-3, 1e-6);
  EXPECT_THAT(recording->notes, Contains(HasSubstr("GoPro HERO7 Black, field of view (VFOV) W")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("telemetry payload 0 has 171 gyro samples")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("telemetry payload 1 has 216 gyro samples")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("exposures (SHUT) of 329 of 352 frames")));
  EXPECT_THAT(recording->notes, Contains(HasSubstr("the gyro ends at 11.0158 s")));
}

}  // namespace
}  // namespace camgyro
