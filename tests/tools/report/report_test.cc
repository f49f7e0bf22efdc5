// report.html as a browser sees it, and the pieces it is made of.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "frontend/readers/read_recording.h"
#include "tests/paths.h"
#include "tests/tools/run_camgyro.h"
#include "tools/report/charts.h"
#include "tools/report/page.h"
#include "tools/report/recording_sections.h"
#include "tools/report/residual_sections.h"

namespace camgyro {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr char kHandheld[] = R"(
duration_s: 3
camera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}
tracks: {count: 50, noise_px: 0.2}
)";
constexpr char kSlow[] = R"(
duration_s: 2
motion: {kind: panning}
camera: {resolution: [320, 240], focal_px: 290, rate_hz: 20}
tracks: {count: 50, noise_px: 0.5}
)";

int Count(const std::string& text, const std::string& what) {
  int count = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

class ReportTest : public CamgyroTest {
 protected:
  static bool HasBrowser() {
    return std::system("command -v chromium-headless-shell >/dev/null") == 0;
  }
  struct Page {
    std::string dom;      // after all scripts have run
    std::string console;  // what they and the browser complained of
  };
  Page Load(const std::string& file) const {
    const int status = std::system(
        ("timeout 120 chromium-headless-shell --no-sandbox --disable-gpu --user-data-dir=" +
         Path("browser") + " --enable-logging=stderr --window-size=1100,3000 --dump-dom file://" +
         file + " >" + Path("dom.html") + " 2>" + Path("browser.log"))
            .c_str());
    EXPECT_EQ(status, 0);
    Page page;
    page.dom = ReadFile(Path("dom.html"));
    std::stringstream log(ReadFile(Path("browser.log")));
    for (std::string line; std::getline(log, line);) {
      if (line.find(":CONSOLE") != std::string::npos) page.console += line + "\n";
    }
    return page;
  }
  // The node at a path such as "camera.principal_px.value.0".
  static YAML::Node At(YAML::Node node, const std::string& path) {
    std::stringstream keys(path);
    for (std::string key; std::getline(keys, key, '.');) {
      node.reset(node.IsSequence() ? node[std::stoul(key)] : node[key]);
    }
    return node;
  }
};

TEST_F(ReportTest, BrowserShowsTheNumbersOfTheCalibration) {
  if (!HasBrowser()) {
    GTEST_SKIP() << "chromium-headless-shell is not installed: the report is NOT TESTED in a "
                    "browser";
  }
  // A name that would be an element, whose request the page's policy would complain of.
  Simulate(kHandheld, "<img src=x onerror=alert(1)>");
  ASSERT_EQ(Run("calibrate '<img src=x onerror=alert(1)>' --out=result --quiet").exit_code, 0);
  const Page page = Load(Path("result/report.html"));
  EXPECT_EQ(page.console, "");
  EXPECT_THAT(page.dom, AllOf(HasSubstr("&lt;img src=x onerror"), Not(HasSubstr("<img src=x"))));
  // 11 parameters, the delay search, 3 rates, 3 profiles; dygraphs draws each on two canvases.
  EXPECT_THAT(page.dom, HasSubstr("data-charts=\"18\""));
  EXPECT_EQ(Count(page.dom, "<figure class=\"chart\""), 18);
  EXPECT_EQ(Count(page.dom, "<canvas"), 2 * 18);
  EXPECT_EQ(Count(page.dom, "class=\"map\""), 2);  // at the start, calibrated

  const YAML::Node yaml = YAML::LoadFile(Path("result/calibration.yaml"));
  int compared = 0;
  const std::string key_begin = "data-key=\"", value_begin = "data-value=\"";
  for (size_t at = page.dom.find(key_begin); at != std::string::npos;
       at = page.dom.find(key_begin, at + 1)) {
    const size_t key = at + key_begin.size();
    const size_t value = page.dom.find(value_begin, key) + value_begin.size();
    const std::string path = page.dom.substr(key, page.dom.find('"', key) - key);
    const double expected = At(yaml, path).as<double>();
    EXPECT_NEAR(std::stod(page.dom.substr(value)), expected, 2e-9 * std::abs(expected)) << path;
    ++compared;
  }
  EXPECT_EQ(compared, 8 + 11 + 8);  // values but the rotation's, sigmas, quality
  // What people read is the rounded value.
  EXPECT_NEAR(std::stod(page.dom.substr(page.dom.find('>', page.dom.find("focal_px.value")) + 1)),
              yaml["camera"]["focal_px"]["value"].as<double>(),
              0.06 * yaml["camera"]["focal_px"]["sigma"].as<double>());
}

// The two ways a page could be broken are seen by the test above.
TEST_F(ReportTest, BrowserTestSeesErrorsAndRequests) {
  if (!HasBrowser()) {
    GTEST_SKIP() << "chromium-headless-shell is not installed: the report is NOT TESTED in a "
                    "browser";
  }
  const auto load = [&](const std::string& html) {
    std::ofstream(Path("page.html")) << ReportPage("a", "b", {{"c", "d", html}});
    return Load(Path("page.html"));
  };
  EXPECT_EQ(load("").console, "");
  EXPECT_THAT(load("<script>noSuchFunction()</script>").console, HasSubstr("noSuchFunction"));
  EXPECT_THAT(load("<img src=\"http://localhost:9/a.png\">").console,
              HasSubstr("Content Security Policy"));
}

TEST_F(ReportTest, IsOneRepeatableFile) {
  Simulate(kHandheld, "a");
  ASSERT_EQ(Run("calibrate a --out=result --quiet").exit_code, 0);
  const std::string first = ReadFile(Path("result/report.html"));
  ASSERT_EQ(Run("calibrate a --out=result --quiet").exit_code, 0);
  EXPECT_EQ(ReadFile(Path("result/report.html")), first);
  EXPECT_THAT(first, AllOf(HasSubstr("default-src 'none'"), Not(HasSubstr("<link")),
                           Not(HasSubstr("src=\"http"))));
  EXPECT_THAT(first, HasSubstr("camgyro calibrate a --out=result --quiet=true"));
  EXPECT_THAT(first, HasSubstr("A sound calibration"));
}

// What was mended is said where the result is read, in `diagnose` as well, which shows the same.
TEST_F(ReportTest, SaysWhatWasFoundInTheData) {
  Simulate(kHandheld, "a");
  ASSERT_EQ(Run("calibrate a --out=result --quiet").exit_code, 0);
  EXPECT_THAT(ReadFile(Path("result/report.html")), Not(HasSubstr("Found in the data")));
  const std::string gyro = ReadFile(Path("a/imu0/data.csv"));
  const size_t end = gyro.rfind('\n', gyro.size() - 2);
  std::ofstream(Path("a/imu0/data.csv")) << gyro << gyro.substr(end + 1);  // the last sample twice
  ASSERT_EQ(Run("calibrate a --out=result --quiet").exit_code, 0);
  EXPECT_THAT(ReadFile(Path("result/report.html")),
              AllOf(HasSubstr("<h3>Found in the data</h3>"), HasSubstr("repeat")));
}

TEST_F(ReportTest, SaysWhichMotionToAdd) {
  Simulate(kSlow, "a");
  const RunResult run = Run("calibrate a --out=result");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  ASSERT_THAT(run.out, HasSubstr("not determined"));
  const std::string html = ReadFile(Path("result/report.html"));
  EXPECT_THAT(html, AllOf(HasSubstr("Not everything was determined"), HasSubstr("Motion to add"),
                          HasSubstr("Mounting about y: tilt")));
}

TEST(Report, EscapesText) {
  EXPECT_EQ(EscapeHtml("<a href=\"b\">&"), "&lt;a href=&quot;b&quot;&gt;&amp;");
  LineChart chart;
  chart.id = "x";
  chart.title = "</figure>";
  chart.series = {{"</script>", {}, {}, false, false}};
  const std::string html = LineChartHtml(chart);
  EXPECT_EQ(Count(html, "</script>"), 1);
  EXPECT_EQ(Count(html, "</figure>"), 1);
}

TEST(Report, ChartHoldsItsNumbers) {
  LineChart chart;
  chart.id = "x";
  chart.x = {0.5, 1.0};
  chart.series = {{"a", {2.0, std::nan("")}, {0.25, 0.5}, false, false}};
  EXPECT_THAT(LineChartHtml(chart), AllOf(HasSubstr("\"x\":[0.5,1]"), HasSubstr("\"y\":[2,null]"),
                                          HasSubstr("\"band\":[0.25,0.5]")));
}

// Two fits on one scale: the same value has the same colour in both maps.
TEST(Report, MapsShareTheirScale) {
  std::vector<ImageMap> maps(2);
  maps[0].value = (Eigen::MatrixXd(1, 2) << 0.1, 10.0).finished();
  maps[1].value = (Eigen::MatrixXd(1, 2) << 0.1, std::nan("")).finished();
  const std::string html = ImageMapsHtml("m", "", maps, 20, 10, "px");
  // Dark and bright end of the scale; a cell without data is not drawn.
  EXPECT_EQ(Count(html, "fill=\"#00224e\"><title>0.1 px"), 2);
  EXPECT_EQ(Count(html, "fill=\"#fee838\"><title>10 px"), 1);
  EXPECT_EQ(Count(html, "<title>"), 3);
}

TEST(Report, TypicalResidualIsASigmaThatOutliersHardlyMove) {
  std::vector<double> residuals;
  for (int i = -100; i <= 100; ++i) residuals.push_back(0.01 * i);  // median magnitude 0.5
  EXPECT_NEAR(TypicalResidual(residuals, 1), 1.4826 * 0.5, 0.02);
  for (int i = 0; i < 10; ++i) residuals.push_back(1e3);
  EXPECT_NEAR(TypicalResidual(residuals, 1), 1.4826 * 0.5, 0.06);
  EXPECT_TRUE(std::isnan(TypicalResidual({1.0}, 2)));
}

TEST(Report, MatchesLieOnTheirPictures) {
  const Result<Recording> recording = ReadRecording(SourceDir() + "/tools/sample");
  ASSERT_TRUE(recording) << recording.error().message;
  std::vector<MatchResidual> residuals(3);
  for (MatchResidual& r : residuals) {
    r.frame_a = 2;
    r.frame_b = 3;
    r.match.px_b = Eigen::Vector2d(100.0, 50.0);
    r.inlier = &r != &residuals[1];
  }
  residuals[2].frame_b = 9;
  const Result<ReportSection> section = MatchesSection(*recording, {}, residuals);
  ASSERT_TRUE(section) << section.error().message;
  EXPECT_EQ(Count(section->html, "href=\"data:image/jpeg;base64,/9j/"), 2);  // a JPEG's first bytes
  EXPECT_EQ(Count(section->html, "class=\"inlier\""), 2);
  EXPECT_EQ(Count(section->html, "class=\"outlier\""), 1);
  EXPECT_THAT(section->html, HasSubstr("Frame 3, at 0.10 s: 1 inliers, 1 outliers"));
}

TEST(Report, MatchesAreShownWhereTrackingKeptPictures) {
  Recording recording;
  recording.video_file = "absent.mp4";  // nothing is decoded
  std::vector<MatchResidual> residuals(100);
  for (size_t i = 0; i < residuals.size(); ++i) {
    recording.frames.emplace_back().stamp_ns = static_cast<int64_t>(i) * 100000000;
    residuals[i].frame_b = static_cast<int>(i);
  }
  SmallPictures pictures;
  for (const size_t frame : {3, 40, 90}) {
    pictures[recording.frames[frame].stamp_ns] = cv::Mat::zeros(4, 4, CV_8UC1);
  }
  const Result<ReportSection> section = MatchesSection(recording, pictures, residuals);
  ASSERT_TRUE(section) << section.error().message;
  EXPECT_EQ(Count(section->html, "href=\"data:image/jpeg;base64,/9j/"), 3);
  for (const char* frame : {"Frame 3,", "Frame 40,", "Frame 90,"}) {
    EXPECT_THAT(section->html, HasSubstr(frame));
  }
}

}  // namespace
}  // namespace camgyro
