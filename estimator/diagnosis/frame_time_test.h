// Do the frames' times scatter around their stamps (frame_stamp_jitter)?
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_FRAME_TIME_TEST_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_FRAME_TIME_TEST_H_

#include <vector>

#include "estimator/diagnosis/score_test.h"

namespace camgyro {

// The scores of the frames' times (PairScore::times) in the directions in which they are
// independent, z_j with unit variance and information w_j if nothing but the declared noise is in
// them: z_j ~ N(0, level + spread^2 w_j). A noise that is larger than declared, in whatever way,
// raises the level; times of their own show where the camera turns fast. So neither outliers nor
// correlated noise are taken for jitter, as long as they do not follow the speed of turning.
struct FrameTimeSpread {
  double level = 1.0;
  double spread_s = 0.0, sigma_s = 0.0;
};

struct FrameTimeTest {
  FrameTimeSpread most_likely;
  double statistic = 0.0;  // 2 log of the likelihood ratio against spread 0, over the inflation
  double p_value = 1.0;    // 1/2 chi2_0 + 1/2 chi2_1 under the model, F for the inflation's sake
  // Variance between blocks of the likelihood's derivative by the spread, over what independent
  // Gaussian scores let expect; moderated by what is usual, at least 1.
  double inflation = 1.0;
  int dof = 0;  // 1; 0: nothing could be tested
};

FrameTimeTest TestFrameTimes(const Scores& scores, const Scatter& usual = {});

// By block: how much more likely the scores are with this spread than with none, in units of chi2.
std::vector<double> GainOfSpread(const Scores& scores, const FrameTimeSpread& spread);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_FRAME_TIME_TEST_H_
