// Tells wrong matches from right ones, within one pair of frames.
#ifndef CAMGYRO_FRONTEND_OUTLIERS_H_
#define CAMGYRO_FRONTEND_OUTLIERS_H_

#include <Eigen/Core>
#include <vector>

#include "core/recording.h"

namespace camgyro {

struct BinHomographyOptions {
  int bins = 2;               // per side: 2 makes 4 bins
  double threshold_px = 1.5;  // distance from the homography's prediction
  int min_bin_matches = 10;   // with fewer, a bin is judged by the homography of the whole picture
};

// The rejection of Jia & Evans (section VI, after Grundmann et al. 2012): a RANSAC homography for
// each of bins x bins parts of the first image. Needs neither lens nor gyro, and takes strong
// parallax for outliers: use FindTranslationConsensus once rotations are known.
//
// Removes the outliers from `pair` and returns how many. Matches that are too few to be judged
// (fewer than min_bin_matches in the whole picture) stay.
int RejectByBinHomography(FramePair& pair, int width_px, int height_px,
                          const BinHomographyOptions& options = {});

// A match whose rays are turned into one reference orientation, which the caller takes from the
// gyro (with a rolling shutter every feature has its own rotation). Lengths of rays do not matter.
struct RotatedMatch {
  Eigen::Vector3d a, b;                        // rays of the first and the second image
  Eigen::Matrix<double, 3, 2> J_a_px, J_b_px;  // derivatives by the pixel
};

// n = a x b and its covariance for a pixel noise of 1 px (per axis, in the images that `noise`
// says). With right rotations every n is normal to the translation tau, so
//   r(tau) = tau . n / (sigma_px sqrt(tau' cov_n tau))
// is the match's distance from its epipolar line in sigmas (docs/architecture.md, residuals). It
// stays meaningful without parallax, where a, b and every n are no more than noise.
struct CoplanarityNormal {
  Eigen::Vector3d n;
  Eigen::Matrix3d cov_n;

  // r(tau)^2 for sigma_px = 1. Within half a pixel or so of the epipole, where the epipolar line
  // has no direction, it fades to zero instead of dividing zero by zero.
  double SquaredDistance(const Eigen::Vector3d& tau) const {
    const double product = tau.dot(n);
    return product * product / Variance(tau);
  }
  double Variance(const Eigen::Vector3d& tau) const {
    return tau.dot(cov_n * tau) + kEpipole * cov_n.trace();
  }
  static constexpr double kEpipole = 1e-6;  // (1 mrad)^2
};
CoplanarityNormal MakeCoplanarityNormal(const RotatedMatch& match, MatchNoise noise);

struct TranslationConsensusOptions {
  // One sigma of a match [px], as `noise` distributes it; includes what the error of the assumed
  // rotation moves a feature.
  double sigma_px = 0.5;
  MatchNoise noise = MatchNoise::kSecondImage;
  double threshold_sigma = 3.0;
  int samples = 100;  // pairs of matches tried
};

struct TranslationConsensus {
  // Unit direction from the first to the second camera centre, in the reference orientation.
  // Arbitrary without parallax.
  Eigen::Vector3d tau = Eigen::Vector3d::UnitZ();
  std::vector<bool> inliers;  // one per match
  int num_inliers = 0;
};

// The rejection that parallax does not fool: two matches give a candidate, tau = n_i x n_j; the
// one with the least truncated squared distance wins (MSAC, repeatable), is refined over its
// inliers, and decides. A match must lie within threshold_sigma of its epipolar line, and not
// significantly on the wrong side of the epipole (behind the camera). Without parallax everything
// that the rotation explains is an inlier. A wrong match along its epipolar line, forwards, is not
// found: it looks like a point at another depth.
//
// With fewer than 3 matches nothing can disagree: all are inliers.
TranslationConsensus FindTranslationConsensus(const std::vector<RotatedMatch>& matches,
                                              const TranslationConsensusOptions& options = {});

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_OUTLIERS_H_
