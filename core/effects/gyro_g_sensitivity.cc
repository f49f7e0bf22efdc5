// A gyro that feels forces: its proof mass, or the glue under it, gives way to them.
#include <algorithm>
#include <memory>
#include <vector>

#include "core/effects/entries.h"

namespace camgyro {
namespace {

// reading = rate + K f, f the specific force in the gyro frame; what gravity adds on average is
// part of the bias. Data sheets have 0.1 deg/s per g (1.8e-4 rad s/m), cheap parts several times
// as much.
class GyroGSensitivity final : public Effect {
 public:
  // full: all nine factors, else those of an axis on itself.
  GyroGSensitivity(const EffectSetup& setup, bool full)
      : Effect(Parameters(full)),
        accel_(setup.accel),
        mean_m_s2_(setup.accel->values.rowwise().mean()) {}
  void ChangeRate(double time_s, const Eigen::Vector3d&, RateColumns columns) const override {
    const Eigen::Vector3d f = ForceAt(time_s);
    if (columns.cols() == 3) {
      columns = f.asDiagonal();
      return;
    }
    for (Eigen::Index k = 0; k < 3; ++k) columns.block<1, 3>(k, 3 * k) = f.transpose();
  }

 private:
  static std::vector<EffectParameter> Parameters(bool full) {
    constexpr double kSpread = 1e-3, kPlausible = 5e-3;  // [rad s/m]
    std::vector<EffectParameter> parameters;
    for (const char* of : {"x", "y", "z"}) {
      for (const char* by : {"x", "y", "z"}) {
        if (!full && of != std::string(by)) continue;
        const std::string name = full ? std::string(of) + "_by_" + by : of;
        parameters.push_back({name, "rad s/m", kSpread, -kPlausible, kPlausible});
      }
    }
    return parameters;
  }

  // Its difference from the mean, linear between samples and held at the ends.
  Eigen::Vector3d ForceAt(double time_s) const {
    const std::vector<double>& times_s = accel_->times_s;
    const auto next = std::lower_bound(times_s.begin(), times_s.end(), time_s);
    if (next == times_s.begin()) return Change(0);
    const Eigen::Index i = next - times_s.begin();
    if (next == times_s.end()) return Change(i - 1);
    const double u = (time_s - *(next - 1)) / (*next - *(next - 1));
    return (1.0 - u) * Change(i - 1) + u * Change(i);
  }

  Eigen::Vector3d Change(Eigen::Index i) const { return accel_->values.col(i) - mean_m_s2_; }

  const std::shared_ptr<const SensorSamples> accel_;
  const Eigen::Vector3d mean_m_s2_;
};

// Samples at 20 Hz or more while the frames are taken: slower ones miss the forces of a step.
bool HasForces(const EffectSetup& setup) {
  constexpr double kSlowestHz = 20.0;
  const std::vector<double>& times_s = setup.accel->times_s;
  if (times_s.size() < 2) return false;
  const double rate_hz =
      static_cast<double>(times_s.size() - 1) / (times_s.back() - times_s.front());
  return rate_hz >= kSlowestHz && times_s.front() <= setup.from_s() + 1.0 &&
         times_s.back() >= setup.to_s() - 1.0;
}

}  // namespace

// Shapes: matrix (nine factors), diagonal (three).
EffectEntry GyroGSensitivityEntry() {
  EffectEntry entry = {"gyro_g_sensitivity", ModelPart::kRate,
                       "the gyro feels forces: gravity and shocks add to its reading",
                       "subtract the factors times the accelerometer's reading from the rates; "
                       "mount the device more softly"};
  entry.shapes = [](const EffectSetup& setup) {
    return HasForces(setup) ? std::vector<std::string>{"matrix", "diagonal"}
                            : std::vector<std::string>{};
  };
  entry.make = [](const EffectSetup& setup,
                  const std::string& shape) -> std::shared_ptr<const Effect> {
    if (!HasForces(setup) || (shape != "diagonal" && shape != "matrix")) return nullptr;
    return std::make_shared<GyroGSensitivity>(setup, shape == "matrix");
  };
  return entry;
}

}  // namespace camgyro
