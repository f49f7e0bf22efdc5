#include "core/state.h"

namespace camgyro {
namespace {

constexpr double kDegrees = 57.29577951308232;

constexpr StateWidth Of(StateUnit unit, double share) { return {share, unit}; }
constexpr StateWidth Plain(double value) { return {value, StateUnit::kOne}; }

constexpr StateParameter Centre(const char* name, const char* label, const char* symbol) {
  return {name,
          name,
          label,
          "px",
          1.0,
          symbol,
          "px",
          1.0,
          /*needs_pixels=*/true,
          /*needs_fit=*/true,
          Of(StateUnit::kPictureDiagonal, 0.02),
          Of(StateUnit::kPictureDiagonal, 0.02),
          Of(StateUnit::kPictureWidth, 0.02)};
}

constexpr StateParameter Bias(const char* name, const char* long_name, const char* label,
                              const char* symbol) {
  return {name,
          long_name,
          label,
          "deg/s",
          kDegrees,
          symbol,
          "mrad/s",
          1e3,
          /*needs_pixels=*/false,
          /*needs_fit=*/false,
          Plain(0.1),
          Plain(0.1),
          Plain(0.02)};
}

constexpr StateParameter Rotation(const char* name, const char* long_name, const char* label) {
  return {name,
          long_name,
          label,
          "deg",
          kDegrees,
          name,
          "mrad",
          1e3,
          /*needs_pixels=*/false,
          /*needs_fit=*/true,
          Plain(0.15),
          Plain(0.15),
          Plain(0.03)};
}

// f: 15 % around a declared value is what phones' declarations are off by, 30 % what the scan for a
// start may be. c: real lenses stay within a few percent of the diagonal. t_r: from no readout at
// all to the whole interval. t_d: the correlation that finds it is good to a frame or two.
constexpr std::array<StateParameter, kStateSize> kTable = {
    {{"focal_px", "focal_px", "focal length", "px", 1.0, "f", "px", 1.0,
      /*needs_pixels=*/true, /*needs_fit=*/true, Of(StateUnit::kFocal, 0.15),
      Of(StateUnit::kFocal, 0.30), Of(StateUnit::kFocal, 0.05)},
     Centre("cx_px", "principal point x", "c_x"),
     Centre("cy_px", "principal point y", "c_y"),
     {"readout_s", "readout_s", "readout time", "ms", 1e3, "t_r", "ms", 1e3,
      /*needs_pixels=*/true, /*needs_fit=*/true, Plain(5e-3), Of(StateUnit::kFrameInterval, 0.6),
      Plain(3e-3)},
     {"delay_s", "delay_s", "delay of row 0", "ms", 1e3, "t_d", "ms", 1e3,
      /*needs_pixels=*/false, /*needs_fit=*/false, Plain(0.05), Plain(0.05), Plain(3e-3)},
     Bias("bias_x", "bias_x_rad_s", "gyro bias x", "b_x"),
     Bias("bias_y", "bias_y_rad_s", "gyro bias y", "b_y"),
     Bias("bias_z", "bias_z_rad_s", "gyro bias z", "b_z"),
     Rotation("q_x", "rotation_x_rad", "mounting, about x"),
     Rotation("q_y", "rotation_y_rad", "mounting, about y"),
     Rotation("q_z", "rotation_z_rad", "mounting, about z")}};

}  // namespace

double StateWidth::In(const StateScales& scales) const {
  switch (of) {
    case StateUnit::kOne:
      return value;
    case StateUnit::kFocal:
      return value * scales.focal_px;
    case StateUnit::kPictureWidth:
      return value * scales.width_px;
    case StateUnit::kPictureDiagonal:
      return value * scales.diagonal_px;
    case StateUnit::kFrameInterval:
      return value * scales.frame_interval_s;
  }
  return value;
}

const std::array<StateParameter, kStateSize>& StateTable() { return kTable; }

const std::array<std::string, kStateSize>& StateNames() {
  static const std::array<std::string, kStateSize> names = [] {
    std::array<std::string, kStateSize> column;
    for (size_t i = 0; i < kStateSize; ++i) column[i] = kTable[i].name;
    return column;
  }();
  return names;
}

}  // namespace camgyro
