// What the scores of single pairs say of the delay: a step at some time, a scatter.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_SEARCH_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_SEARCH_H_

#include "estimator/diagnosis/score_test.h"

namespace camgyro {

// Largest score statistic of a step of the delay over the time of the step.
struct StepSearch {
  ScoreTest test;       // p_value corrected for the search (James, James & Siegmund 1987)
  double time_s = 0.0;  // of the second frame of the first pair after the step
  int frame = 0;        // that frame, index into Recording::frames
};
// margin_s: from either end. Returns dof 0 if there are too few pairs.
StepSearch SearchDelayStep(const Scores& scores, const Eigen::VectorXd& prior_information,
                           double margin_s, const Scatter& usual = {});

// The delay of each pair on its own: more scatter than noise? statistic: chi2 over dof pairs, after
// division by `inflation`, the same scatter of what has no time in it (the focal length), at
// least 1. estimate: per pair [s]; covariance: one column, the sigma of each.
ScoreTest TestDelayOfPairs(const Scores& scores, const Eigen::VectorXd& prior_information);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_STEP_SEARCH_H_
