// Exports against files written by hand from the other programs' documented keys
// (tests/tools/export/golden), and their meaning of time and axes against ours.
#include "tools/export/export.h"

#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core/persistence.hpp>
#include <set>

#include "core/so3.h"
#include "core/time.h"
#include "frontend/readers/read_recording.h"
#include "pipeline/read_calibration.h"
#include "tests/paths.h"
#include "tests/tools/run_camgyro.h"

namespace camgyro {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kGolden = SourceDir() + "/tests/tools/export/golden/";

// The differences of two YAML trees, numbers to 1e-9; keys of `expected` only, or of
// both.
void Compare(const YAML::Node& actual, const YAML::Node& expected, const std::string& where,
             bool exact_keys, std::vector<std::string>* differences) {
  if (actual.Type() != expected.Type()) {
    differences->push_back(where + ": another kind of value");
  } else if (expected.IsMap()) {
    for (const auto& entry : expected) {
      const auto key = entry.first.as<std::string>();
      if (!actual[key]) {
        differences->push_back(where + "/" + key + ": missing");
      } else {
        Compare(actual[key], entry.second, where + "/" + key, exact_keys, differences);
      }
    }
    for (const auto& entry : actual) {
      const auto key = entry.first.as<std::string>();
      if (exact_keys && !expected[key]) differences->push_back(where + "/" + key + ": unexpected");
    }
  } else if (expected.IsSequence()) {
    if (actual.size() != expected.size()) differences->push_back(where + ": another length");
    for (size_t i = 0; i < std::min(actual.size(), expected.size()); ++i) {
      Compare(actual[i], expected[i], where + "/" + std::to_string(i), exact_keys, differences);
    }
  } else if (expected.IsScalar()) {
    double a = 0.0, e = 0.0;
    const bool same =
        YAML::convert<double>::decode(actual, a) && YAML::convert<double>::decode(expected, e)
            ? std::abs(a - e) <= 1e-9 * std::abs(e) + 1e-15
            : actual.Scalar() == expected.Scalar();
    if (!same) {
      differences->push_back(where + ": " + actual.Scalar() + ", expected " + expected.Scalar());
    }
  }
}

class ExportTest : public CamgyroTest {
 protected:
  void SetUp() override {
    CamgyroTest::SetUp();
    const auto calibration = ReadCalibration(kGolden + "calibration.yaml");
    ASSERT_TRUE(calibration) << calibration.error().message;
    calibration_ = *calibration;
  }

  void Export(const std::string& format, const std::string& more = "") const {
    const RunResult run =
        Run("export " + kGolden + "calibration.yaml --format=" + format + " --out=. " + more);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, AllOf(HasSubstr("written"), HasSubstr("not determined by the motion"),
                               HasSubstr("cx_px"), HasSubstr("does not hold: clock_skew\n")));
  }

  // JSON is YAML; OpenCV's first line is not.
  YAML::Node Load(const std::string& path) const {
    std::string text = ReadFile(path);
    if (text.rfind("%YAML", 0) == 0) text[0] = '#';
    return YAML::Load(text);
  }

  void ExpectLikeGolden(const std::string& name, const std::string& golden,
                        bool exact_keys = true) const {
    std::vector<std::string> differences;
    Compare(Load(Path(name)), Load(kGolden + golden), "", exact_keys, &differences);
    EXPECT_THAT(differences, testing::IsEmpty()) << name;
  }

  double OurRowTime(double stamp_s, double v) const {
    return stamp_s + calibration_.delay_s + calibration_.readout_s * v / calibration_.height_px;
  }

  Calibration calibration_;
};

TEST_F(ExportTest, Kalibr) {
  Export("kalibr");
  ExpectLikeGolden("camchain-imucam.yaml", "camchain-imucam.yaml");
  ExpectLikeGolden("imu.yaml", "imu.yaml");
  EXPECT_THAT(ReadFile(Path("camchain-imucam.yaml")),
              HasSubstr("t_imu = t_cam + timeshift_cam_imu for row 0"));
  EXPECT_THAT(ReadFile(Path("imu.yaml")), HasSubstr("TYPICAL VALUE, not measured"));

  const YAML::Node cam = Load(Path("camchain-imucam.yaml"))["cam0"];
  for (const double v : {0.0, 100.0, 479.0}) {
    EXPECT_NEAR(7.0 + cam["timeshift_cam_imu"].as<double>() + cam["line_delay"].as<double>() * v,
                OurRowTime(7.0, v), 1e-9);
  }
}

TEST_F(ExportTest, VinsMono) {
  Export("vins_mono");
  ExpectLikeGolden("vins_mono.yaml", "vins_mono.yaml");
  // As VINS reads it; and the time of a row as in its ProjectionTdFactor.
  const cv::FileStorage file(Path("vins_mono.yaml"), cv::FileStorage::READ);
  ASSERT_TRUE(file.isOpened());
  cv::Mat R;
  file["extrinsicRotation"] >> R;
  ASSERT_EQ(R.type(), CV_64F);
  EXPECT_EQ(R.at<double>(0, 1), -1.0);
  EXPECT_EQ(R.at<double>(1, 0), 1.0);
  const double td = file["td"], tr = file["rolling_shutter_tr"];
  const int rows = file["image_height"];
  for (const double v : {0.0, 100.0, 479.0}) {
    EXPECT_NEAR(7.0 + td + tr / rows * (v - rows / 2.0), OurRowTime(7.0, v), 1e-9);
  }
  EXPECT_THAT(ReadFile(Path("vins_mono.yaml")), HasSubstr("(v - h / 2)"));
}

TEST_F(ExportTest, VinsFusion) {
  Export("vins_fusion");
  ExpectLikeGolden("vins_fusion.yaml", "vins_fusion.yaml");
  ExpectLikeGolden("cam0_pinhole.yaml", "cam0_pinhole.yaml");
  const cv::FileStorage file(Path("vins_fusion.yaml"), cv::FileStorage::READ);
  cv::Mat T;
  file["body_T_cam0"] >> T;
  ASSERT_EQ(T.rows, 4);
  EXPECT_EQ(T.at<double>(0, 1), -1.0);
  EXPECT_NEAR(7.0 + static_cast<double>(file["td"]), OurRowTime(7.0, 240.0), 1e-9);
  const cv::FileStorage camera(Path("cam0_pinhole.yaml"), cv::FileStorage::READ);
  EXPECT_EQ(static_cast<double>(camera["projection_parameters"]["fx"]), 510.0);
}

TEST_F(ExportTest, OpenVins) {
  Export("openvins");
  ExpectLikeGolden("kalibr_imucam_chain.yaml", "kalibr_imucam_chain.yaml");
  ExpectLikeGolden("kalibr_imu_chain.yaml", "kalibr_imu_chain.yaml");
  std::istringstream words(ReadFile(kGolden + "estimator_config_keys.txt"));
  const std::set<std::string> expected{std::istream_iterator<std::string>(words), {}};
  std::set<std::string> keys;
  const YAML::Node config = Load(Path("estimator_config.yaml"));
  for (const auto& entry : config) keys.insert(entry.first.as<std::string>());
  EXPECT_EQ(keys, expected);
  EXPECT_EQ(config["init_dyn_bias_g"].as<std::vector<double>>(),
            (std::vector<double>{0.01, -0.02, 0.015}));
  // OpenVINS reads all three with OpenCV.
  for (const char* name :
       {"estimator_config.yaml", "kalibr_imucam_chain.yaml", "kalibr_imu_chain.yaml"}) {
    EXPECT_TRUE(cv::FileStorage(Path(name), cv::FileStorage::READ).isOpened()) << name;
  }
  const cv::FileStorage chain(Path("kalibr_imucam_chain.yaml"), cv::FileStorage::READ);
  EXPECT_EQ(static_cast<double>(chain["cam0"]["T_imu_cam"][1][0]), 1.0);
  EXPECT_NEAR(7.0 + static_cast<double>(chain["cam0"]["timeshift_cam_imu"]), OurRowTime(7.0, 240.0),
              1e-9);
}

// And camgyro takes it as a guess that is the calibration again.
TEST_F(ExportTest, Euroc) {
  Simulate("duration_s: 0.2\ncamera: {resolution: [640, 480]}\n", "a");
  Export("euroc");
  ExpectLikeGolden("cam0/sensor.yaml", "cam0_sensor.yaml");
  ExpectLikeGolden("imu0/sensor.yaml", "imu0_sensor.yaml");
  Export("euroc", "--recording=a");
  for (const char* name : {"cam0/sensor.yaml", "imu0/sensor.yaml"}) {
    std::filesystem::copy(Path(name), Path(std::string("a/") + name),
                          std::filesystem::copy_options::overwrite_existing);
  }
  const Result<Recording> recording = ReadRecording(Path("a"));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(recording->notes, testing::IsEmpty());  // the rates are right, too
  const CameraGuess& guess = recording->camera;
  EXPECT_EQ(*guess.focal_px, 500.0);
  EXPECT_NEAR(guess.aspect_ratio, 1.02, 1e-9);
  EXPECT_EQ(guess.distortion, (std::vector<double>{-0.28, 0.07, 0.0002, 0.00002}));
  EXPECT_EQ(*guess.readout_s, 0.024);
  EXPECT_EQ(*guess.delay_s, 0.018);
  EXPECT_LT(guess.q_gyro_cam->angularDistance(calibration_.q_gyro_cam), 1e-9);
}

TEST_F(ExportTest, Json) {
  Export("json");
  ExpectLikeGolden("calibration.json", "calibration.json", /*exact_keys=*/false);
  const auto json = nlohmann::json::parse(ReadFile(Path("calibration.json")));
  EXPECT_EQ(json["covariance"]["matrix"].size(), static_cast<size_t>(kStateSize));
  EXPECT_EQ(json["covariance"]["order"][4], "delay_s");
  EXPECT_THAT(json["conventions"]["time"].get<std::string>(), HasSubstr("row v"));
}

TEST_F(ExportTest, GyroflowWithoutARecording) {
  Export("gyroflow");
  ExpectLikeGolden("lens_profile.json", "lens_profile.json");
  const auto sync = nlohmann::json::parse(ReadFile(Path("sync.gyroflow")));
  EXPECT_NEAR(sync["offsets"]["0"].get<double>(), -30.0, 1e-9);
  EXPECT_FALSE(Exists("gyro.gcsv"));
}

// Gyroflow's own way from its files to a picture's motion, written down anew from its
// GyroIntegrator and FrameTransform, on a simulated recording without translation: points must move
// as the files say.
TEST_F(ExportTest, GyroflowPredictsTheMotionOfPoints) {
  Simulate(
      "duration_s: 2\nmotion: {kind: rotation}\ncamera: {delay_s: 0.3, readout_s: 0.025}\n"
      "gyro: {rate_hz: 1000, noise_density_rad_s_rtHz: 0, bias_walk_rad_s2_rtHz: 0}\n"
      "tracks: {count: 40, noise_px: 0}\n",
      "a");
  ASSERT_EQ(Run("export a/truth.yaml --format=gyroflow --out=. --recording=a").exit_code, 0);
  const auto lens = nlohmann::json::parse(ReadFile(Path("lens_profile.json")));
  const auto sync = nlohmann::json::parse(ReadFile(Path("sync.gyroflow")));
  EXPECT_NEAR(lens["fps"].get<double>(), 30.0, 0.01);

  // Orientations after each sample of the log.
  std::istringstream log(ReadFile(Path("gyro.gcsv")));
  std::string line;
  while (std::getline(log, line) && line.rfind("t,gx", 0) != 0) {
    EXPECT_THAT(line, Not(HasSubstr("orientation,Y")));
  }
  std::vector<std::pair<double, Eigen::Quaterniond>> orientations;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  while (std::getline(log, line)) {
    double t_us = 0.0, gx = 0.0, gy = 0.0, gz = 0.0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &t_us, &gx, &gy, &gz), 4);
    const double t_ms = 1e-3 * t_us;
    const double dt_s = orientations.empty() ? 0.0 : 1e-3 * (t_ms - orientations.back().first);
    q = q * Exp(Eigen::Vector3d(dt_s * Eigen::Vector3d(-gy, gx, gz)));
    orientations.emplace_back(t_ms, q);
  }
  const auto orientation_at = [&](double t_ms) {
    const auto after =
        std::upper_bound(orientations.begin(), orientations.end(), t_ms,
                         [](double t, const std::pair<double, Eigen::Quaterniond>& entry) {
                           return t < entry.first;
                         });
    const auto before = after - 1;
    return before->second.slerp((t_ms - before->first) / (after->first - before->first),
                                after->second);
  };
  const double offset_ms = sync["offsets"]["0"], readout_ms = lens["frame_readout_time"];
  const auto K = lens["fisheye_params"]["camera_matrix"];
  const double f = K[0][0], cx = K[0][2], cy = K[1][2], height = lens["calib_dimension"]["h"];
  const Eigen::Matrix3d flip = Eigen::Vector3d(1, -1, -1).asDiagonal();
  const auto world_ray = [&](double video_ms, const Eigen::Vector2d& px) {
    const double row_ms = video_ms - 0.5 * readout_ms + readout_ms * px.y() / height;
    const Eigen::Vector3d ray((px.x() - cx) / f, (px.y() - cy) / f, 1.0);
    return Eigen::Vector3d(orientation_at(row_ms - offset_ms) * (flip * ray.normalized()));
  };

  const Result<Recording> recording = ReadRecording(Path("a"));
  ASSERT_TRUE(recording) << recording.error().message;
  constexpr size_t kGap = 10;  // frames
  double sum_square_px = 0.0, sum_motion_px = 0.0;
  int matches = 0;
  for (size_t i = 0; i + kGap < recording->frames.size(); ++i) {
    std::map<int64_t, Eigen::Vector2d> before;
    for (const TrackedPoint& point : recording->tracks[i]) before[point.track_id] = point.px;
    const auto video_ms = [&](size_t frame) {
      return 1e3 * SecondsSince(recording->frames[0].stamp_ns, recording->frames[frame].stamp_ns);
    };
    for (const TrackedPoint& point : recording->tracks[i + kGap]) {
      const auto found = before.find(point.track_id);
      if (found == before.end()) continue;
      const Eigen::Vector3d a = world_ray(video_ms(i), found->second);
      const Eigen::Vector3d b = world_ray(video_ms(i + kGap), point.px);
      sum_square_px += (f * (a - b)).squaredNorm();
      sum_motion_px += (found->second - point.px).norm();
      ++matches;
    }
  }
  ASSERT_GT(matches, 500);
  EXPECT_GT(sum_motion_px / matches, 30.0);
  // 0.36: the integrator lags by half a sample (0.5 ms). An offset of row 0 instead: 8.6.
  EXPECT_LT(std::sqrt(sum_square_px / matches), 0.5);
}

// The log that was exported, read back beside its video, turns as the camera does.
TEST_F(ExportTest, GyroflowLogIsReadBack) {
  Simulate(
      "duration_s: 0.3\nscene: {kind: room}\nmotion: {path_radius_m: 1}\n"
      "camera: {resolution: [320, 240], focal_px: 290}\nvideo: {format: mp4}\n",
      "a");
  ASSERT_EQ(Run("export a/truth.yaml --format=gyroflow --out=. --recording=a").exit_code, 0);
  std::filesystem::copy(Path("a/cam0/video.mp4"), Path("gyro.mp4"));
  const Result<Recording> before = ReadRecording(Path("a"));
  const Result<Recording> after = ReadRecording(Path("gyro.gcsv"));
  const Result<Calibration> truth = ReadCalibration(Path("a/truth.yaml"));
  ASSERT_TRUE(before && after && truth);
  ASSERT_EQ(after->gyro.size(), before->gyro.size());
  EXPECT_EQ(after->frames.size(), before->frames.size());
  EXPECT_NEAR(*after->camera.readout_s, truth->readout_s, 1e-9);
  Eigen::Matrix3d R_gyroflow_cam;
  R_gyroflow_cam << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  for (size_t i = 0; i < before->gyro.size(); ++i) {
    const Eigen::Vector3d w_cam =
        truth->q_gyro_cam.conjugate() *
        Eigen::Vector3d(before->gyro[i].omega_gyro_rad_s - truth->bias_gyro_rad_s);
    EXPECT_LT((after->gyro[i].omega_gyro_rad_s - R_gyroflow_cam * w_cam).norm(), 1e-8);
    EXPECT_NEAR(SecondsSince(0, after->gyro[i].stamp_ns),
                SecondsSince(before->gyro[0].stamp_ns, before->gyro[i].stamp_ns), 1e-6);
  }
}

TEST_F(ExportTest, ReversedReadout) {
  const std::string text = ReadFile(kGolden + "calibration.yaml");
  std::string reversed = text;
  reversed.replace(reversed.find("0.024"), 5, "-0.024");
  std::ofstream(Path("reversed.yaml")) << reversed;
  Simulate("duration_s: 0.2\ncamera: {resolution: [640, 480]}\n", "a");
  ASSERT_EQ(Run("export reversed.yaml --format=gyroflow --out=. --recording=a --quiet").exit_code,
            0);
  EXPECT_THAT(ReadFile(Path("gyro.gcsv")), AllOf(HasSubstr("frame_readout_time,24\n"),
                                                 HasSubstr("frame_readout_direction,1\n")));
  const auto lens = nlohmann::json::parse(ReadFile(Path("lens_profile.json")));
  EXPECT_NEAR(lens["frame_readout_time"].get<double>(), -24.0, 1e-12);
}

TEST_F(ExportTest, KannalaBrandt) {
  std::string text = ReadFile(kGolden + "calibration.yaml");
  text.replace(text.find("radtan, value: [-0.28, 0.07, 0.0002, 0.00002]"), 45,
               "kannala_brandt, value: [0.02, -0.01, 0.006, -0.002]");
  std::ofstream(Path("wide.yaml")) << text;
  const auto exported = [&](const std::string& format, const std::string& file) {
    EXPECT_EQ(Run("export wide.yaml --format=" + format + " --out=. --quiet").exit_code, 0);
    return ReadFile(Path(file));
  };
  const auto coefficients = HasSubstr("[0.02, -0.01, 0.006, -0.002]  # k1, k2, k3, k4");
  EXPECT_THAT(exported("kalibr", "camchain-imucam.yaml"),
              AllOf(HasSubstr("distortion_model: equidistant\n"), coefficients));
  EXPECT_THAT(exported("openvins", "kalibr_imucam_chain.yaml"),
              AllOf(HasSubstr("distortion_model: equidistant\n"), coefficients));
  const auto camodocal =
      AllOf(HasSubstr("model_type: KANNALA_BRANDT\n"),
            HasSubstr("   k2: 0.02\n   k3: -0.01\n   k4: 0.006\n   k5: -0.002\n   mu: 510\n   mv: "
                      "500\n   u0: 320.5\n   v0: 239.5\n"));
  EXPECT_THAT(exported("vins_mono", "vins_mono.yaml"), camodocal);
  EXPECT_THAT(exported("vins_fusion", "cam0_kannala_brandt.yaml"), camodocal);
  EXPECT_THAT(ReadFile(Path("vins_fusion.yaml")), HasSubstr("\"cam0_kannala_brandt.yaml\""));
  const auto lens = nlohmann::json::parse(exported("gyroflow", "lens_profile.json"));
  EXPECT_EQ(lens["distortion_model"], "opencv_fisheye");
  EXPECT_EQ(lens["fisheye_params"]["distortion_coeffs"],
            nlohmann::json({0.02, -0.01, 0.006, -0.002}));
  const auto json = nlohmann::json::parse(exported("json", "calibration.json"));
  EXPECT_EQ(json["distortion"]["model"], "kannala_brandt");
  // What is written for a recording is read from it.
  Simulate("duration_s: 0.2\ncamera: {resolution: [640, 480]}\n", "a");
  std::ofstream(Path("a/cam0/sensor.yaml")) << exported("euroc", "cam0/sensor.yaml");
  const Result<Recording> recording = ReadRecording(Path("a"));
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->camera.distortion_model, DistortionModel::kKannalaBrandt);
  EXPECT_THAT(recording->camera.distortion, testing::ElementsAre(0.02, -0.01, 0.006, -0.002));
}

TEST_F(ExportTest, BadUsageAndInput) {
  std::ofstream(Path("c.yaml")) << "camera: {resolution: [64, 48], focal_px: 50}\n";
  Simulate("duration_s: 0.2\n", "a");
  const std::vector<std::tuple<std::string, int, std::string>> cases = {
      {"export c.yaml --out=x", 2, "--format=: expected one of kalibr, vins_mono"},
      {"export c.yaml --format=Kalibr --out=x", 2, "--format=Kalibr: expected one of"},
      {"export c.yaml --format=kalibr", 2, "--out: expected a folder"},
      {"export none.yaml --format=kalibr --out=x", 3, "none.yaml: cannot be opened"},
      {"export c.yaml --format=kalibr --out=x --recording=none", 3, "none: does not exist"},
      {"export c.yaml --format=kalibr --out=x --recording=a", 3,
       "a: its pictures have 720 x 480 pixels, but c.yaml is of 64 x 48"},
  };
  for (const auto& [arguments, code, complaint] : cases) {
    const RunResult run = Run(arguments);
    EXPECT_EQ(run.exit_code, code) << arguments;
    EXPECT_THAT(run.err, HasSubstr(complaint));
  }
  EXPECT_FALSE(Exists("x"));
}

}  // namespace
}  // namespace camgyro
