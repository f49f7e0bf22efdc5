// Through the calibrator, as a producer sees them.
#include "camgyro/stream_checks.h"

#include <gmock/gmock.h>

#include <cstdint>
#include <limits>
#include <vector>

#include "tests/camgyro/feed_calibrator.h"

namespace camgyro::api {
namespace {

TEST(StreamChecks, RefuseBadSamplesByTheirKind) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const simulation::Scenario scenario = LivelyScenario(1.0);
  const auto calibrator = Make(OptionsFor(scenario));
  Calibrator* c = calibrator.get();
  EXPECT_EQ(c->AddGyro(1000, 0, 0, 0), AddResult::kAccepted);
  EXPECT_EQ(c->AddGyro(1000, 1, 2, 3), AddResult::kDuplicate);
  EXPECT_EQ(c->AddGyro(999, 0, 0, 0), AddResult::kOutOfOrder);
  EXPECT_EQ(c->AddGyro(2000, 0, kNan, 0), AddResult::kNotFinite);
  EXPECT_EQ(c->AddGyro(2000, 0, 1e5, 0), AddResult::kOutOfRange);
  EXPECT_EQ(c->AddGyro(std::numeric_limits<int64_t>::max(), 0, 0, 0), AddResult::kOutOfRange);
  EXPECT_EQ(c->AddGyro(2000, 0, 0, 0), AddResult::kAccepted);  // nothing of it stuck
  EXPECT_EQ(c->AddAccel(5, 0, 0, 9.8), AddResult::kAccepted);
  EXPECT_EQ(c->AddAccel(5, 0, 0, 9.8), AddResult::kDuplicate);
  EXPECT_EQ(c->AddAccel(6, 0, 0, 1e9), AddResult::kOutOfRange);

  const TrackPoint good[] = {{7, 10.0, 20.0}, {3, 30.0, 40.0}};
  const TrackPoint twice[] = {{7, 10.0, 20.0}, {7, 30.0, 40.0}};
  const TrackPoint far[] = {{7, 1e7, 20.0}};
  const TrackPoint nan[] = {{7, kNan, 20.0}};
  EXPECT_EQ(c->AddTracks(100, good, 2), AddResult::kAccepted);
  EXPECT_EQ(c->AddTracks(100, good, 2), AddResult::kDuplicate);
  EXPECT_EQ(c->AddTracks(50, good, 2), AddResult::kOutOfOrder);
  EXPECT_EQ(c->AddTracks(200, twice, 2), AddResult::kOutOfRange);
  EXPECT_EQ(c->AddTracks(200, far, 1), AddResult::kOutOfRange);
  EXPECT_EQ(c->AddTracks(200, nan, 1), AddResult::kNotFinite);
  EXPECT_EQ(c->AddTracks(200, nullptr, 3), AddResult::kOutOfRange);
  EXPECT_EQ(c->AddTracks(200, nullptr, 0), AddResult::kAccepted);  // a frame without features
  const std::vector<std::uint8_t> pixels(720 * 480);
  EXPECT_EQ(c->AddImage(300, {pixels.data(), 720, 480, 720}), AddResult::kOutOfRange);
  EXPECT_EQ(c->AddImage(300, {pixels.data(), 640, 480, 640}), AddResult::kWrongSize);
  EXPECT_EQ(c->AddImage(300, {nullptr, 720, 480, 720}), AddResult::kWrongSize);
  EXPECT_EQ(c->AddImage(300, {pixels.data(), 720, 480, 100}), AddResult::kWrongSize);
}

}  // namespace
}  // namespace camgyro::api
