// `camgyro compare` as a user runs it, and its input.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "estimator/reference/implicit_ekf.h"
#include "simulation/simulate.h"
#include "tests/measured_data.h"
#include "tests/tools/run_camgyro.h"
#include "tools/comparison/comparison_input.h"

namespace camgyro {
namespace {

using comparison::Case;
using comparison::Input;
using comparison::MakeInput;
using comparison::ResolveCase;
using comparison::StartKind;
using testing::AllOf;
using testing::HasSubstr;

constexpr char kSmall[] = R"(
duration_s: 2
motion: {kind: running}
camera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}
tracks: {count: 40, noise_px: 0.1}
)";

class CompareTest : public CamgyroTest {
 protected:
  void WriteScenario(const std::string& name) const { std::ofstream(Path(name)) << kSmall; }
};

TEST_F(CompareTest, RunsScenariosAndWritesTablesAndPlots) {
  WriteScenario("small.yaml");
  const RunResult run = Run("compare small.yaml tracks.noise_px=0.2 --seeds=3 --jobs=2 --out=c");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("small: 3 runs, 41 frames, noise 0.2 px"),
                             HasSubstr("  window     NEES/dof"), HasSubstr("  refinement NEES/dof"),
                             HasSubstr("  ekf        NEES/dof"), HasSubstr("/ bound")));
  const YAML::Node all = YAML::LoadFile(Path("c/compare.yaml"))["cases"][0];
  EXPECT_EQ(all["name"].as<std::string>(), "small");
  ASSERT_EQ(all["estimators"].size(), 3u);
  const YAML::Node window = all["estimators"][0];
  EXPECT_EQ(window["estimator"].as<std::string>(), "window");
  EXPECT_EQ(window["runs"].as<int>(), 3);
  const YAML::Node delay = window["parameters"]["delay_s"];
  EXPECT_LT(delay["rmse"].as<double>(), 3e-3);  // from a start that is 10 ms off
  EXPECT_GT(delay["bound"].as<double>(), 1e-6);
  EXPECT_LT(delay["bound"].as<double>(), 1e-3);
  EXPECT_GT(window["ms_per_frame"].as<double>(), 0.0);
  // Same seeds, same numbers; only time and memory differ.
  const RunResult again = Run("compare small.yaml tracks.noise_px=0.2 --seeds=3 --jobs=3 --out=d");
  EXPECT_EQ(ReadFile(Path("d/traces.csv")), ReadFile(Path("c/traces.csv")));
  EXPECT_EQ(ReadFile(Path("d/errors_small.svg")), ReadFile(Path("c/errors_small.svg")));
  EXPECT_THAT(ReadFile(Path("c/compare.md")),
              AllOf(HasSubstr("### small: 3 runs, 41 frames, noise 0.2 px"),
                    HasSubstr("| bound | window | refinement | ekf |"), HasSubstr("| t_d [ms] |")));
  std::stringstream runs(ReadFile(Path("c/runs.csv")));
  std::string line;
  int rows = 0;
  while (std::getline(runs, line)) ++rows;
  EXPECT_EQ(rows, 1 + 3 * 3);
}

// Where only the camera turns, transfers are right; where it moves, they are not. Without loss,
// wrong matches show.
TEST_F(CompareTest, RunsTheResidualAndTheLossThatAreAsked) {
  WriteScenario("small.yaml");
  const auto focal_error = [&](const std::string& arguments) {
    const RunResult run =
        Run("compare small.yaml --estimators=window,refinement --seeds=2 --out=c " + arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const YAML::Node all = YAML::LoadFile(Path("c/compare.yaml"))["cases"][0]["estimators"];
    return Eigen::Vector2d(all[0]["parameters"]["focal_px"]["rmse"].as<double>(),
                           all[1]["parameters"]["focal_px"]["rmse"].as<double>());
  };
  const std::string turning = "motion.kind=rotation ";
  for (const char* residual : {"plane", "determinant", "transfer"}) {
    SCOPED_TRACE(residual);
    const std::string flag = std::string(" --residual=") + residual;
    const Eigen::Vector2d turns = focal_error(turning + flag), moves = focal_error(flag);
    EXPECT_LT(turns.maxCoeff(), 1.5);
    if (residual == std::string("transfer")) {
      EXPECT_GT(moves.minCoeff(), 3.0);
    } else {
      EXPECT_LT(moves.maxCoeff(), 1.5);
    }
  }
  const std::string wrong = "tracks.outlier_fraction=0.05 ";
  EXPECT_GT(focal_error(wrong + "--norobust").minCoeff(), 3.0 * focal_error(wrong).maxCoeff());
}

TEST_F(CompareTest, RunsRecordingsFromWhatTheyDeclare) {
  Simulate(kSmall, "a");
  std::filesystem::rename(Path("a/truth.yaml"), Path("truth.yaml"));
  // sensor.yaml of a simulated recording has no mounting.
  std::ofstream(Path("a/cam0/sensor.yaml"))
      << "resolution: [320, 240]\nintrinsics: [300, 300, 160, 120]\nreadout_time: 0.021\n"
         "timeshift_cam_imu: 0.01\nT_BS:\n  rows: 4\n  cols: 4\n"
         "  data: [0, -1, 0, 0, -1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]\n";
  const RunResult run = Run("compare a --truth=truth.yaml --estimators=refinement,ekf --out=c");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("a: 1 run, 41 frames\n"), HasSubstr("  refinement NEES")));
  const YAML::Node all = YAML::LoadFile(Path("c/compare.yaml"))["cases"][0]["estimators"];
  ASSERT_EQ(all.size(), 2u);
  // The mounting is 4.5 deg off the declared one, far outside of the paper's prior: what counts
  // here is that both began there, and that the refinement found the focal length all the same.
  EXPECT_LT(all[0]["parameters"]["focal_px"]["rmse"].as<double>(), 5.0);
  EXPECT_TRUE(std::isnan(all[0]["parameters"]["focal_px"]["bound"].as<double>()));
}

// OpenVINS' simulation: 30 ms of delay, which the paper's start does not know.
TEST_F(CompareTest, RunsOnAMeasuredRecording) {
  const auto recording = MeasuredData("ov_handheld_rs");
  if (!recording) GTEST_SKIP() << "no measured recordings";
  const RunResult run = Run("compare " + *recording + " --estimators=ekf --out=c");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("ov_handheld_rs: 1 run, 1800 frames"));
  const YAML::Node ekf = YAML::LoadFile(Path("c/compare.yaml"))["cases"][0]["estimators"][0];
  EXPECT_LT(ekf["parameters"]["delay_s"]["rmse"].as<double>(), 3e-3);
}

TEST_F(CompareTest, BadUsageIsTwoAndSaysWhat) {
  WriteScenario("small.yaml");
  Simulate(kSmall, "a");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"compare", "got 0 arguments"},
      {"compare duration_s=3", "no recording and no scenario given"},
      {"compare runing", "did you mean running?"},
      {"compare no_such_folder", "neither a recording, nor a scenario file, nor a motion"},
      {"compare walking walking", "`walking` is given twice"},
      {"compare walking --seeds=0", "--seeds: expected 1 or more"},
      {"compare walking --estimators=window,kalman", "`kalman`: expected window, refinement"},
      {"compare walking --residual=point", "expected plane, determinant or transfer"},
      {"compare walking --start=here", "expected auto, drawn, declared or found"},
      {"compare walking --ekf_sigma_px=0", "--ekf_sigma_px: expected a positive number"},
      {"compare walking --ekf_triplets=0", "--ekf_triplets: expected 1 or more"},
      {"compare a --truth=a/truth.yaml,b.yaml", "--truth: 2 files for 1 recordings"},
      {"compare a duration_s=3", "changes scenarios, and there is none"}};
  for (const auto& [arguments, message] : cases) {
    SCOPED_TRACE(arguments);
    const RunResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(message));
    EXPECT_EQ(result.out, "");
  }
}

TEST_F(CompareTest, BadInputIsThreeAndSaysWhat) {
  Simulate(kSmall, "a");
  // No lens is declared.
  RunResult run = Run("compare a --out=c");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err,
              AllOf(HasSubstr("--start=declared needs a focal length"), HasSubstr("a, run 0")));
  EXPECT_FALSE(Exists("c"));
  // An unknown key of a scenario.
  run = Run("compare walking camera.focal=3");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("did you mean focal_px?"));
  // Pictures of another size.
  std::string truth = ReadFile(Path("a/truth.yaml"));
  const size_t at = truth.find("320");
  ASSERT_NE(at, std::string::npos);
  std::ofstream(Path("big.yaml")) << truth.replace(at, 3, "640");
  run = Run("compare a --truth=big.yaml --start=drawn");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("for pictures of 640 x 240, but those of a are 320 x 240"));
  // A gyro that ran at another time.
  EditCsv("a/imu0/data.csv", [](int, Row& row) {
    row[0] = std::to_string(std::stoll(row[0]) + 2'500'000'000);
    return true;
  });
  run = Run("compare a --start=drawn");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("the gyro covers only"));
  // No truth.
  std::filesystem::remove(Path("a/truth.yaml"));
  run = Run("compare a");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("a: no truth: a/truth.yaml is not there"));
}

// Over many seeds, the start's errors have the prior's standard deviations.
TEST(MakeInput, DrawsStartsFromThePrior) {
  const Case from =
      ResolveCase("walking", {"duration_s=0.1", "tracks.count=5", "seed=100"}, "").value();
  StateVector sum = StateVector::Zero(), sum_sq = StateVector::Zero();
  const int kRuns = 200;
  for (int i = 0; i < kRuns; ++i) {
    const Input input = MakeInput(from, static_cast<uint64_t>(i), StartKind::kDrawn).value();
    EXPECT_EQ(Difference(input.start, input.prior.mean).norm(), 0.0);
    const StateVector z = Difference(input.start, input.truth).cwiseQuotient(input.prior.sigma);
    sum += z;
    sum_sq += z.cwiseAbs2();
  }
  EXPECT_LT((sum / kRuns).cwiseAbs().maxCoeff(), 4.0 / std::sqrt(kRuns));
  EXPECT_LT((sum_sq / kRuns - StateVector::Ones()).cwiseAbs().maxCoeff(),
            4.0 * std::sqrt(2.0 / kRuns));
  const Input input = MakeInput(from, 0, StartKind::kDrawn).value();
  EXPECT_EQ(input.prior.sigma, PaperStart(input.truth).sigma);
}

TEST(MakeInput, ExactMatchesAreThoseWithoutNoise) {
  const Case from = ResolveCase("walking",
                                {"duration_s=0.5", "tracks.count=60", "tracks.noise_px=0.5",
                                 "tracks.outlier_fraction=0.2", "tracks.outlier_px=50"},
                                "")
                        .value();
  const Input input = MakeInput(from, 0, StartKind::kDrawn).value();
  // As recorded: of the input's tracks, wrong points are taken out.
  const auto recorded = simulation::SimulateTracks(*from.scenario, from.scenario->seed).value();
  const auto noisy = PairsFromTracks(recorded.recording.tracks, 1);
  ASSERT_EQ(noisy.size(), input.exact_matches.size());
  size_t exact = 0, all = 0;
  for (size_t k = 0; k < noisy.size(); ++k) {
    exact += input.exact_matches[k].matches.size();
    all += noisy[k].matches.size();
    for (const Match& match : input.exact_matches[k].matches) {
      double nearest = 1e9;
      for (const Match& other : noisy[k].matches) {
        nearest = std::min(nearest, (match.px_a - other.px_a).norm());
      }
      EXPECT_LT(nearest, 3.0);
      EXPECT_GT(nearest, 0.0);
    }
  }
  // Both observations of a match must be good: 64 %, a little more since wrong ones get lost.
  EXPECT_NEAR(static_cast<double>(exact) / static_cast<double>(all), 0.66, 0.08);
}

}  // namespace
}  // namespace camgyro
