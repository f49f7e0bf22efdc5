// One pair of frames as linear equations: its residuals, and how all that it depends on changes
// them.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_PAIR_SYSTEM_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_PAIR_SYSTEM_H_

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "core/calibration.h"
#include "core/effects/catalogue.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"
#include "factors/coplanarity_plane.h"

namespace camgyro {

// The model's effects and the candidates side by side; candidates at zero.
struct AllEffects {
  std::shared_ptr<const EffectSet> set;
  Eigen::VectorXd values;
  double free_turn_rad_s = 0.0;  // what candidates widen the prior of the turn to; 0: none does
  // Of the frames' own times around their stamps, in the model [s]; 0: they have none there.
  double frame_time_spread_s = 0.0;
  // PairSystem::by_times is wanted although the model has them not.
  bool with_times = false;
};
AllEffects AllEffectsOf(const Calibration& calibration, const EffectSet* candidates);

// r and J (state, effects) of one pair with the pair's own columns N, which have precisions P.
struct PairSystem {
  Eigen::VectorXd r;
  Eigen::MatrixXd J, N;
  Eigen::VectorXd prior;  // of N's columns, 1 / sigma^2, around zero
  Eigen::VectorXd at;     // where they are
  int bend_column = -1;   // of N, where a candidate frees the bend; -1: none does
  BendVector free_bend;   // 1 / sigma^2 of a bend that is free
  int times_column = -1;  // of N, of the two frames' own times; -1: they have none in the model
  Eigen::Index first_of_gyro = 0;  // of N: columns of the gyro's noise, up to the last
  // Derivatives by the offsets of the two frames from their stamps [1/s], where they are in the
  // model or AllEffects wants them; else no columns.
  Eigen::MatrixXd by_times;
};

// False where the gyro does not cover the pair, or it has too few matches or no value. noise: of a
// pixel [px], of a rotation [rad] for attitudes. times_s: of the two frames after their stamps,
// where the model has times of their own; nothing: those that the pair's own matches tell.
[[nodiscard]] bool MakePairSystem(const EstimationInput& input, const TimedPair& pair,
                                  const Calibration& calibration, const AllEffects& all,
                                  double noise, const PairGraphOptions& options, PairSystem* system,
                                  const std::optional<Eigen::Vector2d>& times_s = std::nullopt);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_PAIR_SYSTEM_H_
