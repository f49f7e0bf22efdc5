#include "pipeline/combine.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/linear_algebra.h"
#include "estimator/diagnosis/score_test.h"

namespace camgyro {
namespace {

using Indices = std::vector<Eigen::Index>;

// What a recording says without its prior. Entries of parameters that it did not determine, and
// between what is shared and what is not, are zero.
struct Measurement {
  Indices measured;
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;
};

Eigen::MatrixXd Block(const Eigen::MatrixXd& m, const Indices& at) {
  const auto n = static_cast<Eigen::Index>(at.size());
  Eigen::MatrixXd block(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      block(i, j) = m(at[static_cast<size_t>(i)], at[static_cast<size_t>(j)]);
    }
  }
  return block;
}

void SetBlock(const Eigen::MatrixXd& block, const Indices& at, Eigen::MatrixXd* m) {
  for (size_t i = 0; i < at.size(); ++i) {
    for (size_t j = 0; j < at.size(); ++j) {
      (*m)(at[i], at[j]) = block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
}

// In units of the prior's sigmas, where its information is the identity: what the posterior has
// beyond. A direction without any gets this much instead of none.
constexpr double kLeastInformation = 1e-3;

void TakePriorOut(const RecordingEstimate& e, const Indices& at, Measurement* m) {
  if (at.empty()) return;
  const auto n = static_cast<Eigen::Index>(at.size());
  Eigen::VectorXd scale(n), offset(n), prior(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index k = at[static_cast<size_t>(i)];
    scale[i] = e.prior_sigma[k];
    prior[i] = e.prior_value[k];
    offset[i] = (e.value[k] - prior[i]) / scale[i];
  }
  const Eigen::VectorXd inverse = scale.cwiseInverse();
  const Eigen::MatrixXd precision =
      SymmetricSolver(inverse.asDiagonal() * Block(e.covariance, at) * inverse.asDiagonal())
          .Inverse();
  const SymmetricSpectrum eigen = SpectrumOfSymmetric(precision);
  const Eigen::VectorXd data = (eigen.values.array() - 1.0).max(kLeastInformation);
  const Eigen::MatrixXd covariance =
      eigen.vectors * data.cwiseInverse().asDiagonal() * eigen.vectors.transpose();
  const Eigen::VectorXd value = prior + scale.cwiseProduct(covariance * (precision * offset));
  for (size_t i = 0; i < at.size(); ++i) m->value[at[i]] = value[static_cast<Eigen::Index>(i)];
  SetBlock(scale.asDiagonal() * covariance * scale.asDiagonal(), at, &m->covariance);
}

Measurement MeasurementOf(const RecordingEstimate& e, const std::vector<bool>& shared) {
  const Eigen::Index n = e.value.size();
  Measurement m{{}, Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  Indices together;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!e.determined[static_cast<size_t>(i)]) continue;
    m.measured.push_back(i);
    if (shared[static_cast<size_t>(i)]) {
      together.push_back(i);
    } else {
      TakePriorOut(e, {i}, &m);
    }
  }
  TakePriorOut(e, together, &m);
  return m;
}

// One parameter in some recordings.
struct Sample {
  std::vector<double> value, variance;
};

struct WeightedMean {
  double mean = 0.0, variance = 0.0, chi2 = 0.0;
};

WeightedMean MeanOf(const Sample& s, double between_sq) {
  double sum = 0.0, sum_w = 0.0;
  for (size_t i = 0; i < s.value.size(); ++i) {
    sum += s.value[i] / (s.variance[i] + between_sq);
    sum_w += 1.0 / (s.variance[i] + between_sq);
  }
  WeightedMean m{sum / sum_w, 1.0 / sum_w, 0.0};
  for (size_t i = 0; i < s.value.size(); ++i) {
    const double d = s.value[i] - m.mean;
    m.chi2 += d * d / (s.variance[i] + between_sq);
  }
  return m;
}

// Paule & Mandel. The sum of squares falls with the variance; at the sample's own variance it is
// no more than n - 1.
double BetweenVariance(const Sample& s) {
  const auto dof = static_cast<double>(s.value.size()) - 1.0;
  if (dof < 1.0 || MeanOf(s, 0.0).chi2 <= dof) return 0.0;
  double mean = 0.0, high = 0.0, low = 0.0;
  for (const double v : s.value) mean += v / (dof + 1.0);
  for (const double v : s.value) high += (v - mean) * (v - mean) / dof;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (MeanOf(s, middle).chi2 > dof ? low : high) = middle;
  }
  return high;
}

Sample SampleOf(const std::vector<Measurement>& all, Eigen::Index parameter, Indices* recordings) {
  Sample s;
  for (size_t r = 0; r < all.size(); ++r) {
    const Indices& measured = all[r].measured;
    if (std::find(measured.begin(), measured.end(), parameter) == measured.end()) continue;
    s.value.push_back(all[r].value[parameter]);
    s.variance.push_back(all[r].covariance(parameter, parameter));
    recordings->push_back(static_cast<Eigen::Index>(r));
  }
  return s;
}

// Each of the sample against the others.
std::vector<OddRecording> Compare(const Sample& s, const Indices& recordings,
                                  Eigen::Index parameter, const std::vector<bool>& others_agree) {
  std::vector<OddRecording> compared;
  for (size_t i = 0; s.value.size() >= 3 && i < s.value.size(); ++i) {
    Sample others = s;
    others.value.erase(others.value.begin() + static_cast<long>(i));
    others.variance.erase(others.variance.begin() + static_cast<long>(i));
    const double between_sq = BetweenVariance(others);
    const WeightedMean mean = MeanOf(others, between_sq);
    const double z =
        (s.value[i] - mean.mean) / std::sqrt(s.variance[i] + between_sq + mean.variance);
    const auto recording = static_cast<size_t>(recordings[i]);
    const double p = others_agree[recording]
                         ? ChiSquareTail(z * z, 1.0)
                         : FTail(z * z, 1.0, static_cast<double>(others.value.size() - 1));
    compared.push_back({recording, parameter, z, p});
  }
  return compared;
}

// The comparisons that are beyond chance, one per recording.
std::vector<OddRecording> OddOnes(std::vector<OddRecording> compared) {
  for (OddRecording& c : compared) {
    c.p_value = std::min(1.0, c.p_value * static_cast<double>(compared.size()));
  }
  std::sort(compared.begin(), compared.end(), [](const OddRecording& a, const OddRecording& b) {
    return a.p_value != b.p_value ? a.p_value < b.p_value : a.recording < b.recording;
  });
  std::vector<OddRecording> odd;
  for (const OddRecording& c : compared) {
    const bool named = std::any_of(
        odd.begin(), odd.end(), [&](const OddRecording& o) { return o.recording == c.recording; });
    if (c.p_value < kOddLevel && !named) odd.push_back(c);
  }
  return odd;
}

// Information of a measurement whose parameters differ between recordings by T.
Eigen::MatrixXd InformationOf(const Measurement& m, const Eigen::VectorXd& between_sq) {
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(m.value.size(), m.value.size());
  if (m.measured.empty()) return information;
  Eigen::MatrixXd covariance = m.covariance;
  covariance.diagonal() += between_sq;
  SetBlock(SymmetricSolver(Block(covariance, m.measured)).Inverse(), m.measured, &information);
  return information;
}

// Disagreement of the shared parameters in view of noise alone, without the recording `left_out`.
Agreement AgreementOf(const std::vector<Measurement>& all, const std::vector<bool>& shared,
                      size_t left_out) {
  const auto n = static_cast<Eigen::Index>(shared.size());
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd eta = none;
  std::vector<bool> seen(shared.size(), false);
  Agreement agreement;
  for (size_t r = 0; r < all.size(); ++r) {
    if (r == left_out) continue;
    const Eigen::MatrixXd information = InformationOf(all[r], none);
    sum += information;
    eta += information * all[r].value;
    for (const Eigen::Index i : all[r].measured) {
      if (!shared[static_cast<size_t>(i)]) continue;
      agreement.dof += seen[static_cast<size_t>(i)] ? 1 : 0;
      seen[static_cast<size_t>(i)] = true;
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (sum(i, i) == 0.0) sum(i, i) = 1.0;  // measured by none: stays apart
  }
  const Eigen::VectorXd mean = SymmetricSolver(sum).Solve(eta);
  for (size_t r = 0; r < all.size(); ++r) {
    if (r == left_out) continue;
    Eigen::VectorXd d = all[r].value - mean;
    for (Eigen::Index i = 0; i < n; ++i) d[i] *= shared[static_cast<size_t>(i)] ? 1.0 : 0.0;
    agreement.chi2 += d.dot(InformationOf(all[r], none) * d);
  }
  if (agreement.dof > 0) agreement.p_value = ChiSquareTail(agreement.chi2, agreement.dof);
  return agreement;
}

// The sum of the recordings' systematic errors times their weights, as if they were all alike.
// Whatever they have in common, (sum_r A_r e_r)^2 is no more than sum_r (A_r e_r)^2 / p_r for any
// p_r > 0 of sum 1; its correlations are taken, and the lengths of the sum of the sigmas.
Eigen::MatrixXd SystematicOf(const std::vector<Eigen::MatrixXd>& each,
                             const std::vector<double>& weights) {
  Eigen::MatrixXd bound = Eigen::MatrixXd::Zero(each.front().rows(), each.front().cols());
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(bound.rows());
  for (size_t r = 0; r < each.size(); ++r) {
    if (!(weights[r] > 0.0)) continue;
    bound += each[r] / weights[r];
    sigma += each[r].diagonal().cwiseMax(0.0).cwiseSqrt();
  }
  const Eigen::VectorXd shrink =
      (bound.diagonal().array() > 0.0)
          .select(sigma.cwiseQuotient(bound.diagonal().cwiseSqrt()), 0.0);
  return shrink.asDiagonal() * bound * shrink.asDiagonal();
}

// Values and covariances for these variances between recordings.
void Weigh(const std::vector<RecordingEstimate>& estimates, const std::vector<Measurement>& all,
           const std::vector<bool>& shared, const Eigen::VectorXd& between_sq,
           CombinedEstimate* c) {
  const Eigen::Index n = between_sq.size();
  Eigen::VectorXd prior_mean = Eigen::VectorXd::Zero(n);
  for (const RecordingEstimate& e : estimates) {
    prior_mean += e.prior_value / static_cast<double>(estimates.size());
  }
  const Eigen::MatrixXd prior =
      estimates.front().prior_sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  Eigen::MatrixXd sum = prior;
  Eigen::VectorXd eta = prior * prior_mean;
  std::vector<Eigen::MatrixXd> information;
  for (const Measurement& m : all) {
    information.push_back(InformationOf(m, between_sq));
    sum += information.back();
    eta += information.back() * m.value;
  }
  const Eigen::MatrixXd inverse = SymmetricSolver(sum).Inverse();
  c->value = inverse * eta;
  c->covariance = inverse * prior * inverse;
  c->between = Eigen::MatrixXd::Zero(n, n);
  std::vector<Eigen::MatrixXd> systematic;
  double sum_weights = 0.0;
  for (size_t r = 0; r < all.size(); ++r) {
    const Eigen::MatrixXd A = inverse * information[r];
    c->covariance += A * all[r].covariance * A.transpose();
    c->between += A * between_sq.asDiagonal() * A.transpose();
    systematic.push_back(A * estimates[r].systematic * A.transpose());
    c->weights.push_back(std::max(0.0, A.trace()));
    sum_weights += c->weights.back();
  }
  for (double& w : c->weights) w /= std::max(sum_weights, 1e-30);
  c->systematic = SystematicOf(systematic, c->weights);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!shared[static_cast<size_t>(i)]) c->between(i, i) += between_sq[i];
  }
}

}  // namespace

CombinedEstimate Combine(const std::vector<RecordingEstimate>& estimates,
                         const std::vector<bool>& shared) {
  const auto n = static_cast<Eigen::Index>(shared.size());
  std::vector<Measurement> all;
  for (const RecordingEstimate& e : estimates) all.push_back(MeasurementOf(e, shared));
  CombinedEstimate c;
  c.value = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd between_sq(n);
  std::vector<OddRecording> compared;
  std::vector<bool> others_agree;
  for (size_t r = 0; r < all.size(); ++r) {
    others_agree.push_back(AgreementOf(all, shared, r).p_value > kAgreeLevel);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    Indices recordings;
    const Sample sample = SampleOf(all, i, &recordings);
    between_sq[i] = BetweenVariance(sample);
    Repeatability repeats{static_cast<int>(recordings.size()), std::sqrt(between_sq[i]), 0.0, 1.0};
    if (recordings.size() > 1) {
      repeats.chi2 = MeanOf(sample, 0.0).chi2;
      repeats.p_value = ChiSquareTail(repeats.chi2, repeats.recordings - 1.0);
    }
    c.repeatability.push_back(repeats);
    if (!shared[static_cast<size_t>(i)]) continue;
    const std::vector<OddRecording> of_parameter = Compare(sample, recordings, i, others_agree);
    compared.insert(compared.end(), of_parameter.begin(), of_parameter.end());
  }
  c.odd = OddOnes(std::move(compared));
  c.agreement = AgreementOf(all, shared, all.size());
  Weigh(estimates, all, shared, between_sq, &c);
  return c;
}

}  // namespace camgyro
