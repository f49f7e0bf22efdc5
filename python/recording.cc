#include "core/recording.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <string>

#include "frontend/readers/read_recording.h"
#include "python/bindings.h"

namespace camgyro {
namespace {

namespace py = pybind11;

template <typename Sample>
py::array_t<int64_t> Stamps(const std::vector<Sample>& samples) {
  py::array_t<int64_t> stamps(static_cast<py::ssize_t>(samples.size()));
  for (size_t i = 0; i < samples.size(); ++i) stamps.mutable_data()[i] = samples[i].stamp_ns;
  return stamps;
}

template <typename Sample>
py::array_t<double> Vectors(const std::vector<Sample>& samples, Eigen::Vector3d Sample::*vector) {
  py::array_t<double> rows({static_cast<py::ssize_t>(samples.size()), py::ssize_t{3}});
  double* out = rows.mutable_data();
  for (const Sample& sample : samples) {
    for (int axis = 0; axis < 3; ++axis) *out++ = (sample.*vector)[axis];
  }
  return rows;
}

// All tracks in one table: (frame index, track id), (u, v).
py::tuple Tracks(const Recording& recording) {
  py::ssize_t count = 0;
  for (const auto& points : recording.tracks) count += static_cast<py::ssize_t>(points.size());
  py::array_t<int64_t> ids({count, py::ssize_t{2}});
  py::array_t<double> pixels({count, py::ssize_t{2}});
  int64_t* id = ids.mutable_data();
  double* px = pixels.mutable_data();
  for (size_t i = 0; i < recording.tracks.size(); ++i) {
    for (const TrackedPoint& point : recording.tracks[i]) {
      *id++ = static_cast<int64_t>(i);
      *id++ = point.track_id;
      *px++ = point.px.x();
      *px++ = point.px.y();
    }
  }
  return py::make_tuple(ids, pixels);
}

}  // namespace

void BindRecording(py::module_* module) {
  py::class_<Recording>(*module, "Recording", "What the files of a recording hold.")
      .def_readonly("path", &Recording::path)
      .def_readonly("notes", &Recording::notes, "list of str: what the reader saw and did")
      .def_property_readonly(
          "size",
          [](const Recording& r) { return py::make_tuple(r.camera.width_px, r.camera.height_px); },
          "(width, height) [px]; (0, 0) if no file declares it and no picture was looked at")
      .def_property_readonly(
          "frame_stamps_ns", [](const Recording& r) { return Stamps(r.frames); },
          "int64 array (frames,): stamps of the camera's clock [ns]")
      .def_property_readonly(
          "gyro_stamps_ns", [](const Recording& r) { return Stamps(r.gyro); },
          "int64 array (samples,): stamps of the gyro's clock [ns]")
      .def_property_readonly(
          "gyro_rad_s",
          [](const Recording& r) { return Vectors(r.gyro, &GyroSample::omega_gyro_rad_s); },
          "float array (samples, 3): angular rate in the gyro frame [rad/s], bias included")
      .def_property_readonly(
          "accel_stamps_ns", [](const Recording& r) { return Stamps(r.accel); },
          "int64 array (samples,): stamps of the gyro's clock [ns]; empty without accelerometer")
      .def_property_readonly(
          "accel_m_s2",
          [](const Recording& r) { return Vectors(r.accel, &AccelSample::accel_gyro_m_s2); },
          "float array (samples, 3): specific force in the gyro frame [m/s^2]")
      .def_property_readonly("tracks", &Tracks,
                             "(int64 array (points, 2): frame index and track id, float array "
                             "(points, 2): u, v [px]); empty before pictures were tracked")
      .def("__repr__", [](const Recording& r) {
        return "<camgyro.Recording " + r.path + ": " + std::to_string(r.frames.size()) +
               " frames, " + std::to_string(r.gyro.size()) + " gyro samples>";
      });
  module->def(
      "read_recording",
      [](const std::string& path) {
        Result<Recording> recording = [&] {
          const py::gil_scoped_release release;
          return ReadRecording(path);
        }();
        if (!recording) Raise(recording.error());
        return *std::move(recording);
      },
      py::arg("path"),
      "Reads a recording: a folder, or a file with telemetry inside. Raises camgyro.Error naming "
      "the "
      "file, and the line where there is one.");
}

}  // namespace camgyro
