#include "frontend/readers/gpmf.h"

#include <gmock/gmock.h>

#include <cmath>

#include "frontend/readers/mp4_box.h"
#include "frontend/readers/sample_clock.h"
#include "tests/frontend/readers/gpmf_bytes.h"
#include "tests/frontend/readers/recording_folder.h"

namespace camgyro {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

ByteView View(const std::string& bytes) {
  return {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()};
}

TEST(Gpmf, ParsesItemsWithTheirPadding) {
  const std::string bytes = GpmfText("DVNM", "Cam v1") + GpmfShort("SCAL", -3) +
                            GpmfFloats("SHUT", {0.5f, -2.0f}) + std::string(8, '\0') + "rest";
  const auto items = ParseGpmf(View(bytes));
  ASSERT_TRUE(items) << items.error().message;
  ASSERT_EQ(items->size(), 3u);  // zeros end a level
  EXPECT_EQ((*items)[0].key, "DVNM");
  EXPECT_EQ((*items)[0].Text(), "Cam v1");
  EXPECT_THAT((*items)[0].Numbers(), IsEmpty());
  EXPECT_THAT((*items)[1].Numbers(), ElementsAre(-3.0));
  EXPECT_THAT((*items)[2].Numbers(), ElementsAre(0.5, -2.0));
}

TEST(Gpmf, DecodesEveryNumericType) {
  const auto number = [](char type, const std::string& content) {
    const std::string bytes =
        GpmfItemBytes("TEST", type, static_cast<int>(content.size()), 1, content);
    return ParseGpmf(View(bytes)).value().front().Numbers().at(0);
  };
  EXPECT_EQ(number('b', "\xFF"), -1.0);
  EXPECT_EQ(number('B', "\xFF"), 255.0);
  EXPECT_EQ(number('s', "\xFF\xFE"), -2.0);
  EXPECT_EQ(number('S', "\xFF\xFE"), 65534.0);
  EXPECT_EQ(number('l', "\xFF\xFF\xFF\xFD"), -3.0);
  EXPECT_EQ(number('L', "\xFF\xFF\xFF\xFD"), 4294967293.0);
  EXPECT_EQ(number('f', std::string("\x3F\xC0\x00\x00", 4)), 1.5);
  EXPECT_EQ(number('d', std::string("\xBF\xF8\x00\x00\x00\x00\x00\x00", 8)), -1.5);
  EXPECT_EQ(number('j', "\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFE"), -2.0);
  EXPECT_EQ(number('J', std::string("\x00\x00\x00\x01\x00\x00\x00\x00", 8)), 4294967296.0);
  EXPECT_EQ(number('q', std::string("\xFF\xFF\x80\x00", 4)), -0.5);
  EXPECT_EQ(number('Q', std::string("\x00\x00\x00\x02\x40\x00\x00\x00", 8)), 2.25);
}

TEST(Gpmf, ReadsStreamsOfNestedDevices) {
  const std::string gyro = GpmfLong("TSMP", 2) + GpmfText("SIUN", "rad/s") +
                           GpmfShort("SCAL", 100) + GpmfText("ORIN", "YxZ") +
                           GpmfTriples("GYRO", {100, -200, 300, 4, 5, 6});
  const std::string other = GpmfTriples("GYRO", {7, 7, 7});
  const std::string bytes =
      GpmfNested("DEVC", GpmfText("DVNM", "Hero7 Black") + GpmfNested("STRM", gyro) +
                             GpmfNested("STRM", GpmfFloats("SHUT", {0.01f}))) +
      GpmfNested("DEVC", GpmfText("DVNM", "Drone") + GpmfNested("STRM", other));
  const auto payload = ReadGpmfPayload(View(bytes));
  ASSERT_TRUE(payload) << payload.error().message;
  EXPECT_EQ(payload->device_name, "Hero7 Black");
  ASSERT_EQ(payload->streams.size(), 2u);  // the drone's gyro is not the camera's
  const GpmfStream& stream = payload->streams[0];
  EXPECT_EQ(stream.key, "GYRO");
  EXPECT_EQ(stream.samples, 2u);
  EXPECT_EQ(stream.elements, 3u);
  EXPECT_THAT(stream.values, ElementsAre(1.0, -2.0, 3.0, 0.04, 0.05, 0.06));
  EXPECT_EQ(stream.unit, "rad/s");
  EXPECT_EQ(stream.orientation, "YxZ");
  EXPECT_EQ(stream.total_samples, 2.0);
  EXPECT_FALSE(stream.stamp_us);
}

TEST(Gpmf, EveryCutIsAnErrorOrAShorterLevel) {
  const std::string stream = GpmfShort("SCAL", 10) + GpmfTriples("GYRO", {1, 2, 3, 4, 5, 6});
  const std::string whole =
      GpmfNested("DEVC", GpmfText("DVNM", "Camera") + GpmfNested("STRM", stream));
  for (size_t length = 0; length < whole.size(); ++length) {
    const std::string cut = whole.substr(0, length);
    const auto payload = ReadGpmfPayload(View(cut));
    if (length < 8) {
      ASSERT_TRUE(payload);
      EXPECT_THAT(payload->streams, IsEmpty());
    } else {
      ASSERT_FALSE(payload) << length;
      EXPECT_THAT(payload.error().message, HasSubstr("are left"));
    }
  }
}

TEST(Gpmf, RefusesScalesAndValuesThatDoNotFit) {
  for (const std::string& scale :
       {GpmfShort("SCAL", 0), GpmfItemBytes("SCAL", 's', 2, 2, std::string("\0\1\0\1", 4)),
        GpmfFloats("SCAL", {std::nanf("")})}) {
    const std::string bytes =
        GpmfNested("DEVC", GpmfNested("STRM", scale + GpmfTriples("GYRO", {1, 2, 3})));
    const auto payload = ReadGpmfPayload(View(bytes));
    ASSERT_FALSE(payload);
    EXPECT_THAT(payload.error().message, HasSubstr("GYRO has"));
  }
}

TEST(Gpmf, OrientationMapsStoredSamplesToAxes) {
  // "YxZ": the stored samples are y, -x, z.
  const auto axes = AxesFromOrientation("YxZ");
  ASSERT_TRUE(axes);
  EXPECT_EQ(*axes * Eigen::Vector3d(20, -10, 30), Eigen::Vector3d(10, 20, 30));
  EXPECT_EQ(AxesFromOrientation("ZXY").value() * Eigen::Vector3d(30, 10, 20),
            Eigen::Vector3d(10, 20, 30));
  EXPECT_FALSE(AxesFromOrientation("YXZ"));  // mirrored
  EXPECT_FALSE(AxesFromOrientation("XXZ"));
  EXPECT_FALSE(AxesFromOrientation("XYW"));
  EXPECT_FALSE(AxesFromOrientation("XY"));
}

TEST(Mp4Box, FindsBoxesByPathAndSurvivesNonsense) {
  const auto box = [](const std::string& name, const std::string& content) {
    return BigEndianBytes(8 + content.size(), 4) + name + content;
  };
  const RecordingFolder folder;
  const std::string large = BigEndianBytes(1, 4) + "mdat" + BigEndianBytes(16 + 5, 8) + "abcde";
  const std::string moov = box("moov", box("udta", box("FIRM", "HD5") + box("GPMF", "payload")));
  folder.Write("a.mp4", box("ftyp", "mp41") + large + moov);
  const auto content = ReadMp4Box(folder.File("a.mp4"), {"moov", "udta", "GPMF"});
  ASSERT_TRUE(content);
  EXPECT_EQ(std::string(content->begin(), content->end()), "payload");
  EXPECT_FALSE(ReadMp4Box(folder.File("a.mp4"), {"moov", "GPMF"}));
  EXPECT_FALSE(ReadMp4Box(folder.File("none.mp4"), {"moov"}));

  folder.Write("b.mp4", BigEndianBytes(3, 4) + "moov");  // smaller than its header
  EXPECT_FALSE(ReadMp4Box(folder.File("b.mp4"), {"udta"}));
  folder.Write("c.mp4", BigEndianBytes(99, 4) + "moov");  // longer than the file
  EXPECT_FALSE(ReadMp4Box(folder.File("c.mp4"), {"moov"}));
}

TEST(SampleClock, FindsTheLineThroughRegularLumps) {
  std::vector<SampleLump> lumps;
  for (int i = 0; i < 20; ++i) lumps.push_back({200 * i, 0.25 + 200 * i * 0.005});
  const auto clock = FitSampleClock(lumps);
  ASSERT_TRUE(clock);
  EXPECT_NEAR(clock->interval_s, 0.005, 1e-12);
  EXPECT_NEAR(clock->origin_s, 0.25, 1e-9);
  EXPECT_LT(clock->largest_deviation_s, 1e-9);
}

TEST(SampleClock, IsHardlyTurnedByALumpThatIsFarOff) {
  std::vector<SampleLump> lumps;
  for (int i = 0; i < 12; ++i) lumps.push_back({200 * i, 200 * i * 0.005});
  lumps[0].start_s -= 0.08;
  const auto clock = FitSampleClock(lumps);
  ASSERT_TRUE(clock);
  // Least squares would move the rate by 80 ms * 5.5 / 143 = 3.1 ms per lump, i.e. 0.3 %. With its
  // influence bounded by b = 1.5 intervals = 7.5 ms, and its leverage of h = 1/12 + 5.5^2/143,
  // the first lump pulls the line by b h / (1 - h) = 3.1 ms there, and the rate by a tenth.
  EXPECT_NEAR(clock->interval_s, 0.005, 0.005 * 0.0005);
  EXPECT_EQ(clock->largest_deviation_lump, 0);
  EXPECT_NEAR(clock->largest_deviation_s, 0.08 - 0.003138, 1e-5);
}

TEST(SampleClock, RefusesWhatIsNoClock) {
  EXPECT_FALSE(FitSampleClock({}));
  EXPECT_FALSE(FitSampleClock({{0, 0.0}}));
  EXPECT_FALSE(FitSampleClock({{0, 0.0}, {0, 1.0}}));    // a lump without samples
  EXPECT_FALSE(FitSampleClock({{0, 1.0}, {200, 1.0}}));  // time stands still
}

}  // namespace
}  // namespace camgyro
