// What the simulator knows of an effect of the catalogue: one struct per file of this folder,
// listed in all_effects.h. (The simulator shares nothing with core/effects: the two must be able to
// disagree.)
//
// A struct holds the effect's keys, at values that switch it off, and has these members:
//
// - static constexpr char kName[]: its section in a scenario's `effects:`, as in the catalogue;
// - template <typename Section> void Read(Section* section): reads the keys of that section;
// - bool active() const: is it switched on?
// - TruthParameters Truth() const: what truth.yaml says of it.
//
// It also has those of the following that it changes, each const and adding to what is there:
//
// - void AddDelay(const FrameClock&, double* delay_s)
// - void AddFocal(double time_s, double* focal_px)
// - void AddRateMatrix(Eigen::Matrix3d* reading_by_rate)
// - void AddRate(const RateInput&, Eigen::Vector3d* reading_rad_s)
// - void AddBias(double time_s, Eigen::Vector3d* bias_rad_s)
//
// Lenses, filters, stabilisers and the order of readout are parts of the camera or the gyro
// themselves (camera.cc, gyro.cc), which read the struct.
#ifndef CAMGYRO_SIMULATION_EFFECTS_SIMULATED_EFFECT_H_
#define CAMGYRO_SIMULATION_EFFECTS_SIMULATED_EFFECT_H_

#include <Eigen/Core>
#include <vector>

namespace camgyro::simulation {

// Allowed values of a key.
enum class Range { kAny, kPositive, kNotNegative, kFraction /* 0 to 1 */ };

struct TruthParameter {
  const char* name;
  const char* unit;
  double value;
};
using TruthParameters = std::vector<TruthParameter>;

// A frame as its delay may depend on it. Seconds after the first gyro stamp.
struct FrameClock {
  double time_s;  // of the first row, without effects
  double exposure_s;
};

// A sample of the gyro. Gyro frame.
struct RateInput {
  double time_s;
  Eigen::Vector3d force_m_s2;  // specific force
};

// Calls of a hook, if the effect has it (the int is the better match for a 0).
template <typename E>
auto CallAddDelay(const E& effect, const FrameClock& frame, double* delay_s, int)
    -> decltype(effect.AddDelay(frame, delay_s)) {
  effect.AddDelay(frame, delay_s);
}
template <typename E>
void CallAddDelay(const E&, const FrameClock&, double*, long) {}

template <typename E>
auto CallAddFocal(const E& effect, double time_s, double* focal_px, int)
    -> decltype(effect.AddFocal(time_s, focal_px)) {
  effect.AddFocal(time_s, focal_px);
}
template <typename E>
void CallAddFocal(const E&, double, double*, long) {}

template <typename E>
auto CallAddRateMatrix(const E& effect, Eigen::Matrix3d* reading_by_rate, int)
    -> decltype(effect.AddRateMatrix(reading_by_rate)) {
  effect.AddRateMatrix(reading_by_rate);
}
template <typename E>
void CallAddRateMatrix(const E&, Eigen::Matrix3d*, long) {}

template <typename E>
auto CallAddRate(const E& effect, const RateInput& input, Eigen::Vector3d* reading_rad_s, int)
    -> decltype(effect.AddRate(input, reading_rad_s)) {
  effect.AddRate(input, reading_rad_s);
}
template <typename E>
void CallAddRate(const E&, const RateInput&, Eigen::Vector3d*, long) {}

template <typename E>
auto CallAddBias(const E& effect, double time_s, Eigen::Vector3d* bias_rad_s, int)
    -> decltype(effect.AddBias(time_s, bias_rad_s)) {
  effect.AddBias(time_s, bias_rad_s);
}
template <typename E>
void CallAddBias(const E&, double, Eigen::Vector3d*, long) {}

}  // namespace camgyro::simulation

#endif  // CAMGYRO_SIMULATION_EFFECTS_SIMULATED_EFFECT_H_
