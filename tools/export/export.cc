#include "tools/export/export.h"

namespace camgyro {

const std::vector<ExportFormat>& ExportFormats() {
  static const std::vector<ExportFormat> formats = {
      {"kalibr", "Kalibr", ExportKalibr},
      {"vins_mono", "VINS-Mono", ExportVinsMono},
      {"vins_fusion", "VINS-Fusion", ExportVinsFusion},
      {"openvins", "OpenVINS", ExportOpenVins},
      {"gyroflow", "Gyroflow", ExportGyroflow},
      {"euroc", "EuRoC/ASL sensor.yaml", ExportEuroc},
      {"json", "plain JSON", ExportJson},
  };
  return formats;
}

}  // namespace camgyro
