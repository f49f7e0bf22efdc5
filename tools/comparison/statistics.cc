#include "tools/comparison/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/linear_algebra.h"

namespace camgyro::comparison {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double Nees(const StateVector& error, const StateCovariance& covariance) {
  return SquaredMahalanobis(error, covariance) / kStateSize;
}

double Mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

// Percentile bootstrap of the mean; the same numbers for the same values.
void BootstrapInterval(const std::vector<double>& values, double* low, double* high) {
  constexpr int kResamples = 4000;
  if (values.size() < 3) {
    *low = *high = kNan;
    return;
  }
  std::mt19937_64 random(1);
  std::vector<double> means;
  for (int i = 0; i < kResamples; ++i) {
    double sum = 0.0;
    for (size_t k = 0; k < values.size(); ++k) sum += values[random() % values.size()];
    means.push_back(sum / static_cast<double>(values.size()));
  }
  std::sort(means.begin(), means.end());
  *low = means[static_cast<size_t>(0.025 * kResamples)];
  *high = means[static_cast<size_t>(0.975 * kResamples)];
}

// First frame from which on the error stays below 3 x the final sigma; infinite if it never does.
double FramesToConverge(const EstimatorRun& run, int parameter) {
  const double limit = 3.0 * run.trace.back().sigma[parameter];
  double frame = std::numeric_limits<double>::infinity();
  for (auto point = run.trace.rbegin(); point != run.trace.rend(); ++point) {
    if (!(std::abs(point->error[parameter]) < limit)) break;
    frame = point->frame;
  }
  return frame;
}

}  // namespace

EstimatorStatistics Summarize(const std::vector<SeedRun>& runs, size_t index) {
  EstimatorStatistics s;
  s.estimator = runs.front().estimators[index].estimator;
  std::vector<const EstimatorRun*> good;
  StateVector bound = StateVector::Zero();
  bool bounded = true;
  for (const SeedRun& run : runs) {
    const EstimatorRun& e = run.estimators[index];
    if (!e.failure.empty()) {
      ++s.failed;
      if (std::find(s.failures.begin(), s.failures.end(), e.failure) == s.failures.end()) {
        s.failures.push_back(e.failure);
      }
      continue;
    }
    good.push_back(&e);
    bounded = bounded && !run.bound.empty();
    if (!run.bound.empty()) bound += run.bound.back().diagonal();
  }
  s.runs = static_cast<int>(good.size());
  if (good.empty()) return s;
  const auto n = static_cast<double>(good.size());

  std::vector<double> nees;
  for (const EstimatorRun* run : good) {
    nees.push_back(Nees(run->error, run->covariance));
    s.ms_per_frame += 1e3 * run->cpu_s / std::max(1, run->frames) / n;
    s.memory_mb = std::max(s.memory_mb, run->memory_mb);
  }
  s.nees = Mean(nees);
  BootstrapInterval(nees, &s.nees_low, &s.nees_high);
  for (int i = 0; i < kStateSize; ++i) {
    ParameterStatistics& p = s.parameters[static_cast<size_t>(i)];
    double sum = 0.0, sum_sq = 0.0, variance = 0.0, within = 0.0;
    std::vector<double> converged;
    for (const EstimatorRun* run : good) {
      const double error = run->error[i], sigma_sq = run->covariance(i, i);
      sum += error;
      sum_sq += error * error;
      variance += sigma_sq;
      within += error * error < 9.0 * sigma_sq ? 1.0 : 0.0;
      if (!run->trace.empty()) converged.push_back(FramesToConverge(*run, i));
    }
    p.rmse = std::sqrt(sum_sq / n);
    p.sigma = std::sqrt(variance / n);
    p.bound = bounded ? std::sqrt(bound[i] / n) : kNan;
    p.bias_sigmas = sum / n / p.sigma;
    p.within_3_sigma = within / n;
    s.within_3_sigma += p.within_3_sigma / kStateSize;
    p.frames_to_converge = kNan;
    if (!converged.empty()) {
      std::sort(converged.begin(), converged.end());
      const double median = converged[converged.size() / 2];
      if (std::isfinite(median)) p.frames_to_converge = median;
    }
  }
  return s;
}

}  // namespace camgyro::comparison
