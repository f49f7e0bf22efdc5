// What the residuals of an odometry's window say of the noise of its pixels.
#ifndef CAMGYRO_ESTIMATOR_ODOMETRY_PIXEL_NOISE_H_
#define CAMGYRO_ESTIMATOR_ODOMETRY_PIXEL_NOISE_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace camgyro {

class PixelNoise {
 public:
  // Residuals of a landmark's sightings by keyframe, in pixels. Of tracks that drift
  // (factors/drift_step.h) those of its steps: the first one says nothing, since it is where the
  // landmark begins.
  void Add(const std::vector<Eigen::Vector2d>& residuals_px, bool tracks_drift);

  // Of residuals of neighbouring sightings of one landmark: below 0 where noise is independent,
  // since the landmark has taken its part of it; above where errors of tracks add up. 0 of tracks
  // that are taken to drift.
  double Correlation() const { return squares_ > 0.0 ? products_ / squares_ : 0.0; }

  size_t size() const { return norms_px_.size(); }

  // Per axis, by the median of lengths; `taken`: degrees of freedom that the fit has.
  double SigmaPx(double taken) const;

 private:
  std::vector<double> norms_px_;
  double squares_ = 0.0, products_ = 0.0;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_ODOMETRY_PIXEL_NOISE_H_
