// What several recordings say of the same parameters, as one estimate; and how well they repeat it.
#ifndef CAMGYRO_PIPELINE_COMBINE_H_
#define CAMGYRO_PIPELINE_COMBINE_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace camgyro {

// How often, at most, a set of recordings that differ by chance only has one called odd.
constexpr double kOddLevel = 0.01;
// Recordings whose disagreement is less likely than this by noise alone have a spread of their own.
constexpr double kAgreeLevel = 0.1;

// A posterior, Gaussian.
struct RecordingEstimate {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;  // of noise and prior
  Eigen::MatrixXd systematic;  // what the total covariance has beside
  // The prior that is part of it, parameters independent.
  Eigen::VectorXd prior_value, prior_sigma;
  std::vector<bool> determined;  // parameters that are not are taken as not measured
};

// A parameter in several recordings.
struct Repeatability {
  int recordings = 0;    // that determined it
  double between = 0.0;  // standard deviation between recordings, beyond their noise
  double chi2 = 0.0;  // of their disagreement in view of noise, recordings - 1 degrees of freedom
  double p_value = 1.0;  // of that
};

// A recording that disagrees with all others together.
struct OddRecording {
  size_t recording = 0;
  Eigen::Index parameter = 0;
  double sigmas = 0.0;   // difference over its sigma, with the spread between the others
  double p_value = 1.0;  // times the number of comparisons
};

// Of the shared parameters together, in view of noise alone.
struct Agreement {
  double chi2 = 0.0;
  int dof = 0;
  double p_value = 1.0;
};

struct CombinedEstimate {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;           // of noise
  Eigen::MatrixXd between, systematic;  // what the total has beside
  std::vector<Repeatability> repeatability;
  std::vector<double> weights;  // of the recordings, over all parameters; sum 1
  Agreement agreement;
  std::vector<OddRecording> odd;  // the first one first

  Eigen::MatrixXd total() const { return covariance + between + systematic; }
};

// Random effects: recording i measures the parameters x with an error of noise D_i and one of its
// own, of covariance T = diag(between^2), so that x is the mean weighted by (D_i + T)^-1. The prior
// is taken out of each posterior and put in once. Each between^2 is the one that makes the weighted
// sum of squared differences its expectation, n - 1, or zero if noise alone makes more of it (Paule
// & Mandel, "Consensus values and weighting factors", J. Res. NBS 87, 1982).
//
// shared: parameters that are the same in all recordings. The others are combined one by one, and
// their `between` is not that of the mean, but of the next recording's value about it.
//
// systematic: errors of the recordings that are not known to be independent, since they have one
// device. A parameter's is the sum of theirs times their weights, as if they were all alike.
//
// Odd: leaving a recording out, the others have a mean and a spread of their own. The difference is
// normal in view of both where the others agree with each other (kAgreeLevel, all shared parameters
// together); else the spread counts, which n - 1 others tell no better than t with n - 2 degrees of
// freedom allows for. Bonferroni's correction covers all comparisons. With two recordings none can
// be told to be the odd one.
//
// estimates: at least one, of equal sizes.
CombinedEstimate Combine(const std::vector<RecordingEstimate>& estimates,
                         const std::vector<bool>& shared);

}  // namespace camgyro

#endif  // CAMGYRO_PIPELINE_COMBINE_H_
