#include "frontend/track_recording.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iterator>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "core/format.h"
#include "core/parallel.h"
#include "core/robust_statistics.h"
#include "frontend/frame_source.h"
#include "frontend/gyro_rotation.h"
#include "frontend/readers/recording_checks.h"
#include "frontend/track_cleaner.h"

namespace camgyro {
namespace {

constexpr double kMinMatches = 8.0;  // per pair, median; 2 go into the translation direction
// Below it, vibration and the tracker's own errors are what one would calibrate on.
// (euroc-v101-rest: 0.15 px, rotors running; gopro-hero5-karma, hardly turning: 0.43 px.)
constexpr double kMinMotionPx = 0.3;
// Grey levels between the darkest and the brightest parts of a picture, of the means of blocks.
// Read noise of 16 levels, as in the dark with all the gain there is, leaves means of 16 x 16
// pixels with 1 level, and 4 between the 2 % that are darkest and brightest.
constexpr int kBlockPx = 16;
constexpr double kLeastContrast = 5.0;
constexpr double kDarkest = 0.02;

// Decoded, but not yet tracked: the decoder has a few milliseconds more or less per picture.
constexpr size_t kMostDecoded = 4;

// Of the pictures that the summary keeps. Of a few frames in a row, one is the end of a pair.
constexpr int kSmallWidthPx = 512;
constexpr size_t kKeptPlaces = 4, kKeptInARow = 8;

bool IsKept(size_t frame, size_t frames) {
  for (size_t k = 0; k < kKeptPlaces; ++k) {
    const size_t first = (2 * k + 1) * frames / (2 * kKeptPlaces);
    if (frame >= first && frame < first + kKeptInARow) return true;
  }
  return false;
}

// A frame of the recording as its file has it.
struct DecodedFrame {
  Result<bool> more = false;     // false: there is none
  KltTracker::Picture prepared;  // empty: not to be tracked
  std::string complaint;         // about its size
  bool shows_nothing = false;
};

DecodedFrame DecodeNext(const KltTracker& tracker, FrameSource* source) {
  DecodedFrame frame;
  cv::Mat gray;
  frame.more = source->NextOfAnySize(&gray, &frame.complaint);
  if (frame.more && *frame.more && !gray.empty() && ShowsNothing(gray)) {
    frame.shows_nothing = true;
    gray.release();
  }
  frame.prepared = tracker.Prepare(std::move(gray));
  return frame;
}

std::optional<GyroRotation> RotationBetween(const Recording& recording,
                                            const Calibration* calibration, size_t frame_a) {
  if (calibration == nullptr) return std::nullopt;
  return GyroRotation::Between(recording.gyro, *calibration, recording.frames[frame_a].stamp_ns,
                               recording.frames[frame_a + 1].stamp_ns);
}

// Frames that cannot be tracked, by the reason.
struct UnusableFrames {
  std::vector<int> of_another_size, showing_nothing;  // ascending
  std::string first_size;                             // which, of what size, and what was expected

  Status LeaveOut(Recording* recording) const {
    const size_t all = recording->frames.size();
    if (2 * of_another_size.size() > all) {
      return BadInput(Format("%s; so it is in %zu of %zu frames", first_size.c_str(),
                             of_another_size.size(), all));
    }
    std::vector<int> left_out;
    std::merge(of_another_size.begin(), of_another_size.end(), showing_nothing.begin(),
               showing_nothing.end(), std::back_inserter(left_out));
    LeaveOutFrames(left_out, /*repeats=*/false, recording);
    const auto add = [&](const char* name, size_t count, const std::string& finding) {
      if (count == 0) return;
      recording->faults.push_back({name, static_cast<int>(count), finding});
      recording->notes.push_back(finding);
    };
    add("frames_of_another_size", of_another_size.size(),
        Format("%s; %zu such frames are left out", first_size.c_str(), of_another_size.size()));
    add("frames_without_contrast", showing_nothing.size(),
        Format("%zu of %zu pictures show nothing (a lens cap? darkness?), the first is frame %d; "
               "they are left out",
               showing_nothing.size(), all,
               showing_nothing.empty() ? 0 : showing_nothing.front() + 1));
    return {};
  }
};

// What all pictures give.
struct Followed {
  std::vector<std::vector<TrackedPoint>> tracks;  // the points of every frame
  UnusableFrames unusable;
  SmallPictures kept;
};

// Errors of the files.
Status FollowCorners(const TrackerOptions& options, const Calibration* calibration,
                     const TrackingProgress& progress, const Recording& recording,
                     FrameSource* source, Followed* followed) {
  KltTracker tracker(options);
  UnusableFrames& unusable = followed->unusable;
  MadeAhead<DecodedFrame> decoded(kMostDecoded,
                                  [&tracker, source] { return DecodeNext(tracker, source); });
  for (size_t i = 0; i < recording.frames.size(); ++i) {
    DecodedFrame frame = decoded.Take();
    if (!frame.more) return tl::unexpected(frame.more.error());
    if (!*frame.more) break;
    if (frame.shows_nothing) {
      unusable.showing_nothing.push_back(static_cast<int>(i));
    } else if (frame.prepared.gray.empty()) {
      if (unusable.of_another_size.empty()) unusable.first_size = frame.complaint;
      unusable.of_another_size.push_back(static_cast<int>(i));
    } else if (IsKept(i, recording.frames.size())) {
      followed->kept[recording.frames[i].stamp_ns] = SmallPicture(frame.prepared.gray);
    }
    PointPredictor predictor;
    std::optional<GyroRotation> rotation;
    if (i > 0) rotation = RotationBetween(recording, calibration, i - 1);
    if (rotation) predictor = [&](const Eigen::Vector2d& px) { return rotation->Predict(px); };
    followed->tracks.push_back(tracker.Add(std::move(frame.prepared), predictor));
    if (progress)
      progress(static_cast<double>(i + 1) / static_cast<double>(recording.frames.size()));
  }
  return {};
}

// Returns the share of wrong matches.
double CutTracksAtOutliers(const Calibration* calibration, Recording* recording) {
  TrackCleaner cleaner(recording->camera.width_px, recording->camera.height_px,
                       FreeTrackId(recording->tracks));
  for (size_t i = 0; i < recording->tracks.size(); ++i) {
    std::optional<GyroRotation> rotation;
    if (i > 0) rotation = RotationBetween(*recording, calibration, i - 1);
    recording->tracks[i] = cleaner.Add(recording->tracks[i], rotation);
  }
  return cleaner.wrong_ratio();
}

}  // namespace

cv::Mat SmallPicture(const cv::Mat& gray) {
  const double scale = std::min(1.0, static_cast<double>(kSmallWidthPx) / gray.cols);
  cv::Mat small;
  cv::resize(gray, small, cv::Size(), scale, scale, cv::INTER_AREA);
  return small;
}

bool ShowsNothing(const cv::Mat& gray) {
  cv::Mat blocks;
  cv::resize(gray, blocks,
             cv::Size(std::max(1, gray.cols / kBlockPx), std::max(1, gray.rows / kBlockPx)), 0.0,
             0.0, cv::INTER_AREA);
  std::vector<uint8_t> means(blocks.begin<uint8_t>(), blocks.end<uint8_t>());
  std::sort(means.begin(), means.end());
  const auto at = static_cast<size_t>(kDarkest * static_cast<double>(means.size() - 1));
  return means[means.size() - 1 - at] - means[at] < kLeastContrast;
}

ImageMotion MeasureImageMotion(const Recording& recording) {
  ImageMotion motion;
  std::vector<double> matches, lengths;
  const auto add = [&](const std::vector<Match>& of_pair) {
    matches.push_back(static_cast<double>(of_pair.size()));
    for (const Match& match : of_pair) lengths.push_back((match.px_b - match.px_a).norm());
  };
  if (recording.matches.empty()) {
    const auto& tracks = recording.tracks;
    size_t count = 0;
    for (size_t b = 1; b < tracks.size(); ++b) count += CountMatches(tracks[b - 1], tracks[b]);
    lengths.reserve(count);  // a hundred megabytes in an hour: a vector that grows takes twice that
    for (size_t b = 1; b < tracks.size(); ++b) add(MatchesBetween(tracks[b - 1], tracks[b]));
  } else {
    for (const FramePair& pair : recording.matches) add(pair.matches);
  }
  motion.pairs = matches.size();
  motion.total_matches = lengths.size();
  if (!matches.empty()) motion.matches = MedianInPlace(&matches);
  if (!lengths.empty()) motion.motion_px = MedianInPlace(&lengths);
  return motion;
}

Status CheckImageMotion(const Recording& recording) {
  const ImageMotion motion = MeasureImageMotion(recording);
  if (motion.matches >= kMinMatches && motion.motion_px >= kMinMotionPx) return {};
  if (motion.matches >= kMinMatches) {
    return CannotEstimate(
        Format("no motion in the recording: features move by %.2f px between frames (median); turn "
               "the camera about all its axes",
               motion.motion_px));
  }
  return CannotEstimate(
      "too few features: a median of " + std::to_string(static_cast<int>(motion.matches)) +
      " matches per pair of frames, at least " + std::to_string(static_cast<int>(kMinMatches)) +
      " are needed (no texture, blur, or frames too far apart?)");
}

void LeaveOutUntrackedFrames(Recording* recording) {
  constexpr size_t kLeast = 3;  // one in so many
  const size_t all = recording->tracks.size();
  std::vector<int> without;
  for (size_t i = 0; i < all; ++i) {
    if (recording->tracks[i].empty()) without.push_back(static_cast<int>(i));
  }
  if (kLeast * without.size() < all || without.size() == all) return;
  LeaveOutFrames(without, /*repeats=*/false, recording);
  AddFault("frames_without_points", static_cast<int>(without.size()),
           Format("%zu of %zu frames have no points in the given tracks; they are left out",
                  without.size(), all),
           recording);
}

Result<TrackingSummary> TrackRecording(const TrackerOptions& options,
                                       const Calibration* calibration,
                                       const TrackingProgress& progress, Recording* recording) {
  const auto begin = std::chrono::steady_clock::now();
  Result<std::unique_ptr<FrameSource>> source = OpenFrames(*recording);
  if (!source) return tl::unexpected(source.error());
  Followed followed;
  if (Status done =
          FollowCorners(options, calibration, progress, *recording, source->get(), &followed);
      !done) {
    return tl::unexpected(done.error());
  }
  recording->tracks = std::move(followed.tracks);
  recording->matches.clear();
  recording->match_noise = MatchNoise::kSecondImage;
  if (Status left = followed.unusable.LeaveOut(recording); !left) {
    return tl::unexpected(left.error());
  }

  TrackingSummary summary;
  summary.pictures = std::move(followed.kept);
  summary.outlier_ratio = CutTracksAtOutliers(calibration, recording);
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (Status enough = CheckImageMotion(*recording); !enough) return tl::unexpected(enough.error());
  return summary;
}

}  // namespace camgyro
