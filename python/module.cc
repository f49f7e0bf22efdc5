#include <glog/logging.h>

#include "python/bindings.h"

namespace camgyro {
namespace {

// Raises `type(message, code)`, which a C++ exception of pybind11 cannot.
PyObject* error_type = nullptr;

}  // namespace

void Raise(const Error& error) {
  PyErr_SetObject(error_type,
                  pybind11::make_tuple(error.message, static_cast<int>(error.kind)).ptr());
  throw pybind11::error_already_set();
}

}  // namespace camgyro

PYBIND11_MODULE(camgyro, module) {
  FLAGS_minloglevel = google::GLOG_FATAL;  // what Ceres warns about ends up in the results
  module.doc() =
      "Calibrates and synchronises a rolling-shutter camera with a gyroscope.\n\n"
      "    recording = camgyro.read_recording('FOLDER')\n"
      "    report = camgyro.calibrate(recording)\n"
      "    report.calibration.delay_s, report.calibration.sigma, report.calibration.covariance\n\n"
      "Time: t_gyro = t_camera + delay_s; row v of h rows is exposed at stamp + delay_s +\n"
      "readout_s * v / h. q_gyro_cam [w, x, y, z] maps camera vectors to the gyro frame. Stamps\n"
      "are int64 nanoseconds. Sigmas and covariances are those of one standard deviation.";
  camgyro::error_type =
      PyErr_NewExceptionWithDoc("camgyro.Error",
                                "args: (message, code); code as the exit codes of the program: 2 "
                                "usage, 3 input, 4 the data do not determine what was asked",
                                PyExc_RuntimeError, nullptr);
  if (camgyro::error_type == nullptr) throw pybind11::error_already_set();
  module.add_object("Error", camgyro::error_type);
  camgyro::BindRecording(&module);
  camgyro::BindResults(&module);
  camgyro::BindOdometry(&module);
}
