// What a calibration's report says about the result itself.
#ifndef CAMGYRO_TOOLS_REPORT_CALIBRATION_SECTIONS_H_
#define CAMGYRO_TOOLS_REPORT_CALIBRATION_SECTIONS_H_

#include <string>
#include <utility>
#include <vector>

#include "core/recording.h"
#include "estimator/calibrate.h"
#include "tools/report/page.h"

namespace camgyro {

// Verdict in plain words, every parameter with its sigma, doubts, notes, and what was found in the
// data (Recording::notes: its faults, and how it was read). The cells of the table
// carry the keys of calibration.yaml ("clock.delay_s.value", "gyro.bias_rad_s.sigma.2") and its
// numbers.
ReportSection SummarySection(const Recording& recording, const CalibrationReport& report,
                             bool attitudes);

// How much the recording narrowed each parameter, how the camera turned meanwhile, and which motion
// would determine the rest.
ReportSection MotionSection(const Recording& recording, const CalibrationReport& report,
                            bool attitudes);

// Every parameter over time with +-3 sigma, as in figures 5 and 6 of Jia & Evans. Without an online
// pass it says so.
ReportSection ConvergenceSection(const CalibrationReport& report);

// Residual over delay with minimum and runner-up, as in figure 5 of Feng et al.
ReportSection DelaySection(const StartResult& start);

// Noise, rms and chi2, of the frames fitted and of frames not seen.
ReportSection FitSection(const CalibrationReport& report, bool attitudes);

// How to get the same result again. No time of day: the same run gives the same bytes.
struct RunInfo {
  std::string command_line;
  std::string recording;  // what it holds, in one line
  std::vector<std::pair<std::string, std::string>> options;
  std::string result_yaml;  // the file, word by word
  std::string result_name = "calibration.yaml";
};
ReportSection ReproductionSection(const RunInfo& run);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_CALIBRATION_SECTIONS_H_
