#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <map>
#include <string>
#include <vector>

#include "core/pair_model.h"
#include "core/standard_distortion.h"
#include "estimator/vins/initialise.h"
#include "pipeline/device.h"
#include "pipeline/read_calibration.h"
#include "pipeline/result_files.h"
#include "pipeline/run.h"
#include "python/bindings.h"

namespace camgyro {
namespace {

namespace py = pybind11;

Eigen::Vector4d Wxyz(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

Eigen::Quaterniond FromWxyz(const Eigen::Vector4d& wxyz) {
  return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
}

CalibrationReport Calibrate(Recording* recording, bool refine) {
  Result<CalibrationRun> run = [&] {
    const py::gil_scoped_release release;
    CalibrateOptions options;
    options.refine = refine;
    return RunCalibration(options, OnlineEstimator::kWindow, DeviceClass::kPhone, nullptr,
                          recording);
  }();
  if (!run) Raise(run.error());
  return std::move(run->report);
}

Calibration ReadFile(const std::string& path) {
  Result<Calibration> calibration = ReadCalibration(path);
  if (!calibration) Raise(calibration.error());
  return *std::move(calibration);
}

DeviceReport CombineReports(
    const std::vector<std::pair<const Recording*, const CalibrationReport*>>& all) {
  if (all.empty()) Raise({ErrorKind::kBadUsage, "combine: expected at least one recording"});
  std::vector<std::string> names;
  std::vector<const CalibrationReport*> reports;
  bool attitudes = true;
  for (const auto& [recording, report] : all) {
    names.push_back(recording->path);
    reports.push_back(report);
    attitudes = attitudes && recording->HasOnlyAttitudes();
  }
  Result<DeviceReport> device = CombineToDevice(names, reports, attitudes);
  if (!device) Raise(device.error());
  return *std::move(device);
}

// By parameter: the spread between recordings and its chance.
std::map<std::string, std::map<std::string, double>> RepeatabilityOf(const DeviceReport& device) {
  std::map<std::string, std::map<std::string, double>> by_name;
  for (size_t i = 0; i < device.parameters.size(); ++i) {
    const Repeatability& r = device.combined.repeatability[i];
    by_name[device.parameters[i]] = {{"recordings", r.recordings},
                                     {"between", r.between},
                                     {"chi2", r.chi2},
                                     {"p_value", r.p_value}};
  }
  return by_name;
}

// Columns of the online trace by name.
std::map<std::string, py::array> Trace(const CalibrationReport& report) {
  const auto rows = static_cast<py::ssize_t>(report.trace.size());
  py::array_t<int64_t> stamps(rows);
  py::array_t<double> values({rows, py::ssize_t{kStateRotation}}),
      sigmas({rows, py::ssize_t{kStateSize}});
  for (py::ssize_t i = 0; i < rows; ++i) {
    const WindowUpdate& update = report.trace[static_cast<size_t>(i)];
    const Calibration& c = update.estimate;
    stamps.mutable_at(i) = update.frame_stamp_ns;
    const StateVector row = ValuesOf(c, c.q_gyro_cam);
    std::copy(row.data(), row.data() + kStateRotation, values.mutable_data(i));
    const StateVector sigma = c.sigma();
    std::copy(sigma.data(), sigma.data() + kStateSize, sigmas.mutable_data(i));
  }
  return {{"frame_stamp_ns", stamps}, {"values", values}, {"sigmas", sigmas}};
}

VinsStart Initialise(const Recording& recording, const Calibration& calibration, double first_s,
                     double window_s, const Eigen::Vector3d& p_gyro_cam_m,
                     double accel_noise_m_s2_rtHz) {
  if (!(window_s > 0.0) || !(accel_noise_m_s2_rtHz > 0.0) || !p_gyro_cam_m.allFinite()) {
    Raise({ErrorKind::kBadUsage, "initialise_vins: expected window_s and noise above zero"});
  }
  VinsOptions options;
  options.p_gyro_cam_m = p_gyro_cam_m;
  options.noise.accel_m_s2_rtHz = accel_noise_m_s2_rtHz;
  if (recording.gyro_info.noise_density_rad_s_rtHz) {
    options.noise.gyro_rad_s_rtHz = *recording.gyro_info.noise_density_rad_s_rtHz;
  }
  Result<VinsStart> start = [&] {
    const py::gil_scoped_release release;
    return InitialiseVins(CutVinsInput(recording, calibration, first_s, first_s + window_s),
                          options);
  }();
  if (!start) Raise(start.error());
  return *std::move(start);
}

// One row per state.
template <typename Get>
Eigen::MatrixXd Rows(const VinsStart& start, int columns, Get get) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(start.states.size()), columns);
  for (size_t k = 0; k < start.states.size(); ++k) {
    rows.row(static_cast<Eigen::Index>(k)) = get(start.states[k]).transpose();
  }
  return rows;
}

DistortionCoefficients Standard(const Calibration& c) {
  return StandardDistortion(c.distortion_model, c.FullLens(),
                            Eigen::Vector2d(c.width_px, c.height_px));
}

void BindCalibration(py::module_* module) {
  py::class_<Calibration>(*module, "Calibration", "Values and their joint covariance.")
      .def_property_readonly_static(
          "names", [](const py::object&) { return StateNames(); },
          "list of 11 str: the order of sigma, covariance and determined")
      .def_property_readonly(
          "size", [](const Calibration& c) { return py::make_tuple(c.width_px, c.height_px); },
          "(width, height) [px]")
      .def_property_readonly(
          "focal_px", [](const Calibration& c) { return c.lens[kFocal]; }, "fy [px]")
      .def_property_readonly(
          "aspect_ratio", [](const Calibration& c) { return c.FullLens()[kAspect]; }, "fx / fy")
      .def_property_readonly(
          "principal_px",
          [](const Calibration& c) { return Eigen::Vector2d(c.lens[kCx], c.lens[kCy]); },
          "float array (2,) [px]")
      .def_property_readonly(
          "distortion", [](const Calibration& c) { return Standard(c).k; },
          "float array (4,): k1, k2, p1, p2 (radtan) or k1, k2, k3, k4 (kannala_brandt)")
      .def_property_readonly(
          "distortion_model",
          [](const Calibration& c) { return DistortionModelName(Standard(c).model); },
          "str: none, radtan or kannala_brandt")
      .def_readwrite("readout_s", &Calibration::readout_s, "first to last row [s]")
      .def_property_readonly(
          "column_readout_s", &ColumnReadoutOf,
          "first to last column [s], beside readout_s: of pictures that were turned")
      .def_readwrite("delay_s", &Calibration::delay_s, "t_gyro = t_camera + delay_s [s]")
      .def_property(
          "bias_rad_s", [](const Calibration& c) { return c.bias_gyro_rad_s; },
          [](Calibration& c, const Eigen::Vector3d& b) { c.bias_gyro_rad_s = b; },
          "float array (3,): gyro bias [rad/s]")
      .def_property(
          "q_gyro_cam", [](const Calibration& c) { return Wxyz(c.q_gyro_cam); },
          [](Calibration& c, const Eigen::Vector4d& q) { c.q_gyro_cam = FromWxyz(q); },
          "float array (4,): [w, x, y, z], camera vectors into the gyro frame")
      .def_property_readonly(
          "R_gyro_cam", [](const Calibration& c) { return c.q_gyro_cam.toRotationMatrix(); },
          "float array (3, 3)")
      .def_property_readonly(
          "covariance", [](const Calibration& c) { return c.covariance; },
          "float array (11, 11), in the order of names; px, s, rad/s, rad")
      .def_property_readonly(
          "sigma", [](const Calibration& c) { return c.sigma(); }, "float array (11,), of noise")
      .def_property_readonly(
          "sigma_total", [](const Calibration& c) { return c.sigma_total(); },
          "float array (11,), with what effects that nobody has declared may add; None: not known")
      .def_property_readonly(
          "determined",
          [](const Calibration& c) {
            py::dict determined;
            for (size_t i = 0; i < kStateSize; ++i) {
              determined[py::str(StateNames()[i])] = c.determined[i];
            }
            return determined;
          },
          "dict name -> bool: did the motion determine it?");
}

void BindReport(py::module_* module) {
  py::class_<CalibrationReport>(*module, "CalibrationReport")
      .def_readonly("calibration", &CalibrationReport::calibration)
      .def_readonly("notes", &CalibrationReport::notes, "list of str")
      .def_readonly("doubts", &CalibrationReport::doubts,
                    "list of str: reasons not to believe a number")
      .def_readonly("converged", &CalibrationReport::converged)
      .def(
          "yaml",
          [](const CalibrationReport& r, const Recording& recording) {
            return CalibrationYaml(r, recording.HasOnlyAttitudes());
          },
          py::arg("recording"), "str: the text of calibration.yaml, of the recording calibrated")
      .def_property_readonly("rms_px", [](const CalibrationReport& r) { return r.quality.rms_px; })
      .def_property_readonly("noise_px",
                             [](const CalibrationReport& r) { return r.quality.noise_px; })
      .def_property_readonly(
          "trace", &Trace,
          "dict of the online estimate, a row per solved window: frame_stamp_ns int64 (n,), values "
          "(n, 8) in the order of Calibration.names without the rotation, sigmas (n, 11)")
      .def_property_readonly(
          "delay_curve",
          [](const CalibrationReport& r) {
            Eigen::MatrixXd curve(static_cast<Eigen::Index>(r.start.curve.size()), 2);
            for (Eigen::Index i = 0; i < curve.rows(); ++i) {
              const DelayResidual& point = r.start.curve[static_cast<size_t>(i)];
              curve.row(i) << point.delay_s, point.residual;
            }
            return curve;
          },
          "float array (n, 2): delay [s], share of the gyro's power that stays unexplained");
  module->def("read_calibration", &ReadFile, py::arg("path"),
              "The values and sigmas of a calibration.yaml, or of a simulator's truth.yaml. Raises "
              "camgyro.Error, code 3, naming file, line and key.");
  module->def("calibrate", &Calibrate, py::arg("recording"), py::arg("refine") = true,
              "Calibrates a recording; pictures are tracked first, and their tracks stay in it. "
              "refine=False: only the online pass. Raises camgyro.Error, code 4, with the reason "
              "if the data do not determine a calibration.");
}

void BindDevice(py::module_* module) {
  py::class_<DeviceReport>(*module, "DeviceReport", "One device from several of its recordings.")
      .def_property_readonly(
          "calibration", [](const DeviceReport& d) { return d.report.calibration; },
          "Calibration; delay and bias: what the next recording is to be expected to have")
      .def_property_readonly("repeatability", &RepeatabilityOf,
                             "dict name -> {recordings, between, chi2, p_value}: the spread beyond "
                             "noise, and the chance that noise alone makes such differences")
      .def_property_readonly(
          "odd",
          [](const DeviceReport& d) {
            py::list odd;
            for (const OddRecording& o : d.combined.odd) {
              odd.append(py::make_tuple(d.recordings[o.recording],
                                        d.parameters[static_cast<size_t>(o.parameter)], o.sigmas,
                                        o.p_value));
            }
            return odd;
          },
          "list of (path, parameter, sigmas, p_value): recordings that the others contradict")
      .def("yaml", &DeviceYaml, "str: the text of the device's calibration.yaml");
  module->def("combine", &CombineReports, py::arg("recordings"),
              "One device from a list of (Recording, CalibrationReport) of its recordings. Raises "
              "camgyro.Error, code 3, if they cannot be of one camera.");
}

void BindVins(py::module_* module) {
  py::class_<VinsStart>(*module, "VinsStart",
                        "World: origin and axes of the gyro frame at the first keyframe.")
      .def_property_readonly(
          "verdict", [](const VinsStart& s) { return VinsVerdictName(s.verdict); },
          "str: ready, imprecise, no_accelerometer, ... ")
      .def_readonly("explanation", &VinsStart::explanation)
      .def_property_readonly(
          "frame_stamps_ns",
          [](const VinsStart& s) {
            py::array_t<int64_t> stamps(static_cast<py::ssize_t>(s.states.size()));
            for (size_t k = 0; k < s.states.size(); ++k) {
              stamps.mutable_data()[k] = s.states[k].frame_stamp_ns;
            }
            return stamps;
          },
          "int64 array (keyframes,): camera clock [ns]")
      .def_property_readonly(
          "q_world_gyro",
          [](const VinsStart& s) {
            return Rows(s, 4, [](const VinsState& x) { return Wxyz(x.q_world_gyro); });
          },
          "float array (keyframes, 4) [w, x, y, z]")
      .def_property_readonly(
          "p_world_m",
          [](const VinsStart& s) {
            return Rows(s, 3, [](const VinsState& x) { return x.p_world_m; });
          },
          "float array (keyframes, 3) [m]")
      .def_property_readonly(
          "v_world_m_s",
          [](const VinsStart& s) {
            return Rows(s, 3, [](const VinsState& x) { return x.v_world_m_s; });
          },
          "float array (keyframes, 3) [m/s]")
      .def_property_readonly(
          "landmarks",
          [](const VinsStart& s) {
            Eigen::MatrixXd points(static_cast<Eigen::Index>(s.landmarks.size()), 4);
            for (size_t i = 0; i < s.landmarks.size(); ++i) {
              points.row(static_cast<Eigen::Index>(i)) = s.landmarks[i].point.transpose();
            }
            return points;
          },
          "float array (landmarks, 4): homogeneous points [m], w near 0: far away")
      .def_readonly("gravity_m_s2", &VinsStart::gravity_world_m_s2,
                    "float array (3,), world; points down")
      .def_readonly("bias_accel_m_s2", &VinsStart::bias_accel_m_s2, "float array (3,)")
      .def_readonly("scale_sigma", &VinsStart::scale_sigma, "relative")
      .def_readonly("gravity_sigma_rad", &VinsStart::gravity_sigma_rad)
      .def_readonly("covariance", &VinsStart::covariance,
                    "float array (n, n), n = 9 keyframes + 20: rotation [rad], position [m], "
                    "velocity [m/s] of each; then gravity 3, accelerometer bias 3, p_gyro_cam 3, "
                    "calibration 11");
  module->def("initialise_vins", &Initialise, py::arg("recording"), py::arg("calibration"),
              py::arg("first_s") = 0.0, py::arg("window_s") = 2.0,
              py::arg("p_gyro_cam_m") = Eigen::Vector3d::Zero().eval(),
              py::arg("accel_noise_m_s2_rtHz") = ImuNoise().accel_m_s2_rtHz,
              "Starts a VIO on the frames from first_s to first_s + window_s [s after the first "
              "frame]. The recording needs tracks (calibrate makes them) and an accelerometer.");
}

}  // namespace

void BindResults(py::module_* module) {
  BindCalibration(module);
  BindReport(module);
  BindDevice(module);
  BindVins(module);
}

}  // namespace camgyro
