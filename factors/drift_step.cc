#include "factors/drift_step.h"

#include <ceres/sized_cost_function.h>
#include <glog/logging.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/calibration.h"

namespace camgyro {
namespace {

constexpr size_t kNodeBlocks = 3;    // q, p, v
constexpr size_t kSharedBlocks = 4;  // gravity, p_gyro_cam, calibration, point
constexpr std::array<int, kNodeBlocks + kSharedBlocks> kSizes = {4, 3, 3, 3, 3, kStateSize, 4};

class DriftStep final : public ceres::SizedCostFunction<2, 4, 3, 3 /* node of a */, 4, 3,
                                                        3 /* node of b */, 3, 3, kStateSize, 4> {
 public:
  DriftStep(const DriftStepSighting& a, const DriftStepSighting& b, double sigma_px, double frames)
      : a_{a.projection, -a.sigma_px / (sigma_px * std::sqrt(frames))},
        b_{b.projection, b.sigma_px / (sigma_px * std::sqrt(frames))} {
    CHECK(sigma_px > 0.0 && frames >= 1.0);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    std::fill(residuals, residuals + 2, 0.0);
    if (jacobians != nullptr) {
      for (size_t i = 0; i < 2 * kNodeBlocks + kSharedBlocks; ++i) {
        const size_t block = i < kNodeBlocks ? i : i - kNodeBlocks;
        if (jacobians[i] != nullptr) std::fill_n(jacobians[i], 2 * kSizes[block], 0.0);
      }
    }
    return Add(a_, 0, parameters, residuals, jacobians) &&
           Add(b_, kNodeBlocks, parameters, residuals, jacobians);
  }

 private:
  struct Term {
    const ceres::CostFunction* projection;
    double weight;
  };

  // A sighting's share; its node's blocks begin at first_block.
  static bool Add(const Term& term, size_t first_block, double const* const* parameters,
                  double* residuals, double** jacobians) {
    std::array<const double*, kSizes.size()> blocks;
    std::array<double*, kSizes.size()> parts{};
    std::array<double, 2 * (4 + 3 + 3 + 3 + 3 + kStateSize + 4)> memory;
    double* free = memory.data();
    const auto place = [&](size_t block) {
      return block < kNodeBlocks ? first_block + block : kNodeBlocks + block;
    };
    for (size_t block = 0; block < kSizes.size(); ++block) {
      blocks[block] = parameters[place(block)];
      if (jacobians == nullptr || jacobians[place(block)] == nullptr) continue;
      parts[block] = free;
      free += 2 * kSizes[block];
    }
    std::array<double, 2> residual;
    if (!term.projection->Evaluate(blocks.data(), residual.data(),
                                   jacobians == nullptr ? nullptr : parts.data())) {
      return false;
    }
    for (size_t i = 0; i < 2; ++i) residuals[i] += term.weight * residual[i];
    for (size_t block = 0; block < kSizes.size(); ++block) {
      if (parts[block] == nullptr) continue;
      double* sum = jacobians[place(block)];
      for (int i = 0; i < 2 * kSizes[block]; ++i) sum[i] += term.weight * parts[block][i];
    }
    return true;
  }

  const Term a_, b_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> MakeDriftStep(const DriftStepSighting& a,
                                                   const DriftStepSighting& b, double sigma_px,
                                                   double frames) {
  return std::make_unique<DriftStep>(a, b, sigma_px, frames);
}

}  // namespace camgyro
