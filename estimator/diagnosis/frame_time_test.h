// Have frames times of their own, around their stamps (frame_stamp_jitter)?
//
// Two halves of a pair's matches share the times of its two frames and have no noise of a pixel in
// common. So what one half says of the times tells nothing of what the other one says, unless the
// frames are off their stamps: no level of noise has to be known, which a test of the scatter of
// times would need to a percent.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_FRAME_TIME_TEST_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_FRAME_TIME_TEST_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/frame_times.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

enum class SplitOfMatches {
  // Left and right. Neighbours may be shifted alike (docs/lab/tracking.md#errors-of-neighbours),
  // which halves that lie among each other would take for something that all matches share.
  kSides,
  // Each half sees all of the picture, and tells rotations better from the direction of
  // translation.
  kEveryOther,
};

// What the two halves of one pair's matches, and all of them, say, each with a direction of its
// own. Columns: state and effects of the model, then the offsets of its first and of its second
// frame from their stamps [s].
struct HalvesOfPair {
  struct Half {
    Eigen::VectorXd g;  // half the derivative of chi2, what is the pair's own projected out
    Eigen::MatrixXd H;
  };
  std::array<Half, 2> halves;
  Half whole;
  // Covariance of the first half's score (rows) and the second's (columns) by the noise of the
  // gyro, which both share: of the bias, three, and of the offsets, two.
  Eigen::Matrix<double, 5, 5> common;
};

// Pairs of matches that the gyro covers and whose halves have enough of them; of others nothing.
// The calibration has no frame_stamp_jitter; the residual of the options has a direction. noise:
// of a pixel [px].
std::vector<HalvesOfPair> ScoreHalves(const EstimationInput& input,
                                      const std::vector<TimedPair>& pairs,
                                      const Calibration& calibration, double noise,
                                      const PairGraphOptions& options, SplitOfMatches split);

// HalvesAgreement of halves in some columns: the sum over pairs of x = s1 . A s2 - E[s1 . A s2],
// with s1 and s2 the halves' scores, the model projected out of all pairs of each half on its own,
// A the inverse of their mean information and a weak prior's, and E by the gyro's noise alone.
struct HalvesAgreement {
  double sum = 0.0;  // chi2 that the halves have in common
  // sum / sqrt(sum of x^2)
  double sigmas = 0.0;
  // Of a sum as large if the halves had nothing in common. One half's score is then as likely the
  // opposite, whatever the other's: every choice of the pairs' signs is as likely. By
  // kSignChoices choices at random; beyond what these can tell, by the bound of Hoeffding,
  // exp(-sigmas^2 / 2), which holds for any x.
  double p_value = 1.0;
};

struct FrameTimeTest {
  int pairs = 0;
  HalvesAgreement times;
  // In pairs of far frames, which tell rotations from the direction of translation: of times, and
  // of rotations between the two frames about any axis, times projected out. These are what gyro
  // noise, a picture that shakes or a model that is wrong otherwise bring; a time turns about the
  // axis of the camera's own rotation only.
  HalvesAgreement far_times, rest;
  // Most likely standard deviation of the offsets, in pairs of near frames and of far ones. A gyro
  // whose error grows with its rate turns about the axis of the rotation, too, and a delay that
  // wanders shifts times: but both by as much less as the frames of a pair are nearer to each
  // other. A time of a frame's own is the same in any pair.
  Spread spread, far_spread;

  // Whether it is times of the frames' own that the halves have in common.
  bool is_of_times() const;
};

// Significance is by the near pairs alone, to be split into sides (kSides). is_of_times is by the
// far ones, too; with every other match in a half (kEveryOther) these see best what is not of
// times. prior_information: 1 / sigma^2 of the model's columns. The p-value is 1 if there are fewer
// than kLeastPairsOfHalves near pairs.
FrameTimeTest TestFrameTimes(const std::vector<HalvesOfPair>& near,
                             const std::vector<HalvesOfPair>& far,
                             const Eigen::VectorXd& prior_information);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_FRAME_TIME_TEST_H_
