#include "tools/odometry_files.h"

#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>

#include "core/format.h"

namespace camgyro {
namespace {

std::vector<double> Numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void Emit(YAML::Emitter& out, const char* key, double value) {
  out << YAML::Key << key << YAML::Value << value;
}

void EmitWithSigma(YAML::Emitter& out, const char* key, const std::vector<double>& value,
                   const std::vector<double>& sigma) {
  out << YAML::Key << key << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "value"
      << YAML::Value;
  if (value.size() == 1) {
    out << value[0] << YAML::Key << "sigma" << YAML::Value << sigma[0];
  } else {
    out << value << YAML::Key << "sigma" << YAML::Value << sigma;
  }
  out << YAML::EndMap;
}

void EmitCalibration(YAML::Emitter& out, const OdometryRun& run) {
  const Calibration& c = run.calibration;
  const StateVector sigma = c.sigma();
  out << YAML::Key << "refined" << YAML::Value << YAML::BeginMap;
  EmitWithSigma(out, "focal_px", {c.lens[kFocal]}, {sigma[kStateFocal]});
  EmitWithSigma(out, "principal_px", {c.lens[kCx], c.lens[kCy]},
                {sigma[kStateCx], sigma[kStateCy]});
  EmitWithSigma(out, "readout_s", {c.readout_s}, {sigma[kStateReadout]});
  EmitWithSigma(out, "delay_s", {c.delay_s}, {sigma[kStateDelay]});
  const Eigen::Quaterniond& q = c.q_gyro_cam;
  EmitWithSigma(out, "q_gyro_cam_xyzw", {q.x(), q.y(), q.z(), q.w()},
                Numbers(sigma.segment<3>(kStateRotation)));
  EmitWithSigma(out, "p_gyro_cam_m", Numbers(run.p_gyro_cam_m), Numbers(run.p_gyro_cam_sigma_m));
  Emit(out, "noise_px", run.noise_px);
  out << YAML::Key << "noise_of" << YAML::Value << (run.tracks_drift ? "steps" : "sightings");
  out << YAML::EndMap;
}

void EmitLoops(YAML::Emitter& out, const OdometryRun& run, const LoopClosure& loops) {
  out << YAML::Key << "loops" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "looked_for" << YAML::Value << loops.unavailable.empty();
  if (!loops.unavailable.empty()) {
    out << YAML::Key << "reason" << YAML::Value << loops.unavailable;
  }
  out << YAML::Key << "candidates" << YAML::Value << loops.candidates;
  out << YAML::Key << "verified" << YAML::Value << loops.loops.size();
  out << YAML::Key << "closed" << YAML::Value << loops.Believed();
  out << YAML::Key << "between" << YAML::Value << YAML::BeginSeq;
  for (const FoundLoop& loop : loops.loops) {
    out << YAML::Flow << YAML::BeginMap;
    out << YAML::Key << "older_ns" << YAML::Value << run.keyframes[loop.edge.older].time_ns;
    out << YAML::Key << "newer_ns" << YAML::Value << run.keyframes[loop.edge.newer].time_ns;
    out << YAML::Key << "sightings" << YAML::Value << loop.sightings;
    Emit(out, "noise_px", loop.noise_px);
    out << YAML::Key << "closed" << YAML::Value << loop.believed << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
}

// Of anything with a time and a state.
template <typename Timed>
std::string Tum(const std::vector<Timed>& rows) {
  std::string text =
      "# time [s, gyro clock] x y z [m] qx qy qz qw: gyro frame in the world, z up\n";
  for (const Timed& row : rows) {
    const Eigen::Vector3d& p = row.state.p_world_m;
    const Eigen::Quaterniond& q = row.state.q_world_gyro;
    text += Format("%lld.%09lld %.6f %.6f %.6f %.9f %.9f %.9f %.9f\n",
                   static_cast<long long>(row.time_ns / 1000000000),
                   static_cast<long long>(row.time_ns % 1000000000), p.x(), p.y(), p.z(), q.x(),
                   q.y(), q.z(), q.w());
  }
  return text;
}

}  // namespace

std::string OdometryYaml(const OdometryRun& run, const LoopClosure& loops) {
  YAML::Emitter out;
  out.SetDoublePrecision(10);
  out << YAML::BeginMap;
  out << YAML::Key << "verdict" << YAML::Value << VerdictOf(run);
  out << YAML::Key << "segments" << YAML::Value << run.segments;
  out << YAML::Key << "frames" << YAML::Value << run.poses.size();
  out << YAML::Key << "keyframes" << YAML::Value << run.keyframes.size();
  Emit(out, "path_m", run.path_m);
  out << YAML::Key << "events" << YAML::Value << YAML::BeginSeq;
  for (const OdometryEvent& event : run.events) {
    out << YAML::BeginMap;
    out << YAML::Key << "event" << YAML::Value
        << (event.kind == OdometryEvent::Kind::kStarted ? "started" : "lost");
    out << YAML::Key << "time_ns" << YAML::Value << event.time_ns;
    out << YAML::Key << "segment" << YAML::Value << event.segment;
    out << YAML::Key << "explanation" << YAML::Value << event.explanation << YAML::EndMap;
  }
  out << YAML::EndSeq;
  if (run.segments > 0) {
    EmitLoops(out, run, loops);
    EmitCalibration(out, run);
  }
  out << YAML::EndMap << YAML::Newline;
  return out.c_str();
}

std::string TrajectoryTum(const std::vector<OdometryPose>& poses) { return Tum(poses); }
std::string TrajectoryTum(const std::vector<StateAtTime>& states) { return Tum(states); }

std::string PosesCsv(const std::vector<OdometryPose>& poses) {
  constexpr std::array<const char*, 6> kAxes = {"px", "py", "pz", "rx", "ry", "rz"};
  std::string text =
      "#time_ns,frame_stamp_ns,segment,p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z [],v_x [m "
      "s^-1],v_y [m s^-1],v_z [m s^-1],b_w_x [rad s^-1],b_w_y [rad s^-1],b_w_z [rad s^-1],b_a_x [m "
      "s^-2],b_a_y [m s^-2],b_a_z [m s^-2],mapped_tracks";
  for (size_t i = 0; i < kAxes.size(); ++i) {
    for (size_t j = 0; j <= i; ++j) text += Format(",cov_%s_%s", kAxes[i], kAxes[j]);
  }
  text += "\n";
  for (const OdometryPose& pose : poses) {
    const NavigationState& s = pose.state;
    text += Format("%lld,%lld,%d", static_cast<long long>(pose.time_ns),
                   static_cast<long long>(pose.frame_stamp_ns), pose.segment);
    const Eigen::Quaterniond& q = s.q_world_gyro;
    for (const double x : Numbers(s.p_world_m)) text += Format(",%.6f", x);
    for (const double x : {q.w(), q.x(), q.y(), q.z()}) text += Format(",%.9f", x);
    for (const Eigen::Vector3d& v : {s.v_world_m_s, s.bias_gyro_rad_s, s.bias_accel_m_s2}) {
      for (const double x : Numbers(v)) text += Format(",%.7f", x);
    }
    text += Format(",%d", pose.mapped_tracks);
    Eigen::Matrix<double, 6, 6> covariance;
    covariance << pose.covariance.block<3, 3>(kNavPosition, kNavPosition),
        pose.covariance.block<3, 3>(kNavPosition, kNavRotation),
        pose.covariance.block<3, 3>(kNavRotation, kNavPosition),
        pose.covariance.block<3, 3>(kNavRotation, kNavRotation);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j) text += Format(",%.6g", covariance(i, j));
    }
    text += "\n";
  }
  return text;
}

std::string PointsPly(const std::vector<MappedPoint>& points) {
  std::string text = Format(
      "ply\nformat ascii 1.0\ncomment landmarks in the world of trajectory.tum [m]\nelement vertex "
      "%zu\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
      points.size());
  for (const MappedPoint& point : points) {
    text +=
        Format("%.4f %.4f %.4f\n", point.p_world_m.x(), point.p_world_m.y(), point.p_world_m.z());
  }
  return text;
}

}  // namespace camgyro
