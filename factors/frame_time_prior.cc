#include "factors/frame_time_prior.h"

#include <glog/logging.h>

#include <utility>

namespace camgyro {

FrameTimePrior::FrameTimePrior(std::shared_ptr<const double> spread_s)
    : spread_s_(std::move(spread_s)) {
  CHECK_GT(*spread_s_, 0.0);
}

bool FrameTimePrior::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  residuals[0] = parameters[0][0] / *spread_s_;
  if (jacobians != nullptr && jacobians[0] != nullptr) jacobians[0][0] = 1.0 / *spread_s_;
  return true;
}

}  // namespace camgyro
