// A frame's own time around its stamp, before any match has been looked at.
#ifndef CAMGYRO_FACTORS_FRAME_TIME_PRIOR_H_
#define CAMGYRO_FACTORS_FRAME_TIME_PRIOR_H_

#include <ceres/sized_cost_function.h>

#include <memory>

namespace camgyro {

//   r = offset / spread
//
// Parameters  offset   1   of the frame's time from its recorded stamp [s]
// Residual    1, in sigmas
// The spread [s] is read at every evaluation: it is estimated between solves, not in them.
class FrameTimePrior final : public ceres::SizedCostFunction<1, 1> {
 public:
  // *spread_s > 0, at every evaluation (CHECKed here).
  explicit FrameTimePrior(std::shared_ptr<const double> spread_s);

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const std::shared_ptr<const double> spread_s_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_FRAME_TIME_PRIOR_H_
