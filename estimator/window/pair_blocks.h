// The blocks of a PairGraph: one of each kind for all, or one per bias interval, rate group, frame
// or pair.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_PAIR_BLOCKS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_PAIR_BLOCKS_H_

#include <cstdint>

#include "estimator/window/factor_graph.h"

namespace camgyro {

inline const BlockId kLensBlock{BlockKind::kLens, 0};
inline const BlockId kShutterBlock{BlockKind::kShutter, 0};
inline const BlockId kRotationBlock{BlockKind::kRotation, 0};
inline const BlockId kEffectsBlock{BlockKind::kEffects, 0};
inline BlockId BiasBlock(int64_t index) { return {BlockKind::kBias, index}; }
inline BlockId RatesBlock(int64_t index) { return {BlockKind::kRates, index}; }
inline BlockId FrameTimeBlock(int64_t index) { return {BlockKind::kFrameTime, index}; }
inline BlockId DirectionBlock(int64_t index) { return {BlockKind::kDirection, index}; }
inline BlockId BendBlock(int64_t index) { return {BlockKind::kBend, index}; }

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_PAIR_BLOCKS_H_
