#include "tools/fit_flags.h"

#include <gflags/gflags.h>

#include <regex>

namespace {

// A flag keeps the address of its help.
const char* ResidualHelp() {
  static const std::string help =
      "image residual of window and refinement: " + camgyro::HelpOfResiduals();
  return help.c_str();
}

}  // namespace

DEFINE_string(residual, "plane", ResidualHelp());
DEFINE_string(
    device, "phone",
    "what the camera and the gyro are: phone, action or industrial; it says how large the "
    "effects are that nobody has declared, for the error in all");
DEFINE_bool(robust, true, "no robust loss in window and refinement: plain least squares");

DEFINE_string(effects, "",
              "effects to fit as well, separated by commas, each with a shape after a colon if it "
              "has several: radial_distortion,focal_drift:linear (names: docs/effects.md); usual: "
              "all that such a --device usually has, each held near its usual size");

namespace camgyro {

std::vector<std::string> FitFlags() { return {"residual", "robust"}; }

Result<DeviceClass> DeviceFromFlag() {
  Result<DeviceClass> device = DeviceClassOf(FLAGS_device);
  if (!device) return BadUsage("--device=" + FLAGS_device + ": " + device.error().message);
  return device;
}

std::string EffectsFromFlag(DeviceClass device) {
  return std::regex_replace(FLAGS_effects, std::regex("\\busual\\b(?!:)"),
                            std::string("usual:") + DeviceClassName(device));
}

Status ReadFitFlags(PairGraphOptions* options) {
  const Result<const PairResidual*> residual = FindResidual(FLAGS_residual);
  if (!residual) return tl::unexpected(residual.error());
  options->residual = *residual;
  if (!FLAGS_robust) options->robust_threshold = 0.0;
  return {};
}

}  // namespace camgyro
