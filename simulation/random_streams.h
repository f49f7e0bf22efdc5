// Random numbers of the simulator.
#ifndef CAMGYRO_SIMULATION_RANDOM_STREAMS_H_
#define CAMGYRO_SIMULATION_RANDOM_STREAMS_H_

#include <cmath>
#include <cstdint>
#include <random>

#include "simulation/scenario.h"

namespace camgyro::simulation {

// One stream of random numbers per purpose: switching one thing on leaves the others as they are.
enum Stream : uint32_t {
  kMotionStream,
  kSceneStream,
  kGyroStream,
  kFrameStream,
  kTrackStream,
  kWanderStream,
  kNoiseStream,
  kAttitudeStream
};

inline std::mt19937_64 MakeRandom(uint64_t seed, Stream stream) {
  std::seed_seq sequence{static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32),
                         static_cast<uint32_t>(stream)};
  return std::mt19937_64(sequence);
}

// A number for each frame, of mean 0 and standard deviation 1, that neighbours share: its
// correlation falls by a factor of e over the memory.
class Wander {
 public:
  Wander(const Scenario& scenario, double memory_s, Stream stream)
      : kept_(std::exp(-1.0 / (scenario.camera.rate_hz * memory_s))),
        random_(MakeRandom(scenario.seed, stream)),
        value_(normal_(random_)) {}
  // Of the next frame.
  double Next() {
    const double value = value_;
    value_ = kept_ * value_ + std::sqrt(1.0 - kept_ * kept_) * normal_(random_);
    return value;
  }

 private:
  const double kept_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double value_;
};

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_RANDOM_STREAMS_H_
