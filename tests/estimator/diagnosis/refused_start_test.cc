#include "estimator/diagnosis/refused_start.h"

#include <gmock/gmock.h>

#include "core/so3.h"
#include "core/time.h"
#include "frontend/camera_rotations.h"
#include "tests/estimator/diagnosis/simulated_recording.h"

namespace camgyro {
namespace {

using testing::HasSubstr;

// The camera's rotations as they truly are.
std::vector<CameraRotation> TrueRotations(const simulation::Simulated& s) {
  std::vector<CameraRotation> rotations;
  for (size_t i = 0; i + 1 < s.frames.size(); ++i) {
    CameraRotation rotation;
    rotation.frame_a = static_cast<int>(i);
    rotation.frame_b = static_cast<int>(i) + 1;
    rotation.q_a_b = Eigen::Quaterniond(Eigen::Matrix3d(s.frames[i].state.R_world_cam.transpose() *
                                                        s.frames[i + 1].state.R_world_cam));
    rotation.sigma_rad = 1e-3;
    rotations.push_back(rotation);
  }
  return rotations;
}

CameraRotationsAt TrueRotationsOf(const simulation::Simulated& s) {
  return [&s](const Recording&, const std::vector<RotationTrial>&) {
    return std::vector<std::vector<CameraRotation>>{TrueRotations(s)};
  };
}

// As the program finds them: from the tracks, 0.1 s apart.
std::vector<CameraRotation> RotationsFound(const simulation::Simulated& s) {
  return CameraRotationsOf(s.recording, PairsForRotations(s.recording),
                           {{s.truth.lens[kFocal], {}}})
      .front();
}

template <typename Stamped>
void Stretch(double factor, std::vector<Stamped>* items) {
  const int64_t first_ns = items->front().stamp_ns;
  for (Stamped& item : *items) {
    item.stamp_ns = StampAt(first_ns, factor * SecondsSince(first_ns, item.stamp_ns));
  }
}

TEST(RefusedStart, RepairsUnitAndHandedness) {
  const auto simulated = SimulateFor12S({"motion.kind=running"});
  const CameraRotationsAt rotations_at = TrueRotationsOf(simulated);
  EXPECT_FALSE([&] {  // a mirrored gyro of a sound recording explains less
    Recording sound = simulated.recording;
    for (GyroSample& sample : sound.gyro) sample.omega_gyro_rad_s.setZero();
    return RepairRecording(rotations_at, {}, &sound).has_value();
  }());
  Recording degrees = simulated.recording;
  for (GyroSample& sample : degrees.gyro) sample.omega_gyro_rad_s *= 180.0 / M_PI;
  const auto unit = RepairRecording(rotations_at, {}, &degrees);
  ASSERT_TRUE(unit);
  EXPECT_EQ(unit->name, "gyro_unit");
  EXPECT_NEAR(degrees.gyro[100].omega_gyro_rad_s.x(),
              simulated.recording.gyro[100].omega_gyro_rad_s.x(), 1e-12);
  Recording exchanged = simulated.recording;
  for (GyroSample& sample : exchanged.gyro) {
    std::swap(sample.omega_gyro_rad_s.x(), sample.omega_gyro_rad_s.y());
  }
  const auto axes = RepairRecording(rotations_at, {}, &exchanged);
  ASSERT_TRUE(axes);
  EXPECT_EQ(axes->name, "gyro_axes");
}

TEST(RefusedStart, ElectronicStabilisation) {
  for (const char* motion :
       {"motion.kind=walking", "motion.kind=running", "motion.kind=handheld"}) {
    const auto sound = SimulateFor12S({"duration_s=30", motion});
    EXPECT_FALSE(FindElectronicStabilisation(sound.recording, TrueRotations(sound))) << motion;
  }
  const auto stabilised = SimulateFor12S({"duration_s=30", "motion.kind=walking"});
  // The picture follows the smoothed course: slow rotation stays.
  std::vector<CameraRotation> rotations = TrueRotations(stabilised);
  std::vector<Eigen::Vector3d> rates;
  for (const CameraRotation& rotation : rotations) rates.push_back(Log(rotation.q_a_b));
  for (size_t i = 0; i < rotations.size(); ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const size_t from = i < 30 ? 0 : i - 30, to = std::min(rates.size(), i + 31);
    for (size_t k = from; k < to; ++k) sum += rates[k];
    rotations[i].q_a_b = Exp(Eigen::Vector3d(sum / static_cast<double>(to - from)));
  }
  const auto found = FindElectronicStabilisation(stabilised.recording, rotations);
  ASSERT_TRUE(found);
  EXPECT_THAT(*found, HasSubstr("above 1 Hz"));
}

TEST(RefusedStart, ElectronicStabilisationInTheRotationsThatTheStartUses) {
  const std::string stabiliser = "effects.electronic_stabilisation={strength: 1, smoothing_s: 0.5}";
  for (const bool stabilised : {false, true}) {
    for (const char* motion :
         {"motion.kind=walking", "motion.kind=running", "motion.kind=handheld"}) {
      SCOPED_TRACE(motion);
      std::vector<std::string> overrides = {motion};
      if (stabilised) overrides.push_back(stabiliser);
      const auto s = SimulateFor12S(overrides);
      EXPECT_EQ(FindElectronicStabilisation(s.recording, RotationsFound(s)).has_value(),
                stabilised);
    }
  }
}

// Frames stamped as a slow motion is played; and a gyro whose stamps were made for twice its rate,
// where the camera turns as fast as the gyro says.
TEST(RefusedStart, FindsTheClockThatIsWrong) {
  for (const char* motion : {"motion.kind=walking", "motion.kind=handheld"}) {
    SCOPED_TRACE(motion);
    const auto s = SimulateFor12S({motion});
    for (const double stretch : {4.0, 8.0, 0.5}) {
      SCOPED_TRACE(stretch);
      Recording slow = s.recording;
      Stretch(stretch, &slow.frames);
      const auto fault = RepairRecording(TrueRotationsOf(s), {}, &slow);
      ASSERT_TRUE(fault);
      EXPECT_EQ(fault->name, "frame_clock");
      ASSERT_EQ(slow.faults.size(), 1u);  // what calibration.yaml has of it
      EXPECT_EQ(slow.faults[0].name, "frame_clock");
      EXPECT_THAT(slow.faults[0].finding, HasSubstr("repaired for this run"));
      EXPECT_NEAR(
          SecondsSince(slow.frames.front().stamp_ns, slow.frames.back().stamp_ns),
          SecondsSince(s.recording.frames.front().stamp_ns, s.recording.frames.back().stamp_ns),
          1e-6);
      EXPECT_EQ(slow.gyro.back().stamp_ns, s.recording.gyro.back().stamp_ns);
    }
    Recording quick = s.recording;
    Stretch(0.5, &quick.gyro);
    const auto fault = RepairRecording(TrueRotationsOf(s), {}, &quick);
    ASSERT_TRUE(fault);
    EXPECT_EQ(fault->name, "gyro_clock");
    EXPECT_EQ(quick.frames.back().stamp_ns, s.recording.frames.back().stamp_ns);
    EXPECT_NEAR(SecondsSince(quick.gyro.front().stamp_ns, quick.gyro.back().stamp_ns),
                SecondsSince(s.recording.gyro.front().stamp_ns, s.recording.gyro.back().stamp_ns),
                1e-6);
  }
}

TEST(RefusedStart, FindsAccelerationsInTheGyrosColumns) {
  const auto s = SimulateFor12S({"motion.kind=walking"});
  ASSERT_FALSE(s.recording.accel.empty());
  Recording exchanged = s.recording;
  for (size_t i = 0; i < exchanged.gyro.size(); ++i) {
    std::swap(exchanged.gyro[i].omega_gyro_rad_s, exchanged.accel[i].accel_gyro_m_s2);
  }
  const auto fault = RepairRecording(TrueRotationsOf(s), {}, &exchanged);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->name, "gyro_columns");
  EXPECT_EQ(exchanged.gyro[100].omega_gyro_rad_s, s.recording.gyro[100].omega_gyro_rad_s);
  EXPECT_EQ(exchanged.accel[100].accel_gyro_m_s2, s.recording.accel[100].accel_gyro_m_s2);
}

// A gyro of another time, and a slow motion by a factor that nothing lists, are neither repaired,
// nor pictures without the fast rotation.
TEST(RefusedStart, NamesNothingWhereNothingFits) {
  for (const char* motion :
       {"motion.kind=walking", "motion.kind=running", "motion.kind=handheld"}) {
    SCOPED_TRACE(motion);
    const auto s = SimulateFor12S({motion});
    Recording backwards = s.recording;
    for (size_t i = 0; i < backwards.gyro.size(); ++i) {
      backwards.gyro[i].omega_gyro_rad_s =
          s.recording.gyro[s.recording.gyro.size() - 1 - i].omega_gyro_rad_s;
    }
    EXPECT_FALSE(RepairRecording(TrueRotationsOf(s), {}, &backwards));
    EXPECT_FALSE(FindElectronicStabilisation(backwards, TrueRotations(s)));
    Recording slow = s.recording;
    Stretch(3.3, &slow.frames);
    EXPECT_FALSE(RepairRecording(TrueRotationsOf(s), {}, &slow));
    EXPECT_FALSE(FindElectronicStabilisation(slow, TrueRotations(s)));
    EXPECT_FALSE(FindElectronicStabilisation(slow, RotationsFound(s)));
  }
}

}  // namespace
}  // namespace camgyro
