// What a person reads in the terminal after a calibration.
#ifndef CAMGYRO_TOOLS_SUMMARY_H_
#define CAMGYRO_TOOLS_SUMMARY_H_

#include <string>
#include <vector>

#include "core/recording.h"
#include "estimator/calibrate.h"
#include "frontend/track_recording.h"
#include "pipeline/device.h"

namespace camgyro {

// Each parameter with value, sigma, unit, and whether this motion determined it.
std::string ParameterTable(const Calibration& calibration, bool attitudes);

// What the error in all is made of beside noise, by parameter; empty where it is not known.
std::string SystematicLine(const CalibrationReport& report);

// Several recordings: the device's parameters, how well the recordings repeat each, and which of
// them are odd.
std::string DeviceTable(const DeviceReport& device);

// Matches, their motion, outliers.
std::string MotionLine(const Recording& recording, const TrackingSummary& tracking);

// The start: delay of the middle row, how much it explains, how unique it is.
std::string StartLine(const StartResult& start);

// Residuals, inliers, unseen frames.
std::string QualityLine(const CalibrationReport& report, bool attitudes);

// That the two halves of the recording agree, by `chi2` per parameter (CalibrationReport::
// halves_chi2). Empty where the recording is too short to tell, and where they
// do not agree: a doubt says that.
std::string HalvesLine(double chi2);

// Seconds per stage, and per frame of the online pass.
std::string TimeLine(const std::vector<StageTime>& times, double tracking_s, size_t frames);

// "  note: ..." lines, wrapped; empty without notes.
std::string Notes(const char* label, const std::vector<std::string>& notes);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_SUMMARY_H_
