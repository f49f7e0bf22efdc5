// realtime RECORDING [SPEED]: feeds a recording at the pace of real time (times SPEED), prints what
// is ready and when, and starts a VIO at the end. Exit code 0 once there is an estimate.
#include <camgyro/calibrator.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>

#include "feed.h"
#include "frontend/readers/read_recording.h"

using namespace camgyro::api;

namespace {

void Print(double time_s, const Snapshot& snapshot) {
  std::cout << time_s << " s: ";
  if (!snapshot.has_estimate) {
    std::cout << snapshot.message << std::endl;
    return;
  }
  int ready = 0;
  std::string open;
  for (int i = 0; i < kParameters; ++i) {
    const Readiness readiness = snapshot.parameters[i].readiness;
    if (readiness == Readiness::kReady) {
      ++ready;
    } else {
      open += std::string(", ") + ParameterName(i) + " " + ToString(readiness);
    }
  }
  std::cout << "delay " << 1e3 * snapshot.parameters[kDelay].value << " +- "
            << 1e3 * snapshot.parameters[kDelay].sigma << " ms, " << ready << " of " << kParameters
            << " ready" << open << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::cerr << "usage: realtime RECORDING [SPEED]\n";
    return 2;
  }
  const double speed = argc == 3 ? std::atof(argv[2]) : 1.0;
  if (!(speed > 0.0)) {
    std::cerr << "SPEED: expected a positive number\n";
    return 2;
  }
  const auto recording = camgyro::ReadRecording(argv[1]);
  CalibratorOptions options;
  std::string error = recording ? "no size of the pictures is declared" : recording.error().message;
  if (!recording || !GuessFrom(*recording, &options.camera)) {
    std::cerr << error << "\n";
    return 3;
  }
  const auto calibrator = Calibrator::Create(options, &error);
  if (calibrator == nullptr) {
    std::cerr << error << "\n";
    return 3;
  }
  const auto begin = std::chrono::steady_clock::now();
  double next_print_s = 1.0;
  const bool fed = Feed(*recording, calibrator.get(), [&](double time_s) {
    std::this_thread::sleep_until(begin + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                              std::chrono::duration<double>(time_s / speed)));
    if (time_s >= next_print_s) {
      Print(time_s, *calibrator->snapshot());
      next_print_s += 1.0;
    }
    return true;
  });
  if (!fed || !calibrator->WaitUntilIdle(120.0)) return 1;
  const auto last = calibrator->snapshot();
  Print(1e-9 * static_cast<double>(recording->frames.back().stamp_ns -
                                   recording->frames.front().stamp_ns),
        *last);
  if (last->frames_dropped > 0) {
    std::cout << last->frames_dropped << " frames came faster than they could be tracked\n";
  }
  const VinsStart start = calibrator->InitialiseVins({});
  std::cout << "VIO: " << ToString(start.verdict) << " (" << start.explanation << ")\n";
  return last->has_estimate ? 0 : 4;
}
