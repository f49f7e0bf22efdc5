// Recordings of one device, as Gaussians that are drawn.
#include "pipeline/combine.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

#include "core/linear_algebra.h"

namespace camgyro {
namespace {

constexpr int kParameters = 4;
const std::vector<bool> kAllShared(kParameters, true);

// Recordings of a device whose parameters are zero, as posteriors under a prior of sigma 100:
// correlated noise of sigma `noise`, and a shift of each recording of sigma `between`.
class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}

  RecordingEstimate Recording(double noise = 1.0, double between = 0.0) {
    Eigen::Matrix4d root = noise * Eigen::Matrix4d::Identity();
    root(1, 0) = 0.5 * noise;
    root(3, 2) = -0.8 * noise;
    const Eigen::Matrix4d data = root * root.transpose();
    RecordingEstimate e;
    e.prior_value = Eigen::Vector4d(3.0, -2.0, 1.0, 0.0);
    e.prior_sigma = Eigen::Vector4d::Constant(100.0);
    const Eigen::Matrix4d prior = e.prior_sigma.cwiseAbs2().cwiseInverse().asDiagonal();
    const Eigen::Vector4d shift = Normal(), error = Normal();  // drawn in this order
    const Eigen::Vector4d measured = root * error + between * shift;
    e.covariance = (data.inverse() + prior).inverse();
    e.value = e.covariance * (data.inverse() * measured + prior * e.prior_value);
    e.systematic = Eigen::Matrix4d::Zero();
    e.determined.assign(kParameters, true);
    return e;
  }

  std::vector<RecordingEstimate> Recordings(int n, double between = 0.0) {
    std::vector<RecordingEstimate> all;
    // Of different lengths.
    for (int i = 0; i < n; ++i) all.push_back(Recording(1.0 + 0.5 * (i % 3), between));
    return all;
  }

 private:
  Eigen::Vector4d Normal() {
    Eigen::Vector4d v;
    for (double& x : v) x = normal_(random_);
    return v;
  }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

// Two Gaussians with one prior: information adds, the prior's once.
TEST(Combine, AddsInformationAndThePriorOnce) {
  Draw draw(1);
  std::vector<RecordingEstimate> two = {draw.Recording(), draw.Recording()};
  two[1].value = two[0].value;  // no disagreement, no spread
  const CombinedEstimate c = Combine(two, kAllShared);
  const Eigen::MatrixXd prior = two[0].prior_sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd expected = (2.0 * two[0].covariance.inverse() - prior).inverse();
  EXPECT_LT((c.covariance - expected).norm(), 1e-9 * expected.norm());
  EXPECT_LT(c.between.norm(), 1e-12);
  EXPECT_NEAR(c.agreement.chi2, 0.0, 1e-9);
  EXPECT_EQ(c.agreement.dof, kParameters);
  EXPECT_THAT(c.odd, testing::IsEmpty());
}

// One recording is itself.
TEST(Combine, LeavesOneRecordingAsItIs) {
  Draw draw(2);
  const RecordingEstimate one = draw.Recording();
  const CombinedEstimate c = Combine({one}, kAllShared);
  EXPECT_LT((c.value - one.value).norm(), 1e-9);
  EXPECT_LT((c.covariance - one.covariance).norm(), 1e-9);
  EXPECT_EQ(c.agreement.dof, 0);
}

// Over many clean devices: errors are what the covariance says, the disagreement is chi-square, the
// spread hardly adds, no more recordings are called odd than kOddLevel allows.
TEST(Combine, IsRightAboutCleanRecordings) {
  constexpr int kDevices = 1000;
  Draw draw(3);
  double nees = 0.0, chi2 = 0.0, added = 0.0;
  int odd = 0, without_spread = 0, dof = 0;
  for (int d = 0; d < kDevices; ++d) {
    const CombinedEstimate c = Combine(draw.Recordings(5), kAllShared);
    nees += c.value.dot(c.covariance.inverse() * c.value) / kParameters;
    chi2 += c.agreement.chi2;
    dof = c.agreement.dof;
    added += c.between.trace() / c.covariance.trace() / kDevices;
    odd += c.odd.empty() ? 0 : 1;
    without_spread += c.repeatability[0].between == 0.0 ? 1 : 0;
  }
  EXPECT_EQ(dof, 4 * kParameters);
  EXPECT_NEAR(nees / kDevices, 1.0, 0.1);  // 3 sigmas: 0.07, and weights that follow a spread
  EXPECT_NEAR(chi2 / kDevices / dof, 1.0, 0.04);
  EXPECT_LT(odd, 20);  // 10 expected at the most, 3 sigmas above
  EXPECT_GT(without_spread, kDevices / 2);
  EXPECT_LT(added, 0.5);
}

// Sigmas shrink as 1 / sqrt(n).
TEST(Combine, SigmasShrinkWithTheRootOfTheNumber) {
  Draw draw(4);
  const RecordingEstimate one = draw.Recording();
  const auto sigma_of = [&](size_t n) {
    return std::sqrt(Combine(std::vector<RecordingEstimate>(n, one), kAllShared).covariance(0, 0));
  };
  EXPECT_NEAR(sigma_of(4), 0.5 * sigma_of(1), 1e-3 * sigma_of(1));
  EXPECT_NEAR(sigma_of(9), sigma_of(1) / 3.0, 1e-3 * sigma_of(1));
}

// Recordings that differ by more than noise: the total covers the errors, the noise does not; the
// spread is found; and differing alike makes nobody odd.
TEST(Combine, SpreadBetweenRecordingsEntersTheTotal) {
  constexpr int kDevices = 400;
  Draw draw(5);
  double in_noise = 0.0, in_total = 0.0, between_sq = 0.0;
  int odd = 0;
  for (int d = 0; d < kDevices; ++d) {
    const CombinedEstimate c = Combine(draw.Recordings(6, /*between=*/5.0), kAllShared);
    const double square = c.value[0] * c.value[0] / kDevices;
    in_noise += square / c.covariance(0, 0);
    in_total += square / c.total()(0, 0);
    between_sq += c.repeatability[0].between * c.repeatability[0].between / kDevices;
    odd += c.odd.empty() ? 0 : 1;
  }
  EXPECT_GT(in_noise, 5.0);
  // A variance from six values: the mean of its inverse is 5/3 of the inverse of its mean.
  EXPECT_GT(in_total, 0.8);
  EXPECT_LT(in_total, 2.2);
  EXPECT_NEAR(std::sqrt(between_sq), 5.0, 0.5);
  EXPECT_LT(odd, 16);  // 4 expected, and an approximation of the degrees of freedom
}

TEST(Combine, NamesTheOddRecordingAndItsParameter) {
  int named = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    Draw draw(100 + seed);
    std::vector<RecordingEstimate> all = draw.Recordings(5);
    all[3].value[2] += 12.0;
    const CombinedEstimate c = Combine(all, kAllShared);
    if (c.odd.empty()) continue;
    EXPECT_EQ(c.odd[0].recording, 3u);
    EXPECT_EQ(c.odd[0].parameter, 2);
    EXPECT_GT(c.odd[0].sigmas, 3.0);
    EXPECT_LT(c.agreement.p_value, 0.01);
    ++named;
  }
  EXPECT_GT(named, 40);
}

// With two, nobody knows which; that they disagree is seen.
TEST(Combine, OfTwoNoneIsOdd) {
  Draw draw(7);
  std::vector<RecordingEstimate> two = draw.Recordings(2);
  two[1].value[0] += 30.0;
  const CombinedEstimate c = Combine(two, kAllShared);
  EXPECT_THAT(c.odd, testing::IsEmpty());
  EXPECT_LT(c.repeatability[0].p_value, 1e-6);
  EXPECT_GT(c.repeatability[0].between, 10.0);
}

// What a recording has not determined comes from the others alone.
TEST(Combine, WhatWasNotDeterminedDoesNotCount) {
  Draw draw(8);
  std::vector<RecordingEstimate> all = draw.Recordings(3);
  all[1].determined[0] = false;
  all[1].value[0] = 50.0;
  all[1].covariance.row(0).setZero();
  all[1].covariance.col(0).setZero();
  all[1].covariance(0, 0) = 1e4;
  const CombinedEstimate c = Combine(all, kAllShared);
  EXPECT_EQ(c.repeatability[0].recordings, 2);
  EXPECT_EQ(c.repeatability[1].recordings, 3);
  EXPECT_LT(std::abs(c.value[0]), 4.0);
  EXPECT_EQ(c.agreement.dof, 1 + 2 + 2 + 2);
}

// What belongs to a recording: values apart are no contradiction, and the total is that of the next
// one.
TEST(Combine, WhatIsNotSharedIsExpectedOfTheNextOne) {
  Draw draw(9);
  std::vector<RecordingEstimate> all = draw.Recordings(6);
  for (size_t r = 0; r < all.size(); ++r) all[r].value[3] += r % 2 == 0 ? 40.0 : -40.0;
  const CombinedEstimate c = Combine(all, {true, true, true, false});
  EXPECT_THAT(c.odd, testing::IsEmpty());
  EXPECT_GT(c.agreement.p_value, 1e-3);
  EXPECT_EQ(c.agreement.dof, 3 * 5);
  EXPECT_NEAR(std::sqrt(c.total()(3, 3)), 40.0 * std::sqrt(6.0 / 5.0) * std::sqrt(7.0 / 6.0), 3.0);
}

// Ten recordings of a gyro that is 1 % wrong are 1 % wrong together.
TEST(Combine, SystematicErrorsDoNotAverageOut) {
  Draw draw(10);
  std::vector<RecordingEstimate> all = draw.Recordings(10);
  for (RecordingEstimate& e : all) {
    const Eigen::Vector4d shift(6.0, 2.0, 0.0, -1.0);
    e.systematic = shift * shift.transpose();
  }
  const CombinedEstimate c = Combine(all, kAllShared);
  EXPECT_NEAR(std::sqrt(c.systematic(0, 0)), 6.0, 0.3);
  EXPECT_NEAR(std::sqrt(c.systematic(1, 1)), 2.0, 0.3);
  EXPECT_GT(SpectrumOfSymmetric(c.total()).values[0], 0.0);
}

}  // namespace
}  // namespace camgyro
