// The main job on a simulated recording: from a poor guess to the truth.
#include "estimator/calibrate.h"

#include <gmock/gmock.h>

#include <random>
#include <vector>

#include "core/linear_algebra.h"
#include "core/usual_focal.h"
#include "estimator/start/focal_scan.h"
#include "estimator/starting_point.h"
#include "estimator/window/residuals/all_residuals.h"
#include "frontend/readers/repair_stamps.h"
#include "tests/estimator/simulated_input.h"
#include "tests/rotations_of_pictures.h"

namespace camgyro {
namespace {

using simulation::Scenario;
using simulation::Simulated;
using simulation::SimulateTracks;

TEST(CalibrateRecording, FindsTheTruthFromAPoorGuess) {
  Simulated s = SimulateTracks(ShortScenario(6.0)).value();
  CameraGuess& guess = s.recording.camera;
  guess.focal_px = 1.15 * s.truth.lens[kFocal];
  guess.principal_px.reset();
  guess.q_gyro_cam.reset();
  guess.readout_s.reset();
  guess.delay_s = s.truth.delay_s + 0.8;
  std::vector<std::string> stages;
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), {},
                         [&](const std::string& stage, double done) {
                           EXPECT_GE(done, 0.0);
                           EXPECT_LE(done, 1.0);
                           if (stages.empty() || stages.back() != stage) stages.push_back(stage);
                         });
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_THAT(stages, ::testing::ElementsAre("start", "window", "refinement"));
  EXPECT_TRUE(report->converged);
  EXPECT_THAT(report->doubts, ::testing::IsEmpty());

  const Calibration& c = report->calibration;
  const StateVector error = ErrorInSigmas(c, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.5) << error.transpose();
  const StateVector sigma = c.sigma();
  EXPECT_LT(sigma[kStateFocal], 4.0);
  EXPECT_LT(sigma[kStateDelay], 1e-3);
  EXPECT_LT(sigma[kStateReadout], 1e-3);
  for (int i = 0; i < kStateSize; ++i) {
    EXPECT_TRUE(c.determined[static_cast<size_t>(i)]) << StateNames()[static_cast<size_t>(i)];
  }
  ASSERT_TRUE(report->online.has_value());
  const StateVector online = ErrorInSigmas(*report->online, s.truth);
  EXPECT_LT(online.cwiseAbs().maxCoeff(), 5.0) << online.transpose();
  EXPECT_NEAR(report->quality.noise_px, 0.7, 0.1);
  ASSERT_TRUE(report->unseen.has_value());
  EXPECT_LT(report->unseen->rms_px, 1.3 * report->quality.rms_px);
  EXPECT_GT(report->unseen->pairs, 20);
  EXPECT_FALSE(report->trace.empty());
}

// Bounded to a third of the pairs, it says so; its sigmas are wider, and hold the truth.
TEST(CalibrateRecording, RefinesTheMostInformativePairsOfALongOne) {
  double nees = 0.0;
  constexpr int kSeeds = 4;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Scenario scenario = ShortScenario(12.0);
    scenario.seed = static_cast<uint64_t>(seed);
    const Simulated s = SimulateTracks(scenario).value();
    CalibrateOptions options;
    const auto all =
        CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), options);
    ASSERT_TRUE(all.has_value()) << all.error().message;
    EXPECT_THAT(all->notes, ::testing::IsEmpty());
    options.most_refined_pairs = static_cast<size_t>(all->quality.pairs / 3);
    const auto some =
        CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), options);
    ASSERT_TRUE(some.has_value()) << some.error().message;
    EXPECT_THAT(some->notes, ::testing::ElementsAre(::testing::HasSubstr("recording is long")));
    EXPECT_LE(some->quality.pairs, all->quality.pairs / 3);
    EXPECT_GE(some->quality.pairs, all->quality.pairs / 5);
    // The same by the memory that they take: by RefinementBytes 66 kB for each pair of 44 matches.
    options.most_refined_pairs = 9000;
    options.most_bytes = 0.0;
    options.least_refined_bytes = 0.75 * 66e3 * all->quality.pairs;
    const auto few =
        CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), options);
    ASSERT_TRUE(few.has_value()) << few.error().message;
    EXPECT_THAT(few->notes, ::testing::ElementsAre(::testing::HasSubstr("recording is long")));
    EXPECT_LT(few->quality.matches, 0.8 * all->quality.matches);
    EXPECT_GT(few->quality.matches, 0.6 * all->quality.matches);
    const StateVector wider = some->calibration.sigma().cwiseQuotient(all->calibration.sigma());
    EXPECT_GT(wider.mean(), 1.0) << wider.transpose();
    // Three sigmas to one are those of a ninth of the pairs, chosen at random.
    EXPECT_LT(wider.maxCoeff(), 3.0) << wider.transpose();
    const StateVector error = Difference(some->calibration, s.truth);
    nees += SquaredMahalanobis(error, some->calibration.covariance) / kStateSize / kSeeds;
  }
  // Of 44 numbers: 1 +- 0.21.
  EXPECT_LT(nees, 1.8);
  EXPECT_GT(nees, 0.3);
}

// Through a tele lens of four times the picture's width, usual focal lengths make pan and tilt five
// times too large, but not roll. A start that stops looking there is refused.
TEST(CalibrateRecording, FindsATeleLens) {
  Scenario scenario = ShortScenario(12.0);
  scenario.camera.focal_px = 4.0 * scenario.camera.width_px;
  const Simulated s = SimulateTracks(scenario).value();
  const CameraRotationsAt rotations_at = RotationsOfPictures(s.recording, 100);
  FocalScanOptions no_further;
  no_further.longest_focal = no_further.max_focal;
  const auto usual = FindStartAndFocal(s.recording, rotations_at, {}, no_further);
  EXPECT_FALSE(usual && usual->explained > kWellExplained);
  const Result<CalibrationReport> report = CalibrateRecording(s.recording, rotations_at, {});
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_GT(report->start.explained, kWellExplained);
  const StateVector error = ErrorInSigmas(report->calibration, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 5.0) << error.transpose();
  EXPECT_LT(report->calibration.sigma()[kStateFocal], 0.01 * scenario.camera.focal_px);
}

// A lens that moves follows the rates at the time of exposure. With the effect as the delay of the
// start makes it, t_d ends some 3 ms (28 sigmas) off: it is made anew with the fit.
TEST(CalibrateRecording, MakesEffectsAnewThatDependOnTheDelay) {
  Scenario scenario = ShortScenario(12.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.effects.optical_stabilisation = {0.4, 0.5};
  const Simulated s = SimulateTracks(scenario).value();
  CalibrateOptions options;
  options.effects = "optical_stabilisation:0.5";
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), options);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const StateVector error = ErrorInSigmas(report->calibration, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 5.0) << error.transpose();
  EXPECT_LT(report->calibration.sigma()[kStateDelay], 5e-4);
  // The online pass has them as well, in the shape that the fit has found.
  ASSERT_TRUE(report->online && report->online->effects);
  const std::string& shape = report->calibration.effects->items().front().shape;
  EXPECT_NE(shape, "0.5");
  EXPECT_EQ(report->online->effects->items().front().shape, shape);
}

// A lens that goes where no high-pass has it, 20 px to and fro, is no difficulty where it was
// logged: nothing of it is left, though the log counts in other pixels and is 5 ms late.
TEST(CalibrateRecording, KnowsWhereALoggedLensWas) {
  Scenario scenario = ShortScenario(12.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.effects.optical_stabilisation = {1.0, 0.3, 0.025};
  scenario.effects.optical_stabilisation.log_hz = 250.0;
  Simulated s = SimulateTracks(scenario).value();
  for (LensSample& sample : s.recording.lens_shift) {
    sample.shift_px *= 1.25;
    sample.stamp_ns += 5'000'000;
  }
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), {});
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  const StateVector error = ErrorInSigmas(c, s.truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 3.5) << error.transpose();
  EXPECT_NEAR(report->quality.noise_px, scenario.tracks.noise_px, 0.05 * scenario.tracks.noise_px);
  EXPECT_THAT(report->doubts, ::testing::IsEmpty());
  ASSERT_EQ(c.effects->items().size(), 1u);
  EXPECT_THAT(c.effects->items().front().shape, ::testing::StartsWith("logged/0.00"));
  EXPECT_NEAR(c.effect_values[0], 0.8, 3.5 * std::sqrt(c.effect_covariance(0, 0)));
  EXPECT_LT(c.effect_covariance(0, 0), 0.01 * 0.01);
}

// What the stabiliser does follows the time of the frame, whatever else shifts that.
TEST(CalibrateRecording, MakesEffectsAnewThatDependOnEffectsOnTime) {
  Scenario scenario = ShortScenario(12.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.effects.optical_stabilisation = {0.4, 0.5};
  scenario.effects.delay_step = {5.0, 0.010};
  const Simulated s = SimulateTracks(scenario).value();
  CalibrateOptions options;
  options.effects = "optical_stabilisation:0.5,delay_step:4.968";
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), options);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  const int step = c.effects->items()[1].first;
  const double sigma = std::sqrt(c.effect_covariance(step, step));
  EXPECT_NEAR(c.effect_values[step], 0.010, 4.0 * sigma);
  EXPECT_LT(sigma, 5e-4);
  EXPECT_NEAR(c.delay_s, s.truth.delay_s, 4.0 * c.sigma()[kStateDelay]);
}

// A filter of 10 Hz delays by 16 ms. Linear in the square of that, t_d was 0.38 ms off, 17 sigmas
// of 40 s of running: it is fitted as it is, also online.
TEST(CalibrateRecording, FitsAFilterThatIsNotLinear) {
  Scenario scenario = ShortScenario(12.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kRunning);
  scenario.effects.gyro_lowpass.time_constant_s = 0.016;
  const Simulated s = SimulateTracks(scenario).value();
  CalibrateOptions options;
  options.effects = "gyro_lowpass";
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), options);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  EXPECT_NEAR(c.delay_s, s.truth.delay_s + 0.016, 3.5 * c.sigma()[kStateDelay]);
  EXPECT_LT(c.sigma()[kStateDelay], 6e-5);
  EXPECT_NEAR(c.effect_values[0], 0.016 * 0.016, 3.5 * std::sqrt(c.effect_covariance(0, 0)));
  ASSERT_TRUE(report->online);
  EXPECT_EQ(report->online->effects, c.effects);
  EXPECT_NEAR(report->online->delay_s, c.delay_s, 4.0 * report->online->sigma()[kStateDelay]);
}

// A camera whose intervals really vary, by no clock: its frames have times of their own in the fit,
// which come out as their stamps.
TEST(CalibrateRecording, BelievesStampsOfVaryingIntervals) {
  Scenario scenario = ShortScenario(8.0);
  scenario.camera.rate_hz = 1000.0;
  Simulated s = SimulateTracks(scenario).value();
  Recording& recording = s.recording;
  std::mt19937 random(2);
  std::exponential_distribution<double> wait(1.0 / 12.0);
  std::vector<Frame> frames;
  std::vector<std::vector<TrackedPoint>> tracks;
  for (size_t i = 0; i < recording.frames.size(); i += 25 + static_cast<size_t>(wait(random))) {
    frames.push_back(recording.frames[i]);
    tracks.push_back(recording.tracks[i]);
  }
  recording.frames = frames;
  recording.tracks = tracks;
  RepairStamps(StampsMode::kAuto, &recording);
  ASSERT_EQ(recording.camera_stamps->kind, StampKind::kIrregular);
  const Result<CalibrationReport> report =
      CalibrateRecording(recording, RotationsOfPictures(recording, 100), {});
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  ASSERT_NE(c.effects, nullptr);
  ASSERT_TRUE(c.effects->Has("frame_stamp_jitter"));
  EXPECT_LT(c.effect_values[c.effects->frame_time_spread()], 0.4e-3);
  EXPECT_LT(ErrorInSigmas(c, s.truth).cwiseAbs().maxCoeff(), 4.0);
}

// Within 24 s the delay moves by 0.19 s. The start finds it, and says so.
TEST(CalibrateRecording, TakesAClockThatRunsFastIntoTheModel) {
  Scenario scenario = ShortScenario(24.0);
  scenario.tracks.count = 50;
  scenario.effects.clock_skew.ppm = 8000.0;
  const Simulated s = SimulateTracks(scenario).value();
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 400), {});
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_THAT(report->notes, ::testing::Contains(::testing::ContainsRegex(
                                 "clock runs 0\\.(79|80)[0-9] ± 0\\.00[0-9] % fast")));
  const Calibration& c = report->calibration;
  ASSERT_NE(c.effects, nullptr);
  ASSERT_TRUE(c.effects->Has("clock_skew"));
  const double sigma = std::sqrt(c.effect_covariance(0, 0));
  EXPECT_NEAR(c.effect_values[0], 8000.0, 4.0 * sigma);
  EXPECT_LT(sigma, 20.0);
  EXPECT_LT(ErrorInSigmas(c, s.truth).cwiseAbs().maxCoeff(), 4.5);
  ASSERT_TRUE(report->online.has_value());
  EXPECT_NEAR(report->online->effect_values[0], 8000.0, 100.0);
}

// Also of an effect that the start finds by itself.
TEST(CalibrateRecording, RefusesEffectsOfResidualsThatKnowNone) {
  const Simulated s = SimulateTracks(ShortScenario(1.0)).value();
  CalibrateOptions options;
  options.window.graph.residual = &ByTransfer();
  options.given_start.emplace();
  options.from = s.truth;
  options.from->effects = std::make_shared<const EffectSet>(
      MakeEffects("clock_skew", MakeEffectSetup(s.recording, s.truth)).value());
  options.from->effect_values = Eigen::VectorXd::Zero(1);
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), options);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().kind, ErrorKind::kBadUsage);
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("clock_skew"));
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("--residual=plane"));
}

// Steps sideways in a room look like turns of a gyro with a bias, to a start that knows rotations
// only: a fit that begins with it ends in a wrong minimum, with a focal length of 492 px.
TEST(CalibrateRecording, BeginsWithoutABiasThatIsAStepSideways) {
  Scenario scenario = RoomScenario();
  scenario.duration_s = 5.0;
  scenario.seed = 2;
  scenario.tracks.noise_px = 0.3;
  const Simulated s = SimulateTracks(scenario).value();
  CalibrateOptions options;
  options.given_start.emplace();
  options.given_start->delay_middle_row_s = s.truth.delay_s + 0.5 * s.truth.readout_s - 0.005;
  options.given_start->q_gyro_cam = s.truth.q_gyro_cam;
  options.given_start->bias_gyro_rad_s.x() = 0.26;
  const Result<CalibrationReport> report = CalibrateRecording(s.recording, nullptr, options);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_LT(ErrorInSigmas(report->calibration, s.truth).cwiseAbs().maxCoeff(), 4.5);
}

// One that is real is begun with: without it, this fit would run away.
TEST(CalibrateRecording, BeginsWithALargeBiasThatIsReal) {
  Scenario scenario = ShortScenario(6.0);
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.gyro.bias_rad_s = Eigen::Vector3d(-0.3, 0.3, 0.1);
  const Simulated s = SimulateTracks(scenario).value();
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), {});
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_LT(ErrorInSigmas(report->calibration, s.truth).cwiseAbs().maxCoeff(), 4.5);
}

TEST(CalibrateRecording, RefusesARecordingThatDoesNotTurn) {
  Scenario scenario = ShortScenario(3.0);
  scenario.motion.rotation_rms_rad_s.setZero();
  const Simulated s = SimulateTracks(scenario).value();
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), {});
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().kind, ErrorKind::kCannotEstimate);
  EXPECT_FALSE(report.error().message.empty());
}

TEST(MakePrior, FollowsWhatTheFilesDeclare) {
  Simulated s = SimulateTracks(ShortScenario(0.5)).value();
  StartResult start;
  start.delay_middle_row_s = 0.031;
  start.rotation_sigma_rad = Eigen::Vector3d(0.01, 0.4, 0.01);
  CameraGuess& guess = s.recording.camera;
  guess.focal_px = 600.0;
  guess.principal_px = Eigen::Vector2d(350.0, 250.0);
  guess.readout_s = 0.022;
  const Prior declared = MakePrior(s.recording, start);
  EXPECT_EQ(declared.mean.lens[kFocal], 600.0);
  EXPECT_EQ(declared.mean.lens[kCx], 350.0);
  EXPECT_EQ(declared.mean.readout_s, 0.022);
  EXPECT_DOUBLE_EQ(declared.mean.delay_s, 0.031 - 0.011);  // of the first row
  EXPECT_DOUBLE_EQ(declared.sigma[kStateFocal], 90.0);
  EXPECT_DOUBLE_EQ(declared.sigma[kStateReadout], 5e-3);
  EXPECT_EQ(declared.sigma[kStateRotation], 0.15);
  EXPECT_EQ(declared.sigma[kStateRotation + 1], 0.4);

  guess = CameraGuess();
  guess.width_px = 720;
  guess.height_px = 480;
  start.focal.emplace();
  start.focal->value_px = 655.0;
  start.focal->determined = true;
  const Prior found = MakePrior(s.recording, start);
  EXPECT_EQ(found.mean.lens[kFocal], 655.0);
  EXPECT_EQ(found.mean.lens[kCx], 359.5);
  EXPECT_EQ(found.mean.lens[kCy], 239.5);
  EXPECT_DOUBLE_EQ(found.sigma[kStateFocal], 0.3 * 655.0);
  EXPECT_NEAR(found.sigma[kStateCx], 0.02 * 865.3, 0.01);
  EXPECT_NEAR(found.mean.readout_s, 1.0 / 60, 1e-6);
  EXPECT_NEAR(found.mean.delay_s, 0.031 - 1.0 / 120, 1e-6);

  start.focal->determined = false;
  EXPECT_EQ(MakePrior(s.recording, start).mean.lens[kFocal], kUsualFocal * 720);
}

// Frame stamps that are times of arrival: frames have times of their own from the start on, unless
// the residual or attitudes cannot have them.
TEST(AddStartEffects, FreesTheTimesOfFramesThatAreStampedLate) {
  Recording recording = SimulateTracks(ShortScenario(2.0)).value().recording;
  const auto has_frame_times = [&](const PairResidual& residual) {
    Calibration calibration;
    EXPECT_TRUE(AddStartEffects(recording, {}, "", residual, &calibration));
    return calibration.effects != nullptr && calibration.effects->frame_time_spread() >= 0;
  };
  EXPECT_FALSE(has_frame_times(ByPlane()));
  recording.camera_stamps.emplace();
  recording.camera_stamps->kind = StampKind::kArrival;
  recording.camera_stamps->jitter_s = 3e-3;
  EXPECT_FALSE(has_frame_times(ByPlane()));  // --stamps=recorded
  recording.camera_stamps->repaired = true;
  EXPECT_TRUE(has_frame_times(ByPlane()));
  EXPECT_FALSE(has_frame_times(ByTransfer()));
  recording.tracks.clear();
  EXPECT_FALSE(has_frame_times(ByPlane()));
}

// A picture that is higher than wide may have been turned: its columns may be read, where the
// residual can have that.
TEST(AddStartEffects, ReadsColumnsOfTurnedPictures) {
  Recording recording = SimulateTracks(ShortScenario(2.0)).value().recording;
  std::vector<std::string> notes;
  const auto reads_columns = [&](const std::string& asked, const PairResidual& residual) {
    Calibration calibration;
    calibration.width_px = recording.camera.width_px;
    calibration.height_px = recording.camera.height_px;
    notes.clear();
    EXPECT_TRUE(AddStartEffects(recording, {}, asked, residual, &calibration, &notes));
    return calibration.effects != nullptr && calibration.effects->Has("readout_direction");
  };
  EXPECT_FALSE(reads_columns("", ByPlane()));
  std::swap(recording.camera.width_px, recording.camera.height_px);
  EXPECT_TRUE(reads_columns("", ByPlane()));
  EXPECT_THAT(notes, testing::ElementsAre(testing::HasSubstr("higher than wide")));
  EXPECT_TRUE(reads_columns("readout_direction", ByPlane()));
  EXPECT_THAT(notes, testing::IsEmpty());
  EXPECT_FALSE(reads_columns("", ByTransfer()));
}

// A phone in portrait, whose columns are read, in the hand of somebody who walks: the path of each
// match is that between its columns.
TEST(CalibrateRecording, OfAPictureThatWasTurned) {
  Scenario scenario = ShortScenario(12.0);
  scenario.camera.width_px = 480;
  scenario.camera.height_px = 720;
  scenario.camera.principal_px = {239.5, 359.5};
  scenario.motion = simulation::MotionPreset(simulation::MotionKind::kWalking);
  scenario.effects.readout_direction.columns = true;
  const Simulated s = SimulateTracks(scenario).value();
  const Result<CalibrationReport> report =
      CalibrateRecording(s.recording, RotationsOfPictures(s.recording, 100), {});
  ASSERT_TRUE(report.has_value()) << report.error().message;
  const Calibration& c = report->calibration;
  ASSERT_TRUE(c.effects && c.effects->Has("readout_direction"));
  EXPECT_NEAR(c.effect_values[0], 0.02, 4.0 * std::sqrt(c.effect_covariance(0, 0)));
  EXPECT_LT(c.effect_covariance(0, 0), std::pow(0.5e-3, 2));
  Calibration truth = s.truth;
  truth.readout_s = 0.0;  // of rows
  const StateVector error = ErrorInSigmas(c, truth);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.0) << error.transpose();
}

}  // namespace
}  // namespace camgyro
