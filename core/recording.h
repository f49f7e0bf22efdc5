// A recording: what a reader found in the files, before any estimation.
#ifndef CAMGYRO_CORE_RECORDING_H_
#define CAMGYRO_CORE_RECORDING_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/lens.h"
#include "core/lens_shift.h"
#include "core/result.h"

namespace camgyro {

// Angular rate in the gyro frame [rad/s], bias included; stamp on the gyro clock.
struct GyroSample {
  int64_t stamp_ns = 0;
  Eigen::Vector3d omega_gyro_rad_s = Eigen::Vector3d::Zero();
};

// Specific force in the gyro (IMU) frame [m/s^2]; stamp on the gyro clock.
struct AccelSample {
  int64_t stamp_ns = 0;
  Eigen::Vector3d accel_gyro_m_s2 = Eigen::Vector3d::Zero();
};

struct Frame {
  int64_t stamp_ns = 0;                                          // camera clock
  double exposure_s = std::numeric_limits<double>::quiet_NaN();  // NaN: not recorded
  std::string image_file;                                        // path; empty without images
  // Number of its picture in Recording::video_file, from 0; negative: the frame's own index.
  int picture = -1;
};

// There are some hundred million of these in a few hours of recording, so that they are packed: 32
// bytes. The order of the members leaves no gaps, and the noise factor, which is an estimate of a
// tenth or so, is rounded to 11 bits.
struct TrackedPoint {
  using NoiseFactor = Eigen::Matrix<Eigen::half, 3, 1>;

  TrackedPoint() = default;
  TrackedPoint(int64_t id, const Eigen::Vector2d& pixel,
               const Eigen::Vector3d& factor = Eigen::Vector3d(1.0, 0.0, 1.0))
      : px(pixel), track_id(id), noise_factor(factor.cast<Eigen::half>()) {}

  Eigen::Vector2d px = Eigen::Vector2d::Zero();  // pixel (0,0) is the centre of the top-left pixel
  int64_t track_id = 0;
  // Lower triangular factor L (xx, yx, yy) of its noise: covariance sigma^2 L L^T, with the sigma
  // of the recording's noise. Corners are found less well along an edge, or along motion blur.
  NoiseFactor noise_factor{Eigen::half(1.0F), Eigen::half(0.0F), Eigen::half(1.0F)};
};
static_assert(sizeof(TrackedPoint) == 32, "the memory of long recordings is counted in these");

struct Match {
  static constexpr int64_t kNoTrack = -1;

  Eigen::Vector2d px_a = Eigen::Vector2d::Zero();
  Eigen::Vector2d px_b = Eigen::Vector2d::Zero();
  Eigen::Vector3d noise_factor_b{1.0, 0.0, 1.0};  // as TrackedPoint's; px_a's is the identity
  int64_t track_id = kNoTrack;                    // of matches that are made of tracks
};

// Matched features of two frames (indices into Recording::frames, frame_a < frame_b).
struct FramePair {
  int frame_a = 0;
  int frame_b = 0;
  std::vector<Match> matches;
};

// Rotation of the camera between two frames, found from their pictures or attitudes alone.
struct CameraRotation {
  int frame_a = 0, frame_b = 0;                               // indices into Recording::frames
  Eigen::Quaterniond q_a_b = Eigen::Quaterniond::Identity();  // vectors of camera b into camera a
  double sigma_rad = 0.0;    // per axis, as far as the maker knows it
  double residual_px = 0.0;  // of the matches, after the fit: standard deviation; 0: not known
};

// How camera and gyro lie to each other, roughly: what a start knows, and enough to say how the
// camera turned between two rows.
struct RoughAlignment {
  Eigen::Quaterniond q_gyro_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d bias_gyro_rad_s = Eigen::Vector3d::Zero();
  double delay_middle_row_s = 0.0;  // at the first gyro stamp
  double clock_skew = 0.0;          // the delay grows by so much per second
  double readout_s = 0.0;
};

// What rotations between pictures are asked for with: a focal length [px], and, where it is known,
// how the gyro lies to the camera, which undoes the rolling shutter (two_view_rotation.h).
struct RotationTrial {
  double focal_px = 0.0;
  std::optional<RoughAlignment> rough;
};

// Where the pixel noise of a match sits (docs/architecture.md, traps).
enum class MatchNoise {
  kBothImages,   // each observation has its own independent error
  kSecondImage,  // tracker re-anchored at every frame: the first image is the definition
};

// What the files declare about the camera, as an initial guess. Absent: to be found.
struct CameraGuess {
  int width_px = 0;
  int height_px = 0;
  std::optional<double> focal_px;  // of the rows, fv
  double aspect_ratio = 1.0;       // fu / fv
  std::optional<Eigen::Vector2d> principal_px;
  DistortionModel distortion_model = DistortionModel::kNone;
  std::vector<double> distortion;  // the model's four coefficients; empty: zero
  void SetDistortion(DistortionModel model, const LensParameters& lens) {
    const auto k = lens.segment<4>(FirstCoefficient(model));
    distortion_model = model;
    distortion.assign(k.data(), k.data() + 4);
  }
  // Of a strong lens that nothing declares, as its matches show it (DivisionLens, about the centre
  // below; frontend/lens_from_matches.h); 0: none, or nobody has looked.
  double division_lambda = 0.0;
  // The declared principal point, or the picture's centre [px].
  Eigen::Vector2d Centre() const {
    return principal_px.value_or(Eigen::Vector2d(0.5 * (width_px - 1), 0.5 * (height_px - 1)));
  }
  std::optional<Eigen::Quaterniond> q_gyro_cam;
  std::optional<double> readout_s;
  std::optional<double> delay_s;
};

// What the files declare about the gyro.
struct GyroInfo {
  std::optional<double> noise_density_rad_s_rtHz;  // white noise, continuous
  std::optional<double> random_walk_rad_s2_rtHz;   // of the bias
  std::optional<double> declared_rate_hz;          // as the file says, not as the stamps have it
};

// What the stamps of a stream are: readings of its sampling clock, or the times at which its
// samples arrived somewhere, later by a latency that varies.
enum class StampKind {
  kMeasured,   // a steady clock, also with gaps, steps or slow drift
  kArrival,    // a steady clock behind stamps that are late, bunched or rounded
  kIrregular,  // neither: intervals vary, and no steady clock explains them
};

struct StampReport {
  StampKind kind = StampKind::kMeasured;
  double period_s = 0.0;       // of the sampling clock, in the mean
  double jitter_s = 0.0;       // standard deviation of recorded stamps about that clock
  double latest_s = 0.0;       // the latest stamp's distance from the earliest ones'
  double residual_s = 0.0;     // how well stretches of the recording agree on the clock
  double level_sigma_s = 0.0;  // how well its offset from the stamps is known
  int missing = 0;             // samples that the clock has and the stream has not
  // The samples' stamps are that clock's now. Of frames: they are to have times of their own in the
  // fit (frame_stamp_jitter), their stamps stay.
  bool repaired = false;
};

// Something wrong with the data as recorded, found and (if `repaired`) mended before any fit.
struct RecordedFault {
  std::string name;
  int count = 0;
  std::string finding;  // for people, with what was done about it
};

struct Recording {
  std::string path;  // as the user gave it
  CameraGuess camera;
  GyroInfo gyro_info;

  std::vector<Frame> frames;       // stamps strictly increasing
  std::vector<GyroSample> gyro;    // stamps strictly increasing
  std::vector<AccelSample> accel;  // empty, or stamps strictly increasing
  // Of a stabilised lens that was logged; empty, or stamps strictly increasing.
  std::vector<LensSample> lens_shift;

  // Image motion, in the order of preference; what is empty is absent.
  std::vector<FramePair> matches;                 // pairwise matches without identity
  std::vector<std::vector<TrackedPoint>> tracks;  // one entry per frame, by ascending track id
  std::vector<Eigen::Quaterniond> q_cam_world;    // one per frame, world -> camera
  std::string video_file;  // of a video or bag; frames have its pictures in their order

  MatchNoise match_noise = MatchNoise::kBothImages;
  std::optional<StampReport> gyro_stamps, camera_stamps;  // absent: nobody has looked
  std::vector<RecordedFault> faults;
  // Set if a file says that the picture was stabilised electronically, with the file's own words.
  std::optional<std::string> declared_stabilisation;
  // What the reader saw and a user should know (unit converted, samples dropped, clock rebuilt).
  std::vector<std::string> notes;

  // No pixels: attitudes made elsewhere are all there is of the camera.
  bool HasOnlyAttitudes() const {
    return matches.empty() && tracks.empty() && !HasImages() && !q_cam_world.empty();
  }
  // Number of a frame's picture in video_file.
  size_t PictureOf(size_t frame) const {
    const int picture = frames[frame].picture;
    return picture < 0 ? frame : static_cast<size_t>(picture);
  }
  bool HasImages() const {
    return !video_file.empty() || (!frames.empty() && !frames.front().image_file.empty());
  }
};

// Matches of the tracks seen in both of two frames; both by ascending id.
std::vector<Match> MatchesBetween(const std::vector<TrackedPoint>& a,
                                  const std::vector<TrackedPoint>& b);

// How many there are.
size_t CountMatches(const std::vector<TrackedPoint>& a, const std::vector<TrackedPoint>& b);

// The same between frames i and i + gap, for all i. Of a long recording they take more memory than
// its tracks: use MatchesBetween for one pair at a time there.
std::vector<FramePair> PairsFromTracks(const std::vector<std::vector<TrackedPoint>>& tracks,
                                       int gap);

// Leaves out frames (ascending indices), with their tracks, their attitudes and the pairs that they
// are in. The others keep their pictures (Frame::picture). With `repeats`, each shows the picture
// of the frame before it: that one then takes its place in pairs.
void LeaveOutFrames(const std::vector<int>& left_out, bool repeats, Recording* recording);

// Median interval of strictly increasing stamps [s]; 0 with fewer than two.
double MedianInterval(const std::vector<GyroSample>& gyro);
double MedianInterval(const std::vector<Frame>& frames);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_RECORDING_H_
