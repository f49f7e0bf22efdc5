// The estimated parameters as people see them: one list for terminal and report.
#ifndef CAMGYRO_TOOLS_REPORT_PARAMETER_ROWS_H_
#define CAMGYRO_TOOLS_REPORT_PARAMETER_ROWS_H_

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration.h"
#include "core/effects/catalogue.h"

namespace camgyro {

struct ParameterRow {
  std::string name;
  int index = 0;                      // StateIndex
  double value = 0.0;                 // in `unit`
  double sigma = 0.0;                 // in `unit`, of noise
  std::optional<double> sigma_total;  // in `unit`, with what undeclared effects may add
  double unit_scale = 1.0;            // value in `unit` / value in the SI unit or px of the state
  std::string unit;
  bool determined = false;
};

// The signed permutation of axes nearest to the mounting, camera -> gyro.
Eigen::Matrix3d MountingPermutation(const Calibration& calibration);

// One row per parameter, in the order of StateIndex; with `attitudes` without those that need
// pixels. Rotations are what is left of q_gyro_cam after `permutation`, as a rotation vector about
// the camera's axes.
std::vector<ParameterRow> ParameterRows(const Calibration& calibration,
                                        const Eigen::Matrix3d& permutation, bool attitudes);

// The unit of an effect's parameter in calibration.yaml as people read it: ms for s.
struct ReadableUnit {
  double scale = 1.0;  // value in this unit / value in that of the file
  std::string name;
};
ReadableUnit ReadableUnitOf(const std::string& unit);

// An effect of a fit as people know it, with its shape where the shape has numbers that were found.
std::string NameWithShape(const EffectSet::Item& item);

// Digits after the point that show two digits of the sigma, 0..6.
int DecimalsFor(double sigma);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_REPORT_PARAMETER_ROWS_H_
