// prepare_vio RECORDING DIR: calibrates, and writes what a VIO needs of it.
// - calibration.yaml is in camgyro's format: `camgyro export` makes VINS-Fusion and OpenVINS files
//   of it.
// - image_times.csv has each frame's time on the gyro's clock: of its first row (for a VIO that
//   knows the rolling shutter) and of its middle row (for one that does not). With these stamps the
//   VIO's td starts at zero.
// - readiness.csv has each parameter with its sigma, and whether it is good enough.
#include <camgyro/calibrator.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "feed.h"
#include "frontend/readers/read_recording.h"

using namespace camgyro::api;

namespace {

std::int64_t OnGyroClock(std::int64_t stamp_ns, const Calibration& c, double row_fraction) {
  return stamp_ns + std::llround(1e9 * (c.delay_s + row_fraction * c.readout_s));
}

// The share of a short recording that the first search for a start gets; a stream would wait
// longer.
constexpr double kMostOfIt = 0.8;

double LengthOf(const camgyro::Recording& recording) {  // [s]
  if (recording.frames.empty()) return 0.0;
  return 1e-9 *
         static_cast<double>(recording.frames.back().stamp_ns - recording.frames.front().stamp_ns);
}

// As in calibration.yaml, in the order of the library's parameters.
constexpr std::array<const char*, kParameters> kNames = {
    "focal_px", "cx_px",  "cy_px", "readout_s", "delay_s", "bias_x",
    "bias_y",   "bias_z", "q_x",   "q_y",       "q_z"};

void WriteMatrix(const char* key, const std::array<double, kParameters * kParameters>& matrix,
                 std::ostream& out) {
  out << "  " << key << ":\n";
  for (int i = 0; i < kParameters; ++i) {
    for (int j = 0; j < kParameters; ++j) {
      out << (j == 0 ? "    - [" : ", ") << matrix[i * kParameters + j];
    }
    out << "]\n";
  }
}

// What the motion did not determine is what was assumed beforehand.
void WriteUndetermined(const Snapshot& snapshot, std::ostream& out) {
  const char* separator = "";
  out << "quality: {unobservable: [";
  for (int i = 0; i < kParameters; ++i) {
    if (snapshot.parameters[i].readiness != Readiness::kUndetermined) continue;
    out << separator << kNames[i];
    separator = ", ";
  }
  out << "]}\n";
}

void WriteCalibration(const Snapshot& snapshot, std::ostream& out) {
  const Calibration& c = snapshot.calibration;
  const auto& p = snapshot.parameters;
  const auto& k = c.distortion;
  const auto& b = c.bias_gyro_rad_s;
  const auto& q = c.q_gyro_cam_wxyz;
  const bool distorted = k[0] != 0.0 || k[1] != 0.0 || k[2] != 0.0 || k[3] != 0.0;
  out.precision(12);
  out << "camera:\n  resolution: [" << c.width_px << ", " << c.height_px << "]\n"
      << "  focal_px: {value: " << c.focal_px << ", sigma: " << p[kFocal].sigma << "}\n"
      << "  principal_px: {value: [" << c.principal_px[0] << ", " << c.principal_px[1]
      << "], sigma: [" << p[kCx].sigma << ", " << p[kCy].sigma << "]}\n"
      << "  aspect_ratio: {value: " << c.aspect_ratio << "}\n"
      << "  distortion: {model: " << (distorted ? "radtan" : "none") << ", value: [";
  if (distorted) out << k[0] << ", " << k[1] << ", " << k[2] << ", " << k[3];
  out << "]}\n"
      << "shutter: {readout_s: {value: " << c.readout_s << ", sigma: " << p[kReadout].sigma
      << "}}\n"
      << "clock: {delay_s: {value: " << c.delay_s << ", sigma: " << p[kDelay].sigma << "}}\n"
      << "gyro: {bias_rad_s: {value: [" << b[0] << ", " << b[1] << ", " << b[2] << "], sigma: ["
      << p[kBiasX].sigma << ", " << p[kBiasY].sigma << ", " << p[kBiasZ].sigma << "]}}\n"
      << "extrinsics: {q_gyro_cam_wxyz: {value: [" << q[0] << ", " << q[1] << ", " << q[2] << ", "
      << q[3] << "], sigma_rad: [" << p[kRotationX].sigma << ", " << p[kRotationY].sigma << ", "
      << p[kRotationZ].sigma << "]}}\n";
  out << "covariance:\n  order: [";
  for (int i = 0; i < kParameters; ++i) out << (i == 0 ? "" : ", ") << kNames[i];
  out << "]\n";
  WriteMatrix("matrix", c.covariance, out);
  // Infinite before the library has looked for undeclared effects.
  if (std::isfinite(c.total_covariance[0])) WriteMatrix("total", c.total_covariance, out);
  WriteUndetermined(snapshot, out);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: prepare_vio RECORDING DIR\n";
    return 2;
  }
  const auto recording = camgyro::ReadRecording(argv[1]);
  CalibratorOptions options;
  std::string error = recording ? "no size of the pictures is declared" : recording.error().message;
  if (!recording || !GuessFrom(*recording, &options.camera)) {
    std::cerr << error << "\n";
    return 3;
  }
  options.start_s = std::clamp(kMostOfIt * LengthOf(*recording), 2.0, options.start_s);
  const auto calibrator = Calibrator::Create(options, &error);
  if (calibrator == nullptr) {
    std::cerr << error << "\n";
    return 3;
  }
  // As fast as the worker follows: no frame is dropped.
  const bool fed =
      Feed(*recording, calibrator.get(), [&](double) { return calibrator->WaitUntilIdle(120.0); });
  if (!fed || !calibrator->WaitUntilIdle(120.0)) return 1;
  const auto snapshot = calibrator->snapshot();
  if (!snapshot->has_estimate) {
    std::cerr << "cannot estimate: " << snapshot->message << "\n";
    return 4;
  }

  const std::filesystem::path folder(argv[2]);
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  std::ofstream calibration(folder / "calibration.yaml"), times(folder / "image_times.csv"),
      readiness(folder / "readiness.csv");
  WriteCalibration(*snapshot, calibration);
  times << "#frame stamp [ns],first row, gyro clock [ns],middle row, gyro clock [ns]\n";
  for (const camgyro::Frame& frame : recording->frames) {
    times << frame.stamp_ns << "," << OnGyroClock(frame.stamp_ns, snapshot->calibration, 0.0) << ","
          << OnGyroClock(frame.stamp_ns, snapshot->calibration, 0.5) << "\n";
  }
  readiness << "#parameter,sigma,wanted sigma,readiness\n";
  for (int i = 0; i < kParameters; ++i) {
    const ParameterState& p = snapshot->parameters[i];
    readiness << ParameterName(i) << "," << p.sigma << "," << p.wanted_sigma << ","
              << ToString(p.readiness) << "\n";
  }
  if (!calibration.flush() || !times.flush() || !readiness.flush()) {
    std::cerr << folder << ": cannot be written\n";
    return 3;
  }
  if (!snapshot->lens.empty()) std::cout << "lens: " << snapshot->lens << "\n";
  if (!snapshot->doubt.empty()) std::cout << "doubt: " << snapshot->doubt << "\n";
  std::cout << (snapshot->ready ? "ready" : "not all parameters are ready: see readiness.csv")
            << "\n";
  return 0;
}
