// The parts of the Python module.
#ifndef CAMGYRO_PYTHON_BINDINGS_H_
#define CAMGYRO_PYTHON_BINDINGS_H_

#include <pybind11/pybind11.h>

#include "core/result.h"

namespace camgyro {

// Recording, read_recording.
void BindRecording(pybind11::module_* module);
// Calibration, CalibrationReport, calibrate, DeviceReport, combine, VinsStart, initialise_vins.
void BindResults(pybind11::module_* module);
// OdometryRun, odometry.
void BindOdometry(pybind11::module_* module);

// Raises camgyro.Error, whose second argument is the exit code of the command line.
[[noreturn]] void Raise(const Error& error);

}  // namespace camgyro

#endif  // CAMGYRO_PYTHON_BINDINGS_H_
