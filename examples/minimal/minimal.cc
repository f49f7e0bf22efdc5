// The least that a program needs: a calibrator, samples in, a snapshot out. A phone that lies still
// on a table: camgyro says that it cannot tell anything yet.
#include <camgyro/calibrator.h>
#include <camgyro/version.h>

#include <cstdint>
#include <iostream>
#include <string>
#include <vector>

int main() {
  using namespace camgyro::api;
  std::cout << "camgyro " << Version() << "\n";
  CalibratorOptions options;
  options.camera.width_px = 320;
  options.camera.height_px = 240;
  std::string error;
  const auto calibrator = Calibrator::Create(options, &error);
  if (calibrator == nullptr) {
    std::cerr << error << "\n";
    return 1;
  }
  // Here from one thread; in an application from the callback of each sensor.
  const std::vector<std::uint8_t> picture(320 * 240, 128);
  for (std::int64_t ms = 0; ms < 1000; ms += 5) {
    if (calibrator->AddGyro(ms * 1'000'000, 0.0, 0.0, 0.0) != AddResult::kAccepted) return 1;
    if (ms % 50 != 0) continue;
    const AddResult added = calibrator->AddImage(ms * 1'000'000, {picture.data(), 320, 240, 320});
    if (added != AddResult::kAccepted) std::cerr << "frame: " << ToString(added) << "\n";
  }
  if (!calibrator->WaitUntilIdle(10.0)) return 1;
  const auto snapshot = calibrator->snapshot();
  std::cout << snapshot->frames << " frames, " << snapshot->message << "\n";
  for (int i = 0; i < kParameters; ++i) {
    std::cout << ParameterName(i) << ": " << ToString(snapshot->parameters[i].readiness) << "\n";
  }
  return snapshot->ready ? 1 : 0;  // nothing can be ready here
}
