#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "estimator/odometry/follow_recording.h"
#include "estimator/odometry/gyro_rate_trajectory.h"
#include "pipeline/find_loops.h"
#include "pipeline/run.h"
#include "python/bindings.h"

namespace camgyro {
namespace {

namespace py = pybind11;

// What `camgyro.odometry` returns.
struct Followed {
  OdometryRun run;
  LoopClosure loops;
  double gravity_m_s2 = 0.0;
};

struct FollowArguments {
  int keyframes = 16;
  bool loops = true;
  double gravity_m_s2 = 0.0;
  Eigen::Vector3d p_gyro_cam_m;
  double p_gyro_cam_sigma_m = 0.0;
};

Followed Follow(Recording* recording, const Calibration& calibration,
                const FollowArguments& arguments) {
  if (arguments.keyframes < 6 || arguments.keyframes > 60 || !arguments.p_gyro_cam_m.allFinite() ||
      !(arguments.p_gyro_cam_sigma_m > 0.0) ||
      !(arguments.gravity_m_s2 > 9.0 && arguments.gravity_m_s2 < 10.5)) {
    Raise({ErrorKind::kBadUsage,
           "odometry: expected 6 to 60 keyframes, gravity_m_s2 from 9 to 10.5, a finite "
           "p_gyro_cam_m and a sigma of it above zero"});
  }
  OdometryOptions options;
  options.keyframes = arguments.keyframes;
  options.gravity_m_s2 = arguments.gravity_m_s2;
  options.p_gyro_cam_m = arguments.p_gyro_cam_m;
  options.p_gyro_cam_sigma_m = arguments.p_gyro_cam_sigma_m;
  Result<Followed> followed = [&]() -> Result<Followed> {
    const py::gil_scoped_release release;
    if (Status sound = CheckCanBeFollowed(*recording); !sound) return tl::unexpected(sound.error());
    if (auto tracked = EnsureImageMotion(nullptr, recording); !tracked) {
      return tl::unexpected(tracked.error());
    }
    Result<OdometryRun> run = FollowRecording(
        *recording, calibration, WithDeclaredNoise(options, recording->gyro_info), nullptr);
    if (!run) return tl::unexpected(run.error());
    Followed all{*std::move(run), {}, options.gravity_m_s2};
    if (!arguments.loops) {
      all.loops.unavailable = "loops=False";
      return all;
    }
    Result<LoopClosure> loops = FindLoops(*recording, all.run, options.gravity_m_s2, nullptr);
    if (!loops) return tl::unexpected(loops.error());
    all.loops = *std::move(loops);
    return all;
  }();
  if (!followed) Raise(followed.error());
  return *std::move(followed);
}

// One row per pose.
template <typename Pose, typename Get>
Eigen::MatrixXd Rows(const std::vector<Pose>& poses, int columns, Get get) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(poses.size()), columns);
  for (size_t i = 0; i < poses.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) = get(poses[i]).transpose();
  }
  return rows;
}

template <typename Pose, typename Value>
py::array_t<int64_t> Integers(const std::vector<Pose>& poses, Value Pose::*value) {
  py::array_t<int64_t> column(static_cast<py::ssize_t>(poses.size()));
  for (size_t i = 0; i < poses.size(); ++i) column.mutable_data()[i] = poses[i].*value;
  return column;
}

// Columns that poses and states at the gyro's rate have in common.
template <typename Pose>
py::dict Columns(const std::vector<Pose>& poses) {
  py::dict columns;
  columns["time_ns"] = Integers(poses, &Pose::time_ns);
  columns["segment"] = Integers(poses, &Pose::segment);
  columns["q_world_gyro"] = Rows(poses, 4, [](const Pose& p) {
    const Eigen::Quaterniond& q = p.state.q_world_gyro;
    return Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  });
  columns["p_world_m"] = Rows(poses, 3, [](const Pose& p) { return p.state.p_world_m; });
  columns["v_world_m_s"] = Rows(poses, 3, [](const Pose& p) { return p.state.v_world_m_s; });
  return columns;
}

py::dict PoseColumns(const std::vector<OdometryPose>& poses) {
  py::dict columns = Columns(poses);
  columns["frame_stamp_ns"] = Integers(poses, &OdometryPose::frame_stamp_ns);
  columns["mapped_tracks"] = Integers(poses, &OdometryPose::mapped_tracks);
  columns["bias_gyro_rad_s"] =
      Rows(poses, 3, [](const OdometryPose& p) { return p.state.bias_gyro_rad_s; });
  columns["bias_accel_m_s2"] =
      Rows(poses, 3, [](const OdometryPose& p) { return p.state.bias_accel_m_s2; });
  py::array_t<double> covariance(
      {static_cast<py::ssize_t>(poses.size()), py::ssize_t{kNavSize}, py::ssize_t{kNavSize}});
  double* out = covariance.mutable_data();
  for (const OdometryPose& pose : poses) {
    // Symmetric: the order of rows and columns is the same.
    out = std::copy_n(pose.covariance.data(), kNavSize * kNavSize, out);
  }
  columns["covariance"] = covariance;
  return columns;
}

py::list Events(const OdometryRun& run) {
  py::list events;
  for (const OdometryEvent& event : run.events) {
    py::dict entry;
    entry["event"] = event.kind == OdometryEvent::Kind::kStarted ? "started" : "lost";
    entry["time_ns"] = event.time_ns;
    entry["segment"] = event.segment;
    entry["explanation"] = event.explanation;
    events.append(entry);
  }
  return events;
}

}  // namespace

void BindOdometry(py::module_* module) {
  py::class_<Followed>(*module, "OdometryRun", "Where a device went. World: z up.")
      .def_property_readonly(
          "verdict", [](const Followed& f) { return VerdictOf(f.run); },
          "str: tracked, lost and found again, or why it never started")
      .def_property_readonly(
          "poses", [](const Followed& f) { return PoseColumns(f.run.poses); },
          "dict of arrays, a row per frame from the first start on, as known at that time: time_ns "
          "(gyro clock), frame_stamp_ns, segment, mapped_tracks int64 (n,); q_world_gyro (n, 4) "
          "[w, x, y, z]; p_world_m, v_world_m_s, bias_gyro_rad_s, bias_accel_m_s2 (n, 3); "
          "covariance (n, 15, 15): rotation (right perturbation) [rad], position, velocity, gyro "
          "bias, accelerometer bias")
      .def_property_readonly(
          "keyframes", [](const Followed& f) { return PoseColumns(f.run.keyframes); },
          "dict as poses: keyframes as they left the window, with what later frames said of them")
      .def_property_readonly(
          "closed",
          [](const Followed& f) -> py::object {
            if (f.loops.Believed() == 0) return py::none();
            return PoseColumns(f.loops.poses);
          },
          "dict as poses, moved so that the loops close; None if there are none")
      .def_property_readonly(
          "loops", [](const Followed& f) { return LoopsInWords(f.loops); },
          "str: how many, or why nobody has looked for any")
      .def_property_readonly(
          "events", [](const Followed& f) { return Events(f.run); },
          "list of dict: event (started or lost), time_ns, segment, explanation")
      .def_property_readonly(
          "points_m",
          [](const Followed& f) {
            return Rows(f.run.points, 3, [](const MappedPoint& p) { return p.p_world_m; });
          },
          "float array (landmarks, 3) [m]")
      .def_property_readonly(
          "calibration", [](const Followed& f) { return f.run.calibration; },
          "Calibration, as refined on the way")
      .def_property_readonly(
          "p_gyro_cam_m", [](const Followed& f) { return f.run.p_gyro_cam_m; },
          "float array (3,): camera in the gyro frame, as refined")
      .def_property_readonly("p_gyro_cam_sigma_m",
                             [](const Followed& f) { return f.run.p_gyro_cam_sigma_m; })
      .def_property_readonly("noise_px", [](const Followed& f) { return f.run.noise_px; })
      .def_property_readonly(
          "path_m", [](const Followed& f) { return f.run.path_m; },
          "sum of the ways between keyframes, within segments")
      .def(
          "at_gyro_rate",
          [](const Followed& f, const Recording& recording) {
            return Columns(AtGyroRate(recording.gyro, recording.accel,
                                      f.loops.Believed() > 0 ? f.loops.keyframes : f.run.keyframes,
                                      f.gravity_m_s2));
          },
          py::arg("recording"),
          "dict of arrays, a row per gyro sample between keyframes of a segment, through the "
          "keyframes (with the loops closed, if there are any): time_ns, segment, q_world_gyro, "
          "p_world_m, v_world_m_s as in poses");
  module->def(
      "odometry",
      [](Recording* recording, const Calibration& calibration, int keyframes, bool loops,
         double gravity_m_s2, const Eigen::Vector3d& p_gyro_cam_m, double p_gyro_cam_sigma_m) {
        return Follow(recording, calibration,
                      {keyframes, loops, gravity_m_s2, p_gyro_cam_m, p_gyro_cam_sigma_m});
      },
      py::arg("recording"), py::arg("calibration"), py::arg("keyframes") = 16,
      py::arg("loops") = true, py::arg("gravity_m_s2") = OdometryOptions().gravity_m_s2,
      py::arg("p_gyro_cam_m") = Eigen::Vector3d::Zero().eval(),
      py::arg("p_gyro_cam_sigma_m") = OdometryOptions().p_gyro_cam_sigma_m,
      "Where the device went, by `camgyro odometry`'s sliding window of so many keyframes; "
      "pictures "
      "are tracked first, and their tracks stay in the recording, which needs an accelerometer. "
      "p_gyro_cam_m: camera in the gyro frame, as far as it is known. A run that never started is "
      "no error: its verdict says why. Raises camgyro.Error.");
}

}  // namespace camgyro
