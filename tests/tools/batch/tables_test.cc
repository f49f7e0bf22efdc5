// The tables of a device one of whose recordings is of another focus, and of one that failed.
#include "tools/batch/tables.h"

#include <gmock/gmock.h>

namespace camgyro::batch {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

BatchResult Calibrated(const std::string& name, double focal_px) {
  BatchResult result;
  result.recording = {"phone", "/data/" + name, "phone/" + name};
  CalibrationReport report;
  Calibration& c = report.calibration;
  c.width_px = 640;
  c.height_px = 480;
  c.lens = MakePinhole(focal_px, {319.5, 239.5});
  c.covariance = StateCovariance::Identity() * 1e-6;
  c.covariance(kStateFocal, kStateFocal) = 0.25;
  c.determined.fill(true);
  report.prior.mean = c;
  report.prior.sigma.setConstant(1e3);
  result.report = report;
  return result;
}

BatchDevice Device() {
  BatchDevice device;
  device.name = "phone";
  device.results = {Calibrated("a", 500.0), Calibrated("b", 500.25), Calibrated("c", 499.75),
                    Calibrated("zoomed", 520.0), Calibrated("d", 500.0)};
  BatchResult failed;
  failed.recording = {"phone", "/data/e", "phone/e"};
  failed.outcome = {"", 3, "imu0/data.csv:3: '</td><script>\"' was found", 0.0};
  failed.left_out = "not calibrated";
  device.results.insert(device.results.begin() + 1, failed);
  std::vector<std::string> names;
  std::vector<const CalibrationReport*> reports;
  for (const BatchResult& result : device.results) {
    if (!result.report) continue;
    names.push_back(result.recording.folder.substr(6));
    reports.push_back(&*result.report);
  }
  device.combined = CombineToDevice(names, reports, /*attitudes=*/false).value();
  return device;
}

TEST(BatchTables, NameWhatTheOthersContradict) {
  const BatchDevice device = Device();
  const std::string recordings = RecordingsCsv({device});
  EXPECT_THAT(recordings, HasSubstr("\nphone,/data/zoomed,phone/zoomed,0,true,focal_px,520,0.5,,"));
  EXPECT_THAT(recordings, HasSubstr("\nphone,/data/d,phone/d,0,true,,500,0.5,,"));
  EXPECT_THAT(recordings, HasSubstr("\nphone,/data/e,phone/e,3,false,,,"));
  const std::string parameters = DeviceCsv(device);
  // The mean of five; the others repeat it better than their noise lets expect.
  EXPECT_THAT(parameters, HasSubstr("\nfocal_px,504,"));
  EXPECT_THAT(parameters, HasSubstr(",zoomed\n"));
  EXPECT_THAT(DevicePage(device),
              AllOf(HasSubstr("yes, but the others contradict it: focal_px is 3"),
                    HasSubstr("5 of 6 recordings are part of this device")));
}

// A complaint quotes what a file holds.
TEST(BatchTables, TextIsNothingElse) {
  const BatchDevice device = Device();
  EXPECT_THAT(RecordingsCsv({device}),
              HasSubstr(",\"imu0/data.csv:3: '</td><script>\"\"' was found\"\n"));
  EXPECT_THAT(DevicePage(device), AllOf(HasSubstr("&lt;/td&gt;&lt;script&gt;&quot;"),
                                        Not(HasSubstr("'</td><script>"))));
}

TEST(BatchTables, OfADeviceWithoutACalibration) {
  BatchDevice device = Device();
  device.combined.reset();
  device.results = {device.results[1]};
  EXPECT_EQ(DeviceCsv(device).find('\n'), DeviceCsv(device).size() - 1);  // the header alone
  EXPECT_THAT(RecordingsCsv({device}), HasSubstr("phone/e,3,false"));
  EXPECT_THAT(DevicePage(device), HasSubstr("0 of 1 recordings"));
}

}  // namespace
}  // namespace camgyro::batch
