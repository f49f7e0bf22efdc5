#include "estimator/diagnosis/structure.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/step_search.h"
#include "estimator/diagnosis/thresholds.h"

namespace camgyro {
namespace {

// chi2 per residual, block by block, against that of the blocks that fit well (the lower quartile).
// Where the model is so far off that the loss takes everything for outliers, nothing else shows.
StructureMap MisfitOverTime(const Scores& scores) {
  StructureMap map;
  map.kind = MapKind::kMisfitOverTime;
  map.name = "misfit over time";
  map.unit = "chi2/dof";
  map.axis_unit = "time [s]";
  std::vector<double> values, sigmas;
  for (const BlockScore& block : scores.blocks) {
    if (block.residuals < 1) continue;
    map.axis.push_back(block.time_s);
    values.push_back(block.chi2 / block.residuals);
    sigmas.push_back(std::sqrt(2.0 * kOverdispersion / block.residuals));
  }
  const auto n = static_cast<Eigen::Index>(values.size());
  map.shape = {static_cast<int>(n)};
  map.value = Eigen::Map<const Eigen::VectorXd>(values.data(), n);
  map.sigma = Eigen::Map<const Eigen::VectorXd>(sigmas.data(), n).cwiseProduct(map.value);
  if (n < static_cast<Eigen::Index>(kLeastBlocks)) return map;
  map.dof = static_cast<int>(n);
  map.inflation = kOverdispersion;
  std::sort(values.begin(), values.end());
  const double good = values[values.size() / 4];
  for (Eigen::Index i = 0; i < n; ++i) {
    const double sigma = sigmas[static_cast<size_t>(i)];
    const double z = (map.value[i] / good - 1.0) / sigma;
    map.statistic = std::max(map.statistic, map.value[i] / good);
    map.p_value = std::min(map.p_value, static_cast<double>(n) * ChiSquareTail(z * std::abs(z), 1));
  }
  return map;
}

}  // namespace

std::vector<StructureMap> StructureMaps::Evaluate(const Scores& scores, int first,
                                                  const Eigen::VectorXd& prior_information) const {
  std::vector<StructureMap> maps = maps_;
  for (size_t m = 0; m < maps.size(); ++m) {
    const EffectSet::Item& item = set_->items()[m];
    std::vector<int> columns;
    for (int i = 0; i < item.effect->size(); ++i) columns.push_back(first + item.first + i);
    const ScoreTest test = TestColumns(scores, columns, prior_information);
    maps[m].value = test.estimate;
    if (test.dof > 0) maps[m].sigma = test.covariance.diagonal().cwiseSqrt();
    maps[m].statistic = test.statistic;
    maps[m].dof = test.dof;
    maps[m].p_value = test.p_value;
    maps[m].inflation = test.inflation;
  }
  if (!scores.blocks.empty()) maps.push_back(MisfitOverTime(scores));
  // The delay frame by frame: one value per pair, whose scatter is compared with its noise.
  if (!scores.pairs.empty()) {
    const ScoreTest test = TestDelayOfPairs(scores, prior_information);
    StructureMap map;
    map.kind = MapKind::kDelayOfFrames;
    map.name = "delay frame by frame";
    map.unit = "s";
    map.shape = {static_cast<int>(test.estimate.size())};
    map.axis_unit = "time [s]";
    for (const PairScore& pair : scores.pairs) map.axis.push_back(pair.time_s);
    map.value = test.estimate;
    map.sigma = test.covariance.col(0);
    map.statistic = test.statistic;
    map.dof = test.dof;
    map.p_value = test.p_value;
    map.inflation = test.inflation;
    maps.push_back(std::move(map));
  }
  return maps;
}

bool IsStructure(const StructureMap& map, size_t maps, double significance) {
  if (map.dof == 0) return false;
  if (map.kind == MapKind::kDelayOfFrames) {
    return map.statistic > kLeastFrameScatter * map.dof && map.p_value < kFrameScatterP;
  }
  if (map.kind == MapKind::kMisfitOverTime && map.statistic < kLeastMisfit) return false;
  return map.p_value * static_cast<double>(maps) < kStructureSignificance * significance;
}

bool DelayMoves(const std::vector<StructureMap>& maps, double significance) {
  return std::any_of(maps.begin(), maps.end(), [&](const StructureMap& map) {
    if (map.kind == MapKind::kDelayOverTime) return IsStructure(map, maps.size(), significance);
    return map.kind == MapKind::kMisfitOverTime && map.statistic > kMisfitToScan &&
           map.p_value < kMisfitToScanP;
  });
}

}  // namespace camgyro
