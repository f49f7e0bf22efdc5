#include "factors/symmetric_transfer.h"

#include <glog/logging.h>

#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <utility>

#include "factors/robust.h"

namespace camgyro {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Where a pixel goes under the gyro's rotation, and how a covector on it is handed on.
class Transfer {
 public:
  // Of the ray of `from` into the picture of `to`, at the orientation of `to`. False where it
  // leaves the lens.
  bool Compute(const Lens& model, const LensParameters& lens, const Bearing& from,
               const Bearing& to, bool derivatives) {
    const Vector3d ray = to.R_ref_cam.transpose() * from.ray_ref;
    const std::optional<Vector2d> found = model.Project(ray, lens);
    if (!found) return false;
    px_ = *found;
    if (!derivatives) return true;
    // The orientation of `to` seen through the ray of the transferred pixel: a bearing that stands
    // in for it in the back-propagation.
    arrived_ = to;
    if (!model.Unproject(px_, lens, &arrived_.lens_ray)) return false;
    depth_ = ray.z();
    arrived_.ray_ref = to.R_ref_cam * arrived_.lens_ray.ray;
    J_px_xy_ = arrived_.lens_ray.J_ray_px.topRows<2>().inverse();
    return true;
  }
  const Vector2d& px() const { return px_; }

  // Adds the derivative of by_px . px to the row. px solves ray_xy(px, lens) = (x/z, y/z) of the
  // transferred ray, so a covector on px becomes one on (x/z, y/z); what moves the left side (lens,
  // orientation of `to`) enters with the opposite sign.
  void Add(const Vector2d& by_px, const Bearing& from, const RotationChain& chain, double height_px,
           PairRow* row) const {
    const Vector2d by_xy = J_px_xy_.transpose() * by_px;
    const Vector2d xy = arrived_.lens_ray.ray.head<2>();
    const Vector3d by_unit_ray =
        arrived_.R_ref_cam * Vector3d(by_xy.x(), by_xy.y(), -by_xy.dot(xy));
    const Eigen::Matrix<double, 3, 2> none = Eigen::Matrix<double, 3, 2>::Zero();
    row->Add(from, chain, height_px, by_unit_ray / depth_, none);
    row->Add(arrived_, chain, height_px, -by_unit_ray, none);
  }

 private:
  Vector2d px_;
  Bearing arrived_;
  double depth_ = 1.0;  // of the transferred ray along the optical axis
  Eigen::Matrix2d J_px_xy_;
};

}  // namespace

SymmetricTransfer::SymmetricTransfer(std::shared_ptr<const PairMeasurement> pair)
    : pair_(std::move(pair)) {
  CHECK_GT(pair_->sigma, 0.0);
  CHECK_GE(pair_->rate_times_s.size(), 2u);
  CHECK(pair_->effects == nullptr);
  set_num_residuals(kResidualsPerMatch * static_cast<int>(pair_->matches.size()));
  *mutable_parameter_block_sizes() = {kLensSize, kShutterSize, 4};
  for (size_t g = 0; g < pair_->rate_group_sizes.size(); ++g) {
    mutable_parameter_block_sizes()->push_back(3 * pair_->num_rate_values(g));
  }
}

bool SymmetricTransfer::Evaluate(double const* const* parameters, double* residuals,
                                 double** jacobians) const {
  const PairMeasurement& pair = *pair_;
  const RotationChain chain = ChainOf(pair, parameters + kFirstRateGroup);
  const LensParameters lens = Eigen::Map<const LensParameters>(parameters[0]);
  PairBearings bearings;
  const bool derivatives = jacobians != nullptr;
  if (!EvaluatePairBearings(pair, chain, parameters[0], parameters[1], parameters[2], nullptr,
                            derivatives, &bearings)) {
    return false;
  }
  const double inv_sigma = 1.0 / std::sqrt(2.0 * (pair.variance_a() + pair.variance_b()));
  PairRow row(chain);
  Transfer into_a, into_b;
  for (size_t i = 0; i < pair.matches.size(); ++i) {
    const Bearing &a = bearings.a[i], &b = bearings.b[i];
    if (!into_b.Compute(*pair.lens, lens, a, b, derivatives) ||
        !into_a.Compute(*pair.lens, lens, b, a, derivatives)) {
      return false;
    }
    Eigen::Vector4d e;
    e << pair.matches[i].px_b - into_b.px(), pair.matches[i].px_a - into_a.px();
    e *= inv_sigma;
    // The loss bends the length of e; along e its slope is another one than across.
    const double length = e.norm();
    const RobustResidual robust = Robustify(length, pair.robust_threshold);
    const double across = length > 0.0 ? robust.value / length : 1.0;
    const Eigen::Vector4d unit = length > 0.0 ? Eigen::Vector4d(e / length) : e;
    const Eigen::Matrix4d bend = across * Eigen::Matrix4d::Identity() +
                                 (robust.derivative - across) * unit * unit.transpose();
    Eigen::Map<Eigen::Vector4d>(residuals + kResidualsPerMatch * i) = across * e;
    if (!derivatives) continue;
    for (int k = 0; k < kResidualsPerMatch; ++k) {
      const Eigen::RowVector4d by_e = -inv_sigma * bend.row(k);
      row.Clear();
      into_b.Add(by_e.head<2>(), a, chain, pair.size_px.y(), &row);
      into_a.Add(by_e.tail<2>(), b, chain, pair.size_px.y(), &row);
      row.Write(kResidualsPerMatch * static_cast<int>(i) + k, 1.0, parameters[2], pair,
                kFirstRateGroup, jacobians);
    }
  }
  return true;
}

std::vector<double> SymmetricTransfer::IndependentResiduals(double const* const* parameters) const {
  auto without_loss = std::make_shared<PairMeasurement>(*pair_);
  without_loss->robust_threshold = 0.0;
  const SymmetricTransfer plain(without_loss);
  std::vector<double> four(static_cast<size_t>(num_residuals()));
  if (!plain.Evaluate(parameters, four.data(), nullptr)) return {};
  std::vector<double> two;
  two.reserve(four.size() / 2);
  for (size_t i = 0; i < four.size(); i += kResidualsPerMatch) {
    const Eigen::Map<const Eigen::Vector4d> r(&four[i]);
    const double e_b = r.head<2>().norm();
    const double scale = e_b > 0.0 ? r.norm() / e_b : 1.0;
    two.push_back(scale * r[0]);
    two.push_back(scale * r[1]);
  }
  return two;
}

bool HasTransfer(const Lens& model, const LensParameters& lens, const Bearing& a,
                 const Bearing& b) {
  Transfer into_a, into_b;
  return into_b.Compute(model, lens, a, b, true) && into_a.Compute(model, lens, b, a, true);
}

}  // namespace camgyro
