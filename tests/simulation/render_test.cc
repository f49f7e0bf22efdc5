#include "simulation/render.h"

#include <gmock/gmock.h>

#include <map>
#include <opencv2/core.hpp>
#include <opencv2/video/tracking.hpp>
#include <set>

#include "simulation/simulate.h"

namespace camgyro::simulation {
namespace {

using Eigen::Vector2d;

Scenario SmallRoom() {
  Scenario scenario;
  scenario.duration_s = 0.35;
  scenario.scene.kind = SceneKind::kRoom;
  scenario.motion.path_radius_m = 1.2;
  scenario.camera.width_px = 320;
  scenario.camera.height_px = 240;
  scenario.camera.focal_px = 260.0;
  scenario.camera.readout_s = 0.025;
  scenario.tracks.noise_px = 0.0;
  scenario.tracks.count = 150;
  scenario.video.format = VideoFormat::kPng;
  scenario.video.full_well_electrons = 0.0;
  scenario.video.vignetting = 0.0;
  return scenario;
}

// Optical flow of OpenCV over the rendered pictures against the exact projections of the track
// level: same scene, two ways that share the pose and the lens only. Returns the mean and the
// median size of the difference [px].
struct FlowError {
  Vector2d mean = Vector2d::Zero();
  double median = 0.0;
  size_t count = 0;
};
FlowError CompareWithFlow(const Scenario& scenario) {
  const Simulated s = SimulateTracks(scenario).value();
  Renderer renderer(s, scenario);
  cv::Mat before = renderer.Render(0);
  std::vector<double> sizes;
  FlowError error;
  for (size_t i = 1; i < s.frames.size(); ++i) {
    const cv::Mat picture = renderer.Render(i);
    std::map<int64_t, Vector2d> now;
    for (const TrackedPoint& point : s.recording.tracks[i]) now[point.track_id] = point.px;
    std::vector<cv::Point2f> from, to, expected;
    for (const TrackedPoint& point : s.recording.tracks[i - 1]) {
      const auto found = now.find(point.track_id);
      if (found == now.end()) continue;
      from.emplace_back(static_cast<float>(point.px.x()), static_cast<float>(point.px.y()));
      expected.emplace_back(static_cast<float>(found->second.x()),
                            static_cast<float>(found->second.y()));
    }
    to = expected;
    std::vector<uint8_t> status;
    cv::calcOpticalFlowPyrLK(
        before, picture, from, to, status, cv::noArray(), cv::Size(15, 15), 0,
        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-4),
        cv::OPTFLOW_USE_INITIAL_FLOW, 1e-3);
    for (size_t k = 0; k < to.size(); ++k) {
      if (!status[k]) continue;
      const Vector2d difference(to[k].x - expected[k].x, to[k].y - expected[k].y);
      sizes.push_back(difference.norm());
      if (difference.norm() > 1.0) continue;  // at an edge of depth
      error.mean += difference;
      ++error.count;
    }
    before = picture;
  }
  error.mean /= static_cast<double>(error.count);
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<ptrdiff_t>(sizes.size() / 2),
                   sizes.end());
  error.median = sizes[sizes.size() / 2];
  return error;
}

void ExpectAgreement(const Scenario& scenario) {
  const FlowError error = CompareWithFlow(scenario);
  EXPECT_GT(error.count, 300u);
  // A wrong row time by 1 ms would show as 0.2 px at the mean rate of 0.8 rad/s.
  EXPECT_LT(error.median, 0.1);
  EXPECT_LT(error.mean.norm(), 0.03);
}

TEST(Render, PicturesAgreeWithTheExactTracks) { ExpectAgreement(SmallRoom()); }

TEST(Render, AgreesWithDistortionStabilisersAndColumns) {
  Scenario scenario = SmallRoom();
  scenario.effects.radial_distortion.k1 = -0.15;
  scenario.effects.optical_stabilisation.gain = 0.5;
  scenario.effects.readout_direction.columns = true;
  ExpectAgreement(scenario);
  scenario = SmallRoom();
  scenario.effects.electronic_stabilisation.strength = 0.8;
  ExpectAgreement(scenario);
  scenario = SmallRoom();
  scenario.effects.radial_distortion.kannala_brandt = true;
  scenario.effects.radial_distortion.k1 = 0.02;
  ExpectAgreement(scenario);
}

TEST(Render, AgreesOnAFacadeWithThingsInFront) {
  Scenario scenario = SmallRoom();
  scenario.scene.kind = SceneKind::kFacade;
  scenario.scene.moving_objects = 3;
  scenario.motion.path_radius_m = 0.0;
  scenario.motion.heading_deg = 90.0;
  ExpectAgreement(scenario);
}

// A corridor shows no stretch twice: panels have textures of their own.
TEST(Render, AgreesInACorridorWhereNoPanelRepeats) {
  Scenario scenario = SmallRoom();
  scenario.scene.kind = SceneKind::kCorridor;
  scenario.scene.room_m = {9.0, 3.0, 9.0};
  scenario.motion.path_radius_m = 3.0;
  ExpectAgreement(scenario);
  const Simulated s = SimulateSensors(scenario).value();
  std::set<int> textures;
  size_t boxes = 0;
  for (const Surface& surface : s.scene.surfaces()) {
    if (surface.shape != Shape::kBox) continue;
    ++boxes;
    textures.insert(surface.texture);
  }
  EXPECT_EQ(textures.size(), boxes);
  EXPECT_EQ(boxes, 2u * 8u + 4u);  // two panels with furniture to a side of 9 m, one to one of 3 m
}

TEST(Render, NoiseIsThatOfPhotons) {
  Scenario scenario = SmallRoom();
  scenario.duration_s = 0.04;
  scenario.motion = MotionPreset(MotionKind::kRotation);
  scenario.motion.rotation_rms_rad_s.setZero();  // two pictures of the same
  scenario.video.full_well_electrons = 2000.0;
  scenario.video.read_noise_electrons = 0.0;
  const Simulated s = SimulateSensors(scenario).value();
  Renderer renderer(s, scenario);
  cv::Mat a, b;
  renderer.Render(0).convertTo(a, CV_64F);
  renderer.Render(1).convertTo(b, CV_64F);
  const cv::Mat difference = a - b;
  cv::Scalar mean, sigma;
  cv::meanStdDev(difference, mean, sigma);
  // Variance of the difference: twice 255^2 light / full well, and twice 1/12 of rounding.
  const double light = cv::mean(a)[0] / 255.0;
  EXPECT_NEAR(sigma[0], std::sqrt(2.0 * (255.0 * 255.0 * light / 2000.0 + 1.0 / 12.0)), 0.15);
  EXPECT_NEAR(mean[0], 0.0, 0.1);
}

TEST(Render, BlurHasNoSkew) {
  for (int least = 4; least <= 64; ++least) {
    const std::vector<Sample> samples = SamplesOfPixel(least);
    ASSERT_GE(static_cast<int>(samples.size()), least);
    ASSERT_LE(static_cast<int>(samples.size()), least + 2);
    std::set<double> times, u, v;
    for (size_t k = 0; k < samples.size(); ++k) {
      const Sample& mirror = samples[samples.size() - 1 - k];
      EXPECT_NEAR(samples[k].time, -mirror.time, 1e-12);
      EXPECT_LT((samples[k].offset_px + mirror.offset_px).norm(), 1e-12) << least;
      times.insert(samples[k].time);
      u.insert(samples[k].offset_px.x());
      v.insert(samples[k].offset_px.y());
    }
    EXPECT_EQ(times.size(), samples.size());
    EXPECT_EQ(u.size(), samples.size()) << least;
    EXPECT_EQ(v.size(), samples.size()) << least;
  }
}

TEST(Render, ExposureBlursAlongTheMotion) {
  Scenario scenario = SmallRoom();
  scenario.duration_s = 0.04;
  scenario.motion = MotionPreset(MotionKind::kRotation);
  scenario.motion.rotation_rms_rad_s.setZero();
  scenario.motion.pan_rms_rad_s = 2.0;
  const auto gradients = [&](double exposure_s) {
    scenario.camera.exposure_s = exposure_s;
    scenario.video.max_blur_samples = 16;
    const Simulated s = SimulateSensors(scenario).value();
    Renderer renderer(s, scenario);
    cv::Mat picture;
    renderer.Render(0).convertTo(picture, CV_64F);
    const cv::Mat across = picture.colRange(1, 320) - picture.colRange(0, 319);
    const cv::Mat down = picture.rowRange(1, 240) - picture.rowRange(0, 239);
    return std::make_pair(cv::norm(across), cv::norm(down));
  };
  const auto [sharp_across, sharp_down] = gradients(0.0);
  const auto [blurred_across, blurred_down] = gradients(0.02);
  EXPECT_LT(blurred_across, 0.6 * sharp_across);
  EXPECT_GT(blurred_down / sharp_down, 1.2 * blurred_across / sharp_across);
}

}  // namespace
}  // namespace camgyro::simulation
