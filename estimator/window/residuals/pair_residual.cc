#include "estimator/window/residuals/pair_residual.h"

#include <glog/logging.h>

namespace camgyro {

std::vector<const double*> PairParameters::InOrder(const std::vector<BlockKind>& blocks) const {
  std::vector<const double*> ordered;
  size_t next_time = 0, next_group = 0;
  for (const BlockKind kind : blocks) {
    switch (kind) {
      case BlockKind::kLens:
        ordered.push_back(lens);
        break;
      case BlockKind::kShutter:
        ordered.push_back(shutter);
        break;
      case BlockKind::kRotation:
        ordered.push_back(q_gyro_cam);
        break;
      case BlockKind::kDirection:
        ordered.push_back(tau);
        break;
      case BlockKind::kBend:
        ordered.push_back(bend);
        break;
      case BlockKind::kEffects:
        ordered.push_back(effects);
        break;
      case BlockKind::kFrameTime:
        ordered.push_back(own_times.at(next_time++));
        break;
      case BlockKind::kRates:
        ordered.push_back(rates.at(next_group++));
        break;
      case BlockKind::kBias:
        LOG(FATAL) << "no residual of a pair depends on the bias but through the rates";
    }
  }
  return ordered;
}

std::vector<BlockKind> PairResidual::Blocks(const PairMeasurement& pair) const {
  std::vector<BlockKind> blocks;
  if (!facts_.of_attitudes) blocks.push_back(BlockKind::kLens);
  blocks.insert(blocks.end(), {BlockKind::kShutter, BlockKind::kRotation});
  if (facts_.has_direction) {
    blocks.insert(blocks.end(), {BlockKind::kDirection, BlockKind::kBend});
  }
  if (pair.effects) blocks.push_back(BlockKind::kEffects);
  if (pair.own_times) blocks.insert(blocks.end(), 2, BlockKind::kFrameTime);
  blocks.insert(blocks.end(), pair.rate_group_sizes.size(), BlockKind::kRates);
  return blocks;
}

bool PairResidual::HasResidual(const Lens&, const LensParameters&, const Bearing&,
                               const Bearing&) const {
  return true;
}

bool PairResidual::Explain(const EstimationInput&, const TimedPair&, const Calibration&, double,
                           const PairGraphOptions&, const std::optional<Eigen::Vector2d>&,
                           PairView*, std::vector<MatchMisfit>*) const {
  return false;
}

bool PairResidual::Unseen(const EstimationInput&, const TimedPair&, const Calibration&, double,
                          const PairGraphOptions&, std::vector<double>*) const {
  return false;
}

}  // namespace camgyro
