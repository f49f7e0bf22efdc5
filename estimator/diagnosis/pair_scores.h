// Scores: the derivative of the fit's cost by every parameter that is, or could be, in the model,
// with what belongs to one pair of frames alone (direction, its turn, the noise of the gyro)
// projected out, and, where the model has them, the frames' own times, which pairs of a block
// share.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_PAIR_SCORES_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_PAIR_SCORES_H_

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/calibration.h"
#include "core/effects/catalogue.h"
#include "estimator/diagnosis/shares.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

// Columns: the state (StateIndex), then the parameters of the effects in the model, then those of
// the candidates. Residuals are in sigmas, bent by the robust loss, and
//   chi2(x) = chi2 + 2 g.x + x.H x  to second order in a change x of the parameters.
struct BlockScore {
  double time_s = 0.0;  // middle of the block, camera clock
  int pairs = 0;
  int residuals = 0;  // that could vary: without two per pair for its direction
  double chi2 = 0.0;
  // Of the frames' own times in the model: chi2 + log_det is -2 log of their likelihood, whatever
  // the times, so that a model with them compares with one without, where it is 0.
  double log_det = 0.0;
  Eigen::VectorXd g;
  Eigen::MatrixXd H;
};

// One pair's part of its block, which is their sum. g has all columns, H only those of state and
// effects in the model. Where frames have times of their own, parts are not independent.
struct PairScore {
  int frame_b = 0;  // second frame, index into Recording::frames
  double time_s = 0.0;
  int block = 0;
  double chi2 = 0.0, log_det = 0.0;
  int residuals = 0;
  Eigen::VectorXd g;
  Eigen::MatrixXd H;
  // 2 log of the likelihood ratio of latents with the prior that a candidate widens against those
  // with the model's; 0 if none does.
  double latent_gain = 0.0;
};

struct Scores {
  int num_model = 0;  // state and effects in the model
  std::vector<BlockScore> blocks;
  std::vector<PairScore> pairs;
};

// `candidates` may be null. noise: of a pixel [px], of a rotation [rad] for attitudes.
Scores ComputeScores(const EstimationInput& input, const std::vector<PairBlock>& blocks,
                     const Calibration& calibration, std::shared_ptr<const EffectSet> candidates,
                     double noise, const PairGraphOptions& options);

// Sum of latent_gain by block.
std::vector<double> LatentGain(const Scores& scores);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_PAIR_SCORES_H_
