// Structure without a name: what is left over the image, row, time, rates, exposure and so on,
// whatever the catalogue may say of it.
#ifndef CAMGYRO_ESTIMATOR_DIAGNOSIS_STRUCTURE_H_
#define CAMGYRO_ESTIMATOR_DIAGNOSIS_STRUCTURE_H_

#include <memory>
#include <string>
#include <vector>

#include "core/effects/catalogue.h"
#include "estimator/diagnosis/score_test.h"

namespace camgyro {

// Maps that decide about more than whether they show structure.
enum class MapKind { kOther, kDelayOverTime, kDelayOfFrames, kMisfitOverTime };

// One map: what a piecewise constant change along some axis would be, cell by cell.
struct StructureMap {
  MapKind kind = MapKind::kOther;
  std::string name;          // "image", "row", "delay over time", ...
  std::string unit;          // of the values
  std::vector<int> shape;    // cells: {n}, or {rows, columns} of an image; values: x and y in turn
  std::vector<double> axis;  // middles of the cells along a one-dimensional map
  std::string axis_unit;
  Eigen::VectorXd value, sigma;
  double statistic = 0.0, p_value = 1.0, inflation = 1.0;
  int dof = 0;
};

// The maps that a recording can show, as an EffectSet whose parameters are the cells. They enter
// ComputeScores as candidates.
class StructureMaps {
 public:
  // frames_have_times: frames have times of their own in the model (frame_stamp_jitter). Then their
  // stamps, and so the intervals between these, are off by the same amounts as the delay, and no
  // map is made of the one over the other.
  StructureMaps(const EffectSetup& setup, const Eigen::Vector3d& bias_rad_s,
                bool frames_have_times);
  std::shared_ptr<const EffectSet> set() const { return set_; }
  // `first`: column of the set's first parameter in the scores.
  std::vector<StructureMap> Evaluate(const Scores& scores, int first,
                                     const Eigen::VectorXd& prior_information) const;

 private:
  std::shared_ptr<EffectSet> set_;
  std::vector<StructureMap> maps_;
};

// Does a map, one of `maps`, show structure? significance: DiagnoseOptions'.
bool IsStructure(const StructureMap& map, size_t maps, double significance);

// Does the delay, or the misfit, come and go with time, so that a step of the delay that is beyond
// the robust loss is worth a scan?
bool DelayMoves(const std::vector<StructureMap>& maps, double significance);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_DIAGNOSIS_STRUCTURE_H_
