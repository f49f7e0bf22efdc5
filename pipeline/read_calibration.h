// Reads a calibration.yaml back (docs/result_format.md).
#ifndef CAMGYRO_PIPELINE_READ_CALIBRATION_H_
#define CAMGYRO_PIPELINE_READ_CALIBRATION_H_

#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/result.h"
#include "estimator/calibrate.h"

namespace camgyro {

// Reads what `calibrate` writes, and a simulator's truth.yaml, which has values without sigmas.
// Needed are `resolution` and `focal_px` of `camera`. The rest may be absent: the principal point
// is then the middle of the picture, the aspect ratio 1, a rotation none, everything else zero. A
// quantity is `{value: V}` or just V. `determined` is true but for what `quality: unobservable`
// names. Keys that are not of Calibration (effects, sigmas beside the covariance) are ignored.
//
// Errors: kBadInput naming file, line and key: not YAML; wrong type, length or range; not finite (a
// calibration from attitudes has no lens); an unknown distortion model.
Result<Calibration> ReadCalibration(const std::string& path);

// The same with what CombineToDevice needs beside: prior, shares of undeclared effects, numbers of
// the fit. Effects that belong to a recording are left aside, and readout_direction, whose
// uncertainty is in the covariance. Errors also: no prior (a file of another program, or of an
// older camgyro); other effects of the device, whose shapes the file does not hold; a covariance
// that is none.
Result<CalibrationReport> ReadCalibrationReport(const std::string& path);

// ReadCalibration for programs that know the readout of rows only. Errors also: columns are read
// (ReadsColumns).
Result<Calibration> ReadCalibrationOfRows(const std::string& path);

// An effect that the file lists: in which shape, and the values of its parameters.
struct ListedEffect {
  std::string name, shape;
  std::vector<double> values;
};

// Those of the file; one that is listed by its name alone has the rest empty. Errors as above.
Result<std::vector<ListedEffect>> ReadEffects(const std::string& path);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_READ_CALIBRATION_H_
