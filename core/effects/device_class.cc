#include "core/effects/device_class.h"

namespace camgyro {

// A range "+-x" of a data sheet is taken as three standard deviations. Looked up for this table
// were the data sheets of MPU-6050 (PS-MPU-6000A revision 3.4, table 6.1), ADIS16445 (revision F;
// the gyro of ADIS16448) and ICG-20660, and Bosch's figure for BMG160. The figures of other devices
// are from experience with them, and the rows that name none are estimates.
const std::vector<UsualEffect>& UsualEffects() {
  static const std::vector<UsualEffect> effects = {
      // effect, shape, {phone, action camera, industrial}, source
      {"gyro_scale",
       "constant",
       {0.01, 0.01, 0.004},
       "sensitivity in data sheets: MPU-6050, MPU-9250 and ICG-20660 +-3 %, ADIS16448 +-1 %"},
      {"gyro_misalignment",
       "constant",
       {0.007, 0.007, 0.001},
       "cross-axis sensitivity in data sheets: MPU-6050 and MPU-9250 +-2 %, ADIS16445 0.05 deg"},
      {"radial_distortion",
       "radtan",
       {0.03, 0.05, 0.02},
       "what is left of a lens that the maker corrects or the user has not declared; lenses of "
       "action cameras in their linear mode"},
      {"tangential_distortion",
       "radtan",
       {0.001, 0.001, 0.0005},
       "p1, p2 of published calibrations: EuRoC 2e-4 to 2e-5, TUM-VI below 1e-3"},
      {"aspect_ratio",
       "constant",
       {0.002, 0.005, 0.001},
       "fx/fy - 1 of published calibrations: EuRoC 0.003, TUM-VI 0.0002; modes that crop or scale "
       "to a whole number of lines change it by some lines of a thousand"},
      {"focal_drift",
       "linear",
       {0.02, 0.005, 0.005},
       "a lens of 1500 px that breathes by 0.1 % in a minute; fixed lenses drift by their warming"},
      {"clock_skew", "constant", {50.0, 50.0, 50.0}, "two crystals of +-20 to +-50 ppm"},
      {"delay_wander",
       "curve",
       {2e-4, 1e-4, 5e-5},
       "assumed: of our recordings none tells it from other causes of a delay that moves"},
      {"readout_nonlinear",
       "bend",
       {1e-4, 1e-4, 5e-5},
       "blanking and black lines at either end of a readout of 10 to 30 ms"},
      {"readout_direction", "columns", {2e-5, 2e-5, 2e-5}, "the readout of one row: 10 to 30 us"},
      {"exposure_delay",
       "factor",
       {0.3, 0.3, 0.1},
       "stamps at the start (0.5), the middle (0) or the end of the exposure (-0.5), unknown "
       "which"},
      {"exposure_lowpass",
       "constant",
       {1e-4, 5e-5, 2e-5},
       "the square of an exposure of 10 ms, 7 ms and 4.5 ms"},
      {"exposure_lowpass",
       "recorded",
       {1.0, 1.0, 1.0},
       "the picture's own averaging over the exposure that the file records"},
      {"gyro_lowpass",
       "first_order",
       {1e-5, 4e-6, 4e-6},
       "the square of the time constant of a filter of 50 Hz (3.2 ms) and of 80 Hz (2 ms)"},
      {"gyro_axis_delay",
       "constant",
       {1e-4, 5e-5, 2e-5},
       "axes that are converted one after the other within a sample of 1 to 8 kHz"},
      {"bias_drift",
       "linear",
       {2e-5, 2e-5, 5e-6},
       "BMG160 0.015, MPU-6050 0.16 deg/s per K, at some K per minute after switching on"},
      {"gyro_g_sensitivity",
       "diagonal",
       {2e-4, 2e-4, 3e-5},
       "linear acceleration effect in data sheets: MPU-6050 0.1 deg/s per g, ADIS16445 0.015"},
      {"attitude_rolling_shutter",
       "rows",
       {0.01, 0.006, 0.002},
       "what a readout of 23, 14 and 5 ms leaves in attitudes that do not model it: 0.44 of it "
       "(docs/lab/attitudes.md)"},
  };
  return effects;
}

bool IsDeclared(const UsualEffect& usual, DistortionModel declared) {
  const std::string effect = usual.effect;
  return declared != DistortionModel::kNone &&
         (effect == "radial_distortion" || effect == "tangential_distortion");
}

const char* DeviceClassName(DeviceClass device) {
  switch (device) {
    case DeviceClass::kPhone:
      return "phone";
    case DeviceClass::kActionCamera:
      return "action";
    case DeviceClass::kIndustrial:
      return "industrial";
  }
  return "";
}

Result<DeviceClass> DeviceClassOf(const std::string& name) {
  for (const auto device :
       {DeviceClass::kPhone, DeviceClass::kActionCamera, DeviceClass::kIndustrial}) {
    if (name == DeviceClassName(device)) return device;
  }
  return BadUsage("expected phone, action or industrial");
}

}  // namespace camgyro
