#include "estimator/reference/implicit_ekf.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/rotation_chain.h"
#include "core/so3.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Angle about the camera's axes of a change of the four elements [x y z w] of a unit quaternion:
// 2 vec(q^-1 dq).
Eigen::Matrix<double, 3, 4> AngleByElements(const Eigen::Quaterniond& q) {
  Eigen::Matrix<double, 3, 4> J;
  J << q.w() * Matrix3d::Identity() - Hat(q.vec()), -q.vec();
  return 2.0 * J;
}

Eigen::Quaterniond Rotation(const VectorXd& x) {
  return Eigen::Quaterniond(Eigen::Vector4d(x.segment<4>(ImplicitEkf::kQc))).normalized();
}

}  // namespace

Prior PaperStart(const Calibration& guess) {
  Prior prior{guess};
  Calibration& start = prior.mean;
  start.lens[kCx] = 0.5 * (guess.width_px - 1);
  start.lens[kCy] = 0.5 * (guess.height_px - 1);
  start.readout_s = 0.0275;  // "0.0275 ms" in print, and "82.5 % of the interval": seconds
  start.delay_s = 0.0;
  start.bias_gyro_rad_s.setZero();
  prior.sigma << 20.0, 6.67, 6.67, 0.00167, 0.01, Vector3d::Constant(0.0067),
      Vector3d::Constant(2.0 * 0.0067);
  start.covariance = prior.sigma.cwiseAbs2().asDiagonal();
  return prior;
}

ImplicitEkf::ImplicitEkf(const Prior& prior, const EkfOptions& options)
    : options_(options), start_(prior.mean), x_(kRates), random_(options.seed) {
  const Calibration& start = prior.mean;
  x_ << start.lens[kFocal], start.lens[kCx], start.lens[kCy], start.readout_s, start.delay_s,
      start.bias_gyro_rad_s, start.q_gyro_cam.coeffs();
  VectorXd sigma(kRates);
  // The paper gives all four elements of q_c the same deviation, 0.0067; an angle is twice that.
  const double sigma_element = 0.5 * prior.sigma.segment<3>(kStateRotation).norm() / std::sqrt(3.0);
  sigma << prior.sigma.head<kStateRotation>(), Eigen::Vector4d::Constant(sigma_element);
  P_ = sigma.cwiseAbs2().asDiagonal();
}

void ImplicitEkf::AddReading(double time_s, const Vector3d& omega_gyro_rad_s) {
  readings_.push_back({time_s, omega_gyro_rad_s});
}

LensParameters ImplicitEkf::LensOf(const VectorXd& x) const {
  LensParameters lens = start_.lens;
  lens[kFocal] = x[kF];
  lens.segment<2>(kCx) = x.segment<2>(kC);
  return lens;
}

// Prediction, section V.A and eq. (8). Everything but b_g is copied; b_g walks. Rates that the
// last state holds are copied with all their correlations, the others begin as
//   w_n = w_n,measured - b_g + n_g
// with this project's sign of the bias; the paper's b_g is the negative of ours.
void ImplicitEkf::Predict(int64_t first, int64_t last, double time_b_s) {
  const double walked_s = started_ ? std::max(0.0, time_b_s - last_time_s_) : 0.0;
  const double walk = options_.bias_walk_rad_s2_rtHz;
  P_.diagonal().segment<3>(kBg).array() += walk * walk * walked_s;

  const int64_t old_end = first_rate_ + num_rates();
  const auto size = static_cast<Eigen::Index>(kRates + 3 * (last - first + 1));
  MatrixXd F = MatrixXd::Zero(size, x_.size());
  VectorXd u = VectorXd::Zero(size), Q = VectorXd::Zero(size);
  F.topLeftCorner<kRates, kRates>().setIdentity();
  for (int64_t n = first; n <= last; ++n) {
    const auto row = static_cast<Eigen::Index>(kRates + 3 * (n - first));
    if (n >= first_rate_ && n < old_end) {
      const auto column = static_cast<Eigen::Index>(kRates + 3 * (n - first_rate_));
      F.block<3, 3>(row, column).setIdentity();
    } else {
      F.block<3, 3>(row, kBg) = -Matrix3d::Identity();
      u.segment<3>(row) = reading(n).omega_gyro_rad_s;
      Q.segment<3>(row).setConstant(options_.sigma_gyro_rad_s * options_.sigma_gyro_rad_s);
    }
  }
  x_ = F * x_ + u;
  P_ = F * P_ * F.transpose();
  P_.diagonal() += Q;
  first_rate_ = first;
  last_time_s_ = time_b_s;
  started_ = true;
}

// The implicit measurements (9) at a state x, with their derivatives by the state and the variance
// that the detection errors v of their six rays give them.
//
// Chosen where the paper is silent: Jacobians are analytic (core/pair_model.h). Between two
// readings the rate is linear (core/rotation_chain.h); held from each reading to the next, as
// (6) is usually read, it would lag by half an interval, and t_d would carry that as an error.
// The reference orientation is the gyro's at w_1; (4) does not depend on it. Triplets that share a
// feature are taken as independent.
bool ImplicitEkf::Measure(const Pair& pair, const VectorXd& x, Measurement* out) const {
  const int M = static_cast<int>(x.size() - kRates) / 3;
  std::vector<double> times(static_cast<size_t>(M));
  for (int n = 0; n < M; ++n) times[static_cast<size_t>(n)] = reading(first_rate_ + n).time_s;
  const RotationChain chain(times, Eigen::Map<const Eigen::Matrix3Xd>(x.data() + kRates, 3, M));
  const Eigen::Quaterniond q = Rotation(x);
  const Matrix3d R_gyro_cam = q.toRotationMatrix();
  const Lens& model = GetLens(start_.distortion_model);
  const LensParameters lens = LensOf(x);
  const ShutterParameters shutter(x[kTr], x[kTd]);

  // R_i f_i with f_i normalised, and what v_i makes of it. v moves the ray only: that a detection
  // error in v also reads another row's time is not in (9).
  struct Ray {
    Bearing bearing;
    Vector3d u;        // R f
    Matrix3d J_u_ray;  // of the normalisation
    Eigen::Matrix<double, 3, 2> J_u_px;
  };
  const auto trace_ray = [&](double time_s, const Eigen::Vector2d& px, Ray* ray) {
    Bearing& b = ray->bearing;
    if (!EvaluateBearing(model, lens, shutter, R_gyro_cam, chain, time_s, start_.height_px, px,
                         &b)) {
      return false;
    }
    const double norm = b.ray_ref.norm();
    ray->u = b.ray_ref / norm;
    ray->J_u_ray = (Matrix3d::Identity() - ray->u * ray->u.transpose()) / norm;
    ray->J_u_px = ray->J_u_ray * b.R_ref_cam * b.lens_ray.J_ray_px;
    return true;
  };
  std::vector<std::array<Ray, 2>> rays(pair.matches.size());
  for (size_t i = 0; i < rays.size(); ++i) {
    if (!trace_ray(pair.time_a_s, pair.matches[i].px_a, &rays[i][0]) ||
        !trace_ray(pair.time_b_s, pair.matches[i].px_b, &rays[i][1])) {
      return false;
    }
  }

  const auto N = static_cast<Eigen::Index>(pair.triplets.size());
  const double variance_px = options_.sigma_px * options_.sigma_px;
  out->h.resize(N);
  out->H = MatrixXd::Zero(N, x.size());
  out->variance = VectorXd::Zero(N);
  Eigen::Matrix3Xd by_rates(3, M);
  for (Eigen::Index row = 0; row < N; ++row) {
    std::array<const std::array<Ray, 2>*, 3> f;
    std::array<Vector3d, 3> n;  // R f x R' f'
    for (size_t i = 0; i < 3; ++i) {
      f[i] = &rays[pair.triplets[static_cast<size_t>(row)][i]];
      n[i] = (*f[i])[0].u.cross((*f[i])[1].u);
    }
    out->h[row] = n[0].dot(n[1].cross(n[2]));  // eq. (4)

    PairGradient gradient;
    by_rates.setZero();
    for (size_t i = 0; i < 3; ++i) {
      const Vector3d by_n = n[(i + 1) % 3].cross(n[(i + 2) % 3]);
      const Ray &a = (*f[i])[0], &b = (*f[i])[1];
      const Vector3d by_u[2] = {b.u.cross(by_n), by_n.cross(a.u)};
      for (size_t side = 0; side < 2; ++side) {
        const Ray& ray = (*f[i])[side];
        out->variance[row] += variance_px * (ray.J_u_px.transpose() * by_u[side]).squaredNorm();
        Backpropagate(ray.bearing, chain, start_.height_px, ray.J_u_ray * by_u[side],
                      Eigen::Matrix<double, 3, 2>::Zero(), &gradient, by_rates);
      }
    }
    auto H = out->H.row(row);
    H[kF] = gradient.by_lens[kFocal];
    H.segment<2>(kC) = gradient.by_lens.segment<2>(kCx);
    H[kTr] = gradient.by_shutter[kReadout];
    H[kTd] = gradient.by_shutter[kDelay];
    H.segment<4>(kQc) = gradient.by_rotation * AngleByElements(q);
    H.tail(3 * M) = Eigen::Map<Eigen::RowVectorXd>(by_rates.data(), 3 * M);
  }
  return out->h.allFinite() && out->H.allFinite();
}

// Update, section V.B: the standard EKF's with the implicit measurement's innovation 0 - h.
bool ImplicitEkf::Correct(const Pair& pair) {
  const VectorXd predicted = x_;
  VectorXd x = predicted;
  MatrixXd P = P_;
  for (int iteration = 0; iteration < options_.iterations; ++iteration) {
    Measurement z;
    if (!Measure(pair, x, &z)) return false;
    VectorXd innovation = -z.h - z.H * (predicted - x);
    VectorXd S_diagonal = (z.H * P_).cwiseProduct(z.H).rowwise().sum() + z.variance;
    if (options_.gate_sigmas > 0.0) {
      std::vector<Eigen::Index> kept;
      for (Eigen::Index i = 0; i < z.h.size(); ++i) {
        if (innovation[i] * innovation[i] <=
            options_.gate_sigmas * options_.gate_sigmas * S_diagonal[i]) {
          kept.push_back(i);
        }
      }
      if (kept.empty()) return true;
      z = {VectorXd(z.h(kept)), MatrixXd(z.H(kept, Eigen::all)), VectorXd(z.variance(kept))};
      innovation = VectorXd(innovation(kept));
      S_diagonal = VectorXd(S_diagonal(kept));
    }
    // Determinants come in sizes that differ by orders of magnitude: every measurement is divided
    // by its standard deviation, which changes nothing but the rounding errors.
    if (!(S_diagonal.minCoeff() > 0.0)) return false;
    const VectorXd scale = S_diagonal.cwiseSqrt().cwiseInverse();
    const MatrixXd H = scale.asDiagonal() * z.H;
    const MatrixXd HP = H * P_;
    MatrixXd S = HP * H.transpose();
    S.diagonal() += scale.cwiseAbs2().cwiseProduct(z.variance);
    const Eigen::LLT<MatrixXd> llt(S);
    if (llt.info() != Eigen::Success) return false;
    x = predicted + HP.transpose() * llt.solve(scale.cwiseProduct(innovation));
    if (!x.allFinite()) return false;
    x.segment<4>(kQc).normalize();
    const MatrixXd whitened = llt.matrixL().solve(HP);
    P = P_ - whitened.transpose() * whitened;
  }
  x_ = x;
  P_ = 0.5 * (P + P.transpose());
  return true;
}

ImplicitEkf::UpdateResult ImplicitEkf::Update(double time_a_s, double time_b_s,
                                              const std::vector<Match>& matches) {
  // Chosen where the paper is silent: the state holds the rates from the last reading before the
  // first exposure of frame a to the first one after the last exposure of frame b (Fig. 4), at the
  // present t_d and t_r. Consecutive states overlap by the readout and two readings.
  const double from_s = time_a_s + x_[kTd] + std::min(0.0, x_[kTr]);
  const double to_s = time_b_s + x_[kTd] + std::max(0.0, x_[kTr]);
  if (readings_.size() < 2 || readings_.back().time_s < to_s) return UpdateResult::kGyroTooLate;
  if (readings_.front().time_s > from_s) return UpdateResult::kGyroTooEarly;
  const auto by_time = [](const Reading& r, double t) { return r.time_s < t; };
  const auto begin = readings_.begin();
  auto lower = std::lower_bound(begin, readings_.end(), from_s, by_time);
  if (lower->time_s > from_s) --lower;
  const auto upper = std::lower_bound(begin, readings_.end(), to_s, by_time);

  Pair pair;
  pair.time_a_s = time_a_s;
  pair.time_b_s = time_b_s;
  RayJet ray;
  for (const Match& match : matches) {
    const Lens& model = GetLens(start_.distortion_model);
    if (model.Unproject(match.px_a, LensOf(x_), &ray, LensDerivatives::kNone) &&
        model.Unproject(match.px_b, LensOf(x_), &ray, LensDerivatives::kNone)) {
      pair.matches.push_back(match);
    }
  }
  const size_t count = pair.matches.size();
  if (count < 3) return UpdateResult::kTooFewMatches;
  while (static_cast<int>(pair.triplets.size()) < options_.triplets) {
    const std::array<size_t, 3> t = {random_() % count, random_() % count, random_() % count};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) pair.triplets.push_back(t);
  }

  Predict(first_reading_ + (lower - begin), first_reading_ + (upper - begin), time_b_s);
  const bool corrected = Correct(pair);
  // The next pair begins a frame later; a second is more than t_d may still move.
  while (readings_.size() > 2 && readings_[1].time_s < from_s - 1.0) {
    readings_.pop_front();
    ++first_reading_;
  }
  return corrected ? UpdateResult::kUpdated : UpdateResult::kNotPositive;
}

Calibration ImplicitEkf::Estimate() const {
  Calibration c = start_;
  c.lens = LensOf(x_);
  c.readout_s = x_[kTr];
  c.delay_s = x_[kTd];
  c.bias_gyro_rad_s = x_.segment<3>(kBg);
  c.q_gyro_cam = Rotation(x_);
  Eigen::Matrix<double, kStateSize, kRates> J = Eigen::Matrix<double, kStateSize, kRates>::Zero();
  J.topLeftCorner<kStateRotation, kQc>().setIdentity();
  J.block<3, 4>(kStateRotation, kQc) = AngleByElements(c.q_gyro_cam);
  c.covariance = J * P_.topLeftCorner<kRates, kRates>() * J.transpose();
  return c;
}

}  // namespace camgyro
