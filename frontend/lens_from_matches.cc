#include "frontend/lens_from_matches.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "core/division_lens.h"
#include "core/format.h"
#include "core/known_camera.h"
#include "core/lens.h"
#include "core/parallel.h"
#include "core/usual_focal.h"
#include "frontend/camera_rotations.h"
#include "frontend/epipolar_misfit.h"
#include "frontend/readers/recording_checks.h"

namespace camgyro {
namespace {

constexpr size_t kLongPairs = 40, kLeastPairs = 20;
// Long enough that a lens bends the displacements visibly, and short enough that tracks live so
// long (docs/lab/lens_from_matches.md).
constexpr double kLongPairS = 0.3;
constexpr double kStep = 0.05;
constexpr int kMostSteps = 15;
constexpr size_t kBlocks = 10;
// Matches that are farther off their lines are wrong, and not only seen through another lens: with
// 4, those near the lines of a wrong lens are chosen, and it stays (docs/lab/lens_from_matches.md).
constexpr double kRightSigmas = 8.0;
constexpr double kStrong = 0.03, kStrongSigmas = 5.0;

std::vector<FramePair> LongPairs(const Recording& recording) {
  std::vector<FramePair> pairs;
  if (recording.tracks.empty()) return PairsForRotations(recording, kLongPairs);
  const double interval_s = MedianInterval(recording.frames);
  const size_t frames = recording.tracks.size();
  if (!(interval_s > 0.0)) return pairs;
  const size_t gap = std::max<size_t>(1, static_cast<size_t>(std::lround(kLongPairS / interval_s)));
  for (const size_t a : SpreadIndices(frames > gap ? frames - gap : 0, kLongPairs)) {
    pairs.push_back({static_cast<int>(a), static_cast<int>(a + gap),
                     MatchesBetween(recording.tracks[a], recording.tracks[a + gap])});
  }
  return pairs;
}

// A match as a pinhole shows it, or as nearly one as is declared.
struct SeenMatch {
  Match match;
  double stretch = 1.0;  // how much longer a short line at px_b is there than in the picture
};

std::vector<SeenMatch> ThroughDeclaredLens(const Calibration& camera,
                                           const std::vector<Match>& matches) {
  const Lens& lens = GetLens(camera.distortion_model);
  std::vector<SeenMatch> seen;
  for (const Match& match : matches) {
    RayJet ray;
    const std::vector<Match> there = ThroughPinhole(camera, {match});
    if (there.empty() || !lens.Unproject(match.px_b, camera.lens, &ray, LensDerivatives::kNone)) {
      continue;
    }
    const double area = ray.J_ray_px.topRows<2>().determinant();
    seen.push_back(
        {there.front(), std::sqrt(std::abs(area * camera.lens[kAspect])) * camera.lens[kFocal]});
  }
  return seen;
}

// What the right matches of pairs are off their epipolar lines through lenses. Which ones are right
// is told through one of them, so that they are the same for all.
class MisfitOfPairs {
 public:
  MisfitOfPairs(const CameraGuess& camera, const std::vector<FramePair>& pairs, int right_at_steps)
      : size_px_(camera.width_px, camera.height_px),
        centre_px_(camera.Centre()),
        pairs_(pairs.size()) {
    const Calibration declared = DeclaredCamera(camera, FocalToBeginWith(camera));
    const DivisionLens lens(kStep * right_at_steps, centre_px_, size_px_);
    ParallelFor(pairs.size(), [&](size_t k) {
      const std::vector<SeenMatch> seen = ThroughDeclaredLens(declared, pairs[k].matches);
      for (const size_t i : EpipolarInliers(Undistorted(lens, seen), kRightSigmas)) {
        pairs_[k].push_back(seen[i]);
      }
    });
  }

  size_t pairs_that_tell() {
    const std::vector<double>& logs = Through(0);
    return static_cast<size_t>(
        std::count_if(logs.begin(), logs.end(), [](double log) { return std::isfinite(log); }));
  }
  // Mean variance [px^2] (geometric) without a block of the pairs; none is without kBlocks.
  double Without(size_t block, int steps) {
    const std::vector<double>& logs = Through(steps);
    double sum = 0.0;
    int count = 0;
    for (size_t k = 0; k < logs.size(); ++k) {
      if (!std::isfinite(logs[k]) || k * kBlocks / logs.size() == block) continue;
      sum += logs[k];
      ++count;
    }
    return count > 0 ? std::exp(sum / count) : std::numeric_limits<double>::infinity();
  }
  // The best number of steps, coming from another.
  int Descend(int from, size_t block = kBlocks) {
    for (const int way : {-1, 1}) {
      while (std::abs(from + way) <= kMostSteps &&
             Without(block, from + way) < Without(block, from)) {
        from += way;
      }
    }
    return from;
  }
  // The same, between the steps: of the parabola through two steps to either side.
  double Minimum(int from, size_t block = kBlocks) {
    const int near = Descend(from, block);
    Eigen::Matrix<double, 5, 3> A;
    Eigen::Matrix<double, 5, 1> b;
    for (int i = -2; i <= 2; ++i) {
      A.row(i + 2) << 1.0, i, i * i;
      b[i + 2] = Without(block, near + i);
    }
    const Eigen::Vector3d p = A.householderQr().solve(b);
    return kStep * (near + (p[2] > 0.0 ? std::clamp(-p[1] / (2.0 * p[2]), -2.0, 2.0) : 0.0));
  }

 private:
  // Where a pinhole would show them; those without a ray go far away, each elsewhere.
  static std::vector<Match> Undistorted(const DivisionLens& lens,
                                        const std::vector<SeenMatch>& seen) {
    std::vector<Match> matches;
    for (const SeenMatch& one : seen) {
      Match match = one.match;
      match.px_a = lens.HasRay(match.px_a) ? lens.Undistorted(match.px_a) : 1e6 * match.px_b;
      match.px_b = lens.HasRay(match.px_b) ? lens.Undistorted(match.px_b) : -1e6 * match.px_a;
      matches.push_back(match);
    }
    return matches;
  }

  // Logarithm of each pair's variance [px^2]; not finite for those that tell nothing.
  const std::vector<double>& Through(int steps) {
    std::vector<double>& logs = logs_[steps];
    if (!logs.empty()) return logs;
    logs.resize(pairs_.size());
    const DivisionLens lens(kStep * steps, centre_px_, size_px_);
    ParallelFor(pairs_.size(), [&](size_t k) {
      const std::vector<Eigen::Vector2d> corrections_px =
          LinearEpipolarCorrections(Undistorted(lens, pairs_[k]));
      double sum = 0.0;
      for (size_t i = 0; i < corrections_px.size(); ++i) {
        const SeenMatch& seen = pairs_[k][i];
        sum += (corrections_px[i] / (lens.Stretch(seen.match.px_b) * seen.stretch)).squaredNorm();
      }
      logs[k] = std::log(sum / static_cast<double>(corrections_px.size()));
    });
    return logs;
  }

  const Eigen::Vector2d size_px_, centre_px_;
  std::vector<std::vector<SeenMatch>> pairs_;
  std::map<int, std::vector<double>> logs_;
};

}  // namespace

std::optional<LensFromMatches> FindLensFromMatches(const Recording& recording) {
  const std::vector<FramePair> pairs = LongPairs(recording);
  constexpr int kRounds = 5;
  std::optional<MisfitOfPairs> through;
  int near = 0;
  for (int round = 0, before = -1; round < kRounds && near != before; ++round) {
    through.emplace(recording.camera, pairs, near);
    if (through->pairs_that_tell() < kLeastPairs) return std::nullopt;
    before = std::exchange(near, through->Descend(near));
  }
  if (std::abs(near) == kMostSteps) return std::nullopt;
  MisfitOfPairs& misfit = *through;
  const double lambda = misfit.Minimum(near);
  double sum = 0.0, squares = 0.0;
  for (size_t block = 0; block < kBlocks; ++block) {
    const double without = misfit.Minimum(near, block);
    sum += without;
    squares += without * without;
  }
  const double n = kBlocks, variance = (squares - sum * sum / n) * (n - 1.0) / n;
  // No parabola has a minimum: nothing is known of how well it is told.
  if (!(variance > 0.0)) return std::nullopt;
  return LensFromMatches{lambda, std::sqrt(variance)};
}

void TakeLensFromMatches(Recording* recording) {
  CameraGuess& camera = recording->camera;
  camera.division_lambda = 0.0;
  const bool is_declared = camera.distortion_model != DistortionModel::kNone;
  if (is_declared && !camera.focal_px) return;  // its coefficients mean nothing in pixels
  const std::optional<LensFromMatches> lens = FindLensFromMatches(*recording);
  if (!lens || std::abs(lens->lambda) < std::max(kStrong, kStrongSigmas * lens->sigma)) return;
  if (!is_declared) {
    camera.division_lambda = lens->lambda;
    return;
  }
  AddFault(
      "declared_distortion", 1,
      Format("the declared distortion is not that of this camera: through it, the matches show "
             "a lens that moves corners of the picture by about %+.0f ± %.1f %%; it is left "
             "out",
             100.0 * lens->lambda, 100.0 * lens->sigma),
      recording);
  camera.distortion_model = DistortionModel::kNone;
  camera.distortion.clear();
  TakeLensFromMatches(recording);
}

}  // namespace camgyro
