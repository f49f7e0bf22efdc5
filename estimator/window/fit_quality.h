// How well matches fit: in a fit, and where it has not seen them.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_FIT_QUALITY_H_
#define CAMGYRO_ESTIMATOR_WINDOW_FIT_QUALITY_H_

#include <algorithm>
#include <vector>

#include "core/calibration.h"
#include "estimator/window/estimation_input.h"
#include "estimator/window/pair_graph_options.h"

namespace camgyro {

struct FitQuality {
  int pairs = 0;              // used
  int matches = 0;            // in them
  double inlier_ratio = 0.0;  // share of matches within PairGraphOptions::inlier_sigmas
  double noise_px = 0.0;      // robust standard deviation per axis (attitudes: rad)
  // How that scatters from pair to pair: rms of the logarithms of the pairs' factors.
  double noise_scatter = 0.0;
  // NeighbourCorrelation::DesignEffect: so many matches tell what an independent one would.
  double design_effect = 1.0;
  double rms_px = 0.0;        // of residuals, each bounded by the loss
  double usual_rms_px = 0.0;  // FitSum::usual_rms
};

// How well matches fit, pair by pair.
class FitSum {
 public:
  // per_match: residuals. lost_per_pair: degrees of freedom that a fit takes of these. The options
  // must outlive it.
  FitSum(const PairGraphOptions& options, int per_match, int lost_per_pair)
      : options_(options), per_match_(per_match), lost_per_pair_(lost_per_pair) {}
  // Independent residuals of a pair, in sigmas, without loss. factor: of its noise.
  void Add(const std::vector<double>& residuals, double factor);
  int matches() const { return matches_; }
  // Per residual, in sigmas of a pair whose factor is 1.
  double rms() const;
  // Per degree of freedom, and without the tenth of the pairs that fits worst: a frame whose points
  // are all wrong, or that is late, says nothing of the model.
  double usual_rms() const;
  double inlier_ratio() const { return static_cast<double>(inliers_) / std::max(1, matches_); }

 private:
  const PairGraphOptions& options_;
  const int per_match_, lost_per_pair_;
  struct OfPair {
    double sum_sq = 0.0;
    int matches = 0;
  };
  double RmsOf(const std::vector<OfPair>& pairs, int lost_per_pair) const;

  std::vector<OfPair> pairs_;
  int inliers_ = 0, matches_ = 0;
};

// Residuals of pairs that a fit has not seen: rates from the gyro with the calibration's bias, the
// direction of each pair (and its frames' own times, if they have any) from every other match,
// residuals from the rest, over what the direction's own error lets expect (PredictedResiduals):
// with few matches it is as large as the noise. A transfer has no direction: residuals from all
// matches.
struct UnseenFit {
  int pairs = 0;
  int matches = 0;
  double rms_px = 0.0, usual_rms_px = 0.0;  // as those of FitQuality
  // What the gyro's noise may turn such pairs by (rms): it is in rms_px for the most part, and a
  // fit has it in its rates.
  double gyro_px = 0.0;
};
UnseenFit EvaluateUnseen(const EstimationInput& input, const std::vector<TimedPair>& pairs,
                         const Calibration& calibration, double noise_px,
                         const PairGraphOptions& options);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_FIT_QUALITY_H_
