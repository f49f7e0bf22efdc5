// What is to be expected of a device whose faults nobody has declared: for each effect of the
// catalogue, the size that devices of a class usually show.
#ifndef CAMGYRO_CORE_EFFECTS_DEVICE_CLASS_H_
#define CAMGYRO_CORE_EFFECTS_DEVICE_CLASS_H_

#include <array>
#include <string>
#include <vector>

#include "core/lens.h"
#include "core/result.h"

namespace camgyro {

enum class DeviceClass {
  kPhone,         // a phone or tablet: consumer gyro, lens undistorted by nobody
  kActionCamera,  // or drone camera: wide lens, consumer gyro
  kIndustrial,    // global or rolling shutter camera with hardware stamps, calibrated gyro
};
constexpr int kDeviceClasses = 3;

// An effect in one shape. Its parameters are independent, around zero.
struct UsualEffect {
  const char* effect;  // of the catalogue
  const char* shape;
  // Standard deviation of each parameter, in its unit, by DeviceClass; 0: such devices have it not.
  std::array<double, kDeviceClasses> sigma;
  const char* source;

  double Sigma(DeviceClass device) const { return sigma[static_cast<size_t>(device)]; }
};

const std::vector<UsualEffect>& UsualEffects();

// A lens whose distortion is declared has no other than that.
bool IsDeclared(const UsualEffect& usual, DistortionModel declared);

// "phone", "action", "industrial".
const char* DeviceClassName(DeviceClass device);
// Errors: kBadUsage with the names that are known.
Result<DeviceClass> DeviceClassOf(const std::string& name);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_EFFECTS_DEVICE_CLASS_H_
