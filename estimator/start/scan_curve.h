// The losses of a scan: of one unknown of the start, at several values of it.
#ifndef CAMGYRO_ESTIMATOR_START_SCAN_CURVE_H_
#define CAMGYRO_ESTIMATOR_START_SCAN_CURVE_H_

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "core/recording.h"

namespace camgyro {

constexpr int kScanBlocks = 20;  // of time, for the honest sigma

struct ScanPoint {
  double x = 0.0;  // what is scanned: log of the focal length, or readout time / frame interval
  RotationTrial trial;
  std::vector<CameraRotation> rotations;
  // Of each pair: squared residuals, in the units of the noise, and its block.
  std::vector<double> squares;
  std::vector<int> blocks;
  double noise = 0.0;
  double gyro_power = 0.0;
  // Truncated losses per block.
  Eigen::VectorXd loss;
};

// The losses along what is scanned, by ascending x.
class ScanCurve {
 public:
  // spacing: between the points, of which there are two more half of it around the best one.
  // means_of: each square is the mean of at least so many.
  ScanCurve(std::vector<ScanPoint> points, double spacing, double means_of);

  const std::vector<ScanPoint>& points() const { return points_; }
  double gyro_power() const { return gyro_power_; }

  const ScanPoint& Best() const;

  // Loss of the best point / least loss further than `distance` away from it.
  double RunnerUpRatio(double distance) const;

  // Of the parabola through the points around the best one: x, and its standard deviation.
  std::pair<double, double> Minimum() const;

 private:
  // Losses, bounded by the least noise of any point.
  void Truncate();

  std::vector<ScanPoint> points_;
  double spacing_, means_of_;
  double noise_ = -1.0, gyro_power_ = 0.0;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_START_SCAN_CURVE_H_
