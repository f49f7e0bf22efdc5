#include "estimator/start/stabiliser_fit.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "core/linear_algebra.h"
#include "core/robust_statistics.h"
#include "core/so3.h"
#include "estimator/start/lag_search.h"

namespace camgyro {
namespace {

constexpr int kN = StabiliserFit::kSize;
using Parameters = Eigen::Matrix<double, kN, 1>;
enum {
  kLag = StabiliserFit::kLag,
  kRotation = StabiliserFit::kRotation,
  kBias = StabiliserFit::kBias
};
enum { kLogScale = StabiliserFit::kLogScale, kGain, kLogCorner, kLogTravel };

// Standard deviations of weak priors around where a fit begins, in the parameters' order: a lag of
// 50 ms, angles, rates and the rest of any size. They hold what no motion shows.
Parameters PriorSigma() {
  return (Parameters() << 0.05, 0.5, 0.5, 0.5, 0.05, 0.05, 0.05, 0.5, 1.0, 1.0, 1.0).finished();
}

constexpr double kOfLobe = 2.4;        // Cauchy, of the scale: 95 % efficient on normal residuals
constexpr double kMedianOf3 = 1.538;   // median norm of 3 normal variables of sigma 1
constexpr double kUnreached_rad = 30;  // of travel: a stop that no lens reaches
constexpr int kWeighings = 5;
constexpr int kTimeBlocks = 20;  // of the sandwich
// The gyro's samples before a pair that are used: the lens forgets its past within 1 s (0.15 Hz).
constexpr double kLead_s = 4.0, kAfter_s = 0.2;

// The gyro's samples around the pairs: an hour has 200 of them, and all samples would take half a
// minute.
RateAlignment AroundPairs(const RateAlignment& all, double lag_s) {
  const CameraRates& camera = all.camera();
  const GyroRates& gyro = all.gyro();
  std::vector<char> keep(gyro.times_s.size(), 0);
  for (int i = 0; i < camera.size(); ++i) {
    const double from_s = camera.frame_times_s[camera.frame_a[i]] + lag_s - kLead_s;
    const double to_s = camera.frame_times_s[camera.frame_b[i]] + lag_s + kAfter_s;
    const auto begin = std::lower_bound(gyro.times_s.begin(), gyro.times_s.end(), from_s);
    const auto end = std::upper_bound(begin, gyro.times_s.end(), to_s);
    std::fill(keep.begin() + (begin - gyro.times_s.begin()),
              keep.begin() + (end - gyro.times_s.begin()), 1);
  }
  GyroRates near = gyro;
  near.times_s.clear();
  Eigen::Index kept = 0;
  for (size_t k = 0; k < keep.size(); ++k) {
    if (keep[k] == 0) continue;
    near.times_s.push_back(gyro.times_s[k]);
    near.omega_gyro_rad_s.col(kept++) = gyro.omega_gyro_rad_s.col(static_cast<Eigen::Index>(k));
  }
  near.omega_gyro_rad_s.conservativeResize(3, kept);
  return RateAlignment(std::move(near), camera);
}

// The rates of pairs about the camera's axes as the gyro has them, and those of the lens.
struct PairRates {
  Eigen::Matrix3Xd omega_rad_s;
  Eigen::Matrix2Xd lens_rad_s;
  std::vector<char> covered;
};

class LensModel {
 public:
  LensModel(const RateAlignment& alignment, const Eigen::Quaterniond& q_gyro_cam)
      : alignment_(alignment), q_gyro_cam_(q_gyro_cam) {}

  const CameraRates& camera() const { return alignment_.camera(); }
  Eigen::Quaterniond RotationAt(const Parameters& x) const {
    return q_gyro_cam_ * Exp<double>(Eigen::Vector3d(x.segment<3>(kRotation)));
  }

  PairRates RatesAt(const Parameters& x) const {
    const GyroRates& gyro = alignment_.gyro();
    const Eigen::Matrix3d R_cam_gyro = RotationAt(x).toRotationMatrix().transpose();
    const Eigen::Vector3d bias = x.segment<3>(kBias);
    PairRates rates;
    alignment_.MeanGyroRates(x[kLag], &rates.omega_rad_s, &rates.covered);
    rates.omega_rad_s = (R_cam_gyro * (rates.omega_rad_s.colwise() - bias)).eval();
    const Eigen::Matrix2Xd angle =
        StabilisedAngle(gyro.times_s, R_cam_gyro * (gyro.omega_gyro_rad_s.colwise() - bias),
                        {std::exp(x[kLogCorner]), std::exp(x[kLogTravel])});
    const auto angle_at = [&](int frame) -> Eigen::Vector2d {
      const double time_s = camera().frame_times_s[static_cast<size_t>(frame)] + x[kLag];
      const auto next = std::upper_bound(gyro.times_s.begin(), gyro.times_s.end(), time_s);
      if (next == gyro.times_s.begin()) return angle.col(0);
      if (next == gyro.times_s.end()) return angle.rightCols<1>();
      const Eigen::Index i = next - gyro.times_s.begin();
      const double u = (time_s - *(next - 1)) / (*next - *(next - 1));
      return (1.0 - u) * angle.col(i - 1) + u * angle.col(i);
    };
    rates.lens_rad_s.resize(2, camera().size());
    for (int i = 0; i < camera().size(); ++i) {
      rates.lens_rad_s.col(i) =
          (angle_at(camera().frame_b[i]) - angle_at(camera().frame_a[i])) / camera().interval_s(i);
    }
    return rates;
  }

  // 3 x pairs [rad/s], zero outside of the gyro's time.
  Eigen::Matrix3Xd Residuals(const PairRates& rates, const Parameters& x) const {
    Eigen::Matrix3Xd residuals = camera().omega_cam_rad_s - rates.omega_rad_s;
    residuals.topRows<2>() =
        camera().omega_cam_rad_s.topRows<2>() -
        std::exp(x[kLogScale]) * (rates.omega_rad_s.topRows<2>() - x[kGain] * rates.lens_rad_s);
    for (int i = 0; i < camera().size(); ++i) {
      if (rates.covered[static_cast<size_t>(i)] == 0) residuals.col(i).setZero();
    }
    return residuals;
  }
  Eigen::Matrix3Xd Residuals(const Parameters& x) const { return Residuals(RatesAt(x), x); }

  // Weights of the pairs with those of a Cauchy loss; returns the scale, sigma * sqrt(weight).
  double Weigh(const Eigen::Matrix3Xd& residuals, Eigen::VectorXd* weight) const {
    const Eigen::VectorXd& own = camera().weight;
    const Eigen::ArrayXd norms =
        residuals.colwise().norm().transpose().array() * own.array().sqrt();
    std::vector<double> known;
    for (const double norm : norms) {
      if (norm > 0.0) known.push_back(norm);
    }
    const double scale = std::max(1e-9, MedianOr(known, 0.0) / kMedianOf3);
    *weight = own.array() / (1.0 + (norms / (kOfLobe * scale)).square());
    return scale;
  }

 private:
  const RateAlignment& alignment_;
  const Eigen::Quaterniond q_gyro_cam_;
};

// For Ceres: residuals of all pairs, three each, and those of the weak priors.
struct WeighedResiduals {
  const LensModel* model;
  const Eigen::VectorXd* sqrt_weight;
  const Parameters* begin;
  bool operator()(double const* const* parameters, double* out) const {
    const Parameters x = Eigen::Map<const Parameters>(parameters[0]);
    const auto pairs = static_cast<Eigen::Index>(model->camera().size());
    Eigen::Map<Eigen::Matrix3Xd>(out, 3, pairs) = model->Residuals(x) * sqrt_weight->asDiagonal();
    Eigen::Map<Parameters>(out + 3 * pairs) = (x - *begin).cwiseQuotient(PriorSigma());
    return true;
  }
};

struct LensFit {
  Parameters x;
  double scale = 0.0;
  Eigen::VectorXd weight;
  bool usable = false;
  StabiliserFit::Covariance covariance = StabiliserFit::Covariance::Zero();
};

// The larger, parameter by parameter, of the classical covariance and the sandwich over blocks of
// time, in which residuals may be correlated.
StabiliserFit::Covariance CovarianceOf(const Eigen::MatrixXd& J, const Eigen::VectorXd& residuals) {
  using Matrix = StabiliserFit::Covariance;
  const Matrix inverse = SymmetricSolver(J.transpose() * J).Inverse();
  const Eigen::Index pairs = (J.rows() - kN) / 3;
  Matrix meat = Matrix::Zero();
  for (Eigen::Index block = 0; block < kTimeBlocks; ++block) {
    const Eigen::Index begin = 3 * (block * pairs / kTimeBlocks);
    const Eigen::Index rows = 3 * ((block + 1) * pairs / kTimeBlocks) - begin;
    const Parameters score = J.middleRows(begin, rows).transpose() * residuals.segment(begin, rows);
    meat += score * score.transpose();
  }
  const Matrix sandwich = inverse * meat * inverse;
  const Parameters stretch =
      (sandwich.diagonal().array() / inverse.diagonal().array()).max(1.0).sqrt();
  return stretch.asDiagonal() * inverse * stretch.asDiagonal();
}

// Robust least squares from a point; held: with the lens held.
LensFit FitLens(const LensModel& model, const Parameters& begin, bool held) {
  LensFit fit;
  fit.x = begin;
  Eigen::VectorXd sqrt_weight;
  using Cost = ceres::DynamicNumericDiffCostFunction<WeighedResiduals, ceres::CENTRAL>;
  ceres::NumericDiffOptions steps;
  steps.relative_step_size = 1e-5;
  auto* cost =
      new Cost(new WeighedResiduals{&model, &sqrt_weight, &begin}, ceres::TAKE_OWNERSHIP, steps);
  cost->AddParameterBlock(kN);
  cost->SetNumResiduals(3 * model.camera().size() + kN);
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, fit.x.data());
  if (held) {
    problem.SetManifold(fit.x.data(),
                        new ceres::SubsetManifold(kN, {kGain, kLogCorner, kLogTravel}));
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 8;
  options.logging_type = ceres::SILENT;
  for (int i = 0; i < kWeighings; ++i) {
    fit.scale = model.Weigh(model.Residuals(fit.x), &fit.weight);
    sqrt_weight = fit.weight.cwiseSqrt() / fit.scale;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    fit.usable = summary.IsSolutionUsable() && fit.x.allFinite();
    if (!fit.usable) return fit;
  }
  fit.scale = model.Weigh(model.Residuals(fit.x), &fit.weight);
  if (held) return fit;
  Eigen::VectorXd residuals(cost->num_residuals());
  Eigen::Matrix<double, Eigen::Dynamic, kN, Eigen::RowMajor> J(cost->num_residuals(), kN);
  const double* blocks[] = {fit.x.data()};
  double* jacobians[] = {J.data()};
  fit.usable = cost->Evaluate(blocks, residuals.data(), jacobians);
  if (fit.usable) fit.covariance = CovarianceOf(J, residuals);
  return fit;
}

// At one point of a grid: scale and gain by robust least squares, and what they leave.
double FitScaleAndGain(const LensModel& model, Parameters* x) {
  const PairRates rates = model.RatesAt(*x);
  const auto camera = model.camera().omega_cam_rad_s.topRows<2>();
  constexpr double kLeastScale = 0.2, kLargestScale = 5.0;
  constexpr int kRoundsOfGrid = 4;
  (*x)[kLogScale] = (*x)[kGain] = 0.0;
  Eigen::VectorXd weight;
  double scale = 0.0;
  for (int round = 0; round < kRoundsOfGrid; ++round) {
    scale = model.Weigh(model.Residuals(rates, *x), &weight);
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();  // camera = scale omega - scale gain lens
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (int i = 0; i < model.camera().size(); ++i) {
      if (rates.covered[static_cast<size_t>(i)] == 0) continue;
      Eigen::Matrix2d columns;
      columns << rates.omega_rad_s.col(i).head<2>(), -rates.lens_rad_s.col(i);
      normal += weight[i] * columns.transpose() * columns;
      right += weight[i] * columns.transpose() * camera.col(i);
    }
    const Eigen::Vector2d found = normal.ldlt().solve(right);
    if (!(found[0] > kLeastScale && found[0] < kLargestScale)) break;
    (*x)[kLogScale] = std::log(found[0]);
    (*x)[kGain] = found[1] / found[0];
  }
  return scale;
}

// Where a fit begins: the best point of a grid of lags, corners and stops. A start that takes the
// lens for held was 18 ms early with the Pixel's log (docs/lab/device_logs.md), and up to 34 ms
// with simulated stabilisers (prints without a commit).
Parameters BestOfGrid(const LensModel& model, const Parameters& near) {
  constexpr int kLagsEachSide = 12;
  constexpr double kLagStep_s = 0.005;
  Parameters best = near;
  double best_scale = std::numeric_limits<double>::infinity();
  for (int lag = -kLagsEachSide; lag <= kLagsEachSide; ++lag) {
    for (const double corner_hz : {0.15, 0.5, 1.0, 2.0}) {
      for (const double travel_rad : {0.015, 0.025, 0.04, kUnreached_rad}) {
        Parameters x = near;
        x[kLag] += kLagStep_s * lag;
        x[kLogCorner] = std::log(corner_hz);
        x[kLogTravel] = std::log(travel_rad);
        const double scale = FitScaleAndGain(model, &x);
        if (scale < best_scale) {
          best_scale = scale;
          best = x;
        }
      }
    }
  }
  return best;
}

// Of the gyro's power about its mean, the part that the fit explains.
double ExplainedBy(const LensModel& model, const LensFit& fit) {
  const PairRates rates = model.RatesAt(fit.x);
  const Eigen::Matrix3Xd residuals = model.Residuals(rates, fit.x);
  Eigen::VectorXd weight = fit.weight;
  for (Eigen::Index i = 0; i < weight.size(); ++i) {
    if (rates.covered[static_cast<size_t>(i)] == 0) weight[i] = 0.0;
  }
  const Eigen::Vector3d mean = rates.omega_rad_s * weight / weight.sum();
  const double power =
      (rates.omega_rad_s.colwise() - mean).colwise().squaredNorm().dot(weight.transpose());
  return 1.0 - residuals.colwise().squaredNorm().dot(weight.transpose()) / power;
}

}  // namespace

StabiliserFit FitStabiliser(const RateAlignment& alignment, double lag_s,
                            const Eigen::Quaterniond& q_gyro_cam,
                            const Eigen::Vector3d& bias_gyro_rad_s) {
  const RateAlignment around = AroundPairs(alignment, lag_s);
  const LensModel model(around, q_gyro_cam);
  Parameters near = Parameters::Zero();
  near[kLag] = lag_s;
  near.segment<3>(kBias) = bias_gyro_rad_s;
  near[kLogCorner] = std::log(0.5);
  near[kLogTravel] = std::log(kUnreached_rad);
  const LensFit held = FitLens(model, near, /*held=*/true);
  const LensFit fit = FitLens(model, BestOfGrid(model, near), /*held=*/false);

  StabiliserFit result;
  result.converged = held.usable && fit.usable;
  result.stabiliser.corner_hz = std::exp(fit.x[kLogCorner]);
  const double travel_rad = std::exp(fit.x[kLogTravel]);
  if (travel_rad < 1.0) result.stabiliser.travel_rad = travel_rad;
  result.gain = fit.x[kGain];
  result.scale = std::exp(fit.x[kLogScale]);
  result.lag_s = fit.x[kLag];
  result.q_gyro_cam = model.RotationAt(fit.x);
  result.bias_gyro_rad_s = fit.x.segment<3>(kBias);
  result.noise_rad_s = fit.scale;
  result.held_noise_rad_s = held.scale;
  result.covariance = fit.covariance;
  if (result.converged) result.explained = ExplainedBy(model, fit);
  return result;
}

}  // namespace camgyro
