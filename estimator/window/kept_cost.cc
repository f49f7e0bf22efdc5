#include "estimator/window/kept_cost.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace camgyro {

KeptCost::KeptCost(std::shared_ptr<const ceres::CostFunction> cost, KeepBounds bounds)
    : cost_(std::move(cost)), bounds_(std::move(bounds)) {
  *mutable_parameter_block_sizes() = cost_->parameter_block_sizes();
  for (const int size : parameter_block_sizes()) size_ += size;
  set_num_residuals(cost_->num_residuals());
}

bool KeptCost::Evaluate(double const* const* parameters, double* residuals,
                        double** jacobians) const {
  if (!Prepare(parameters)) return false;
  Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = residuals_ + change_;
  const double* by_block = by_blocks_.data();
  for (size_t i = 0; jacobians != nullptr && i < parameter_block_sizes().size(); ++i) {
    const double* const end = by_block + num_residuals() * parameter_block_sizes()[i];
    if (jacobians[i] != nullptr) std::copy(by_block, end, jacobians[i]);
    by_block = end;
  }
  return true;
}

bool KeptCost::Prepare(double const* const* parameters) const {
  return Holds(parameters) || Linearise(parameters);
}

bool KeptCost::Holds(double const* const* parameters) const {
  using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  if (!known_) return false;
  const std::vector<int>& sizes = parameter_block_sizes();
  Eigen::VectorXd moved(size_);
  std::vector<Eigen::Index> begins;
  Eigen::Index begin = 0;
  for (size_t i = 0; i < sizes.size(); ++i) {
    moved.segment(begin, sizes[i]) =
        Eigen::Map<const Eigen::VectorXd>(parameters[i], sizes[i]) - at_.segment(begin, sizes[i]);
    begins.push_back(begin);
    begin += sizes[i];
  }
  for (const KeepBounds::OfBlock& bound : bounds_.blocks) {
    const double distance = moved.segment(begins[bound.block], sizes[bound.block]).norm();
    if (!(distance <= bound.distance)) return false;
  }
  change_.setZero(num_residuals());
  for (size_t i = 0; i < sizes.size(); ++i) {
    const auto by_block = moved.segment(begins[i], sizes[i]);
    if (by_block.isZero(0.0)) continue;
    change_.noalias() +=
        Eigen::Map<const RowMajorMatrix>(by_blocks_.data() + begins[i] * num_residuals(),
                                         num_residuals(), sizes[i]) *
        by_block;
  }
  // Not if it is not a number.
  return change_.norm() <= bounds_.rms * std::sqrt(num_residuals());
}

bool KeptCost::Linearise(double const* const* parameters) const {
  known_ = false;
  const std::vector<int>& sizes = parameter_block_sizes();
  const Eigen::Index rows = num_residuals();
  // By blocks, as cost functions write them.
  by_blocks_.resize(static_cast<size_t>(rows * size_));
  residuals_.resize(rows);
  std::vector<double*> jacobians;
  double* next = by_blocks_.data();
  for (const int size : sizes) {
    jacobians.push_back(next);
    next += rows * size;
  }
  if (!cost_->Evaluate(parameters, residuals_.data(), jacobians.data())) return false;
  at_.resize(size_);
  Eigen::Index begin = 0;
  for (size_t i = 0; i < sizes.size(); ++i) {
    at_.segment(begin, sizes[i]) = Eigen::Map<const Eigen::VectorXd>(parameters[i], sizes[i]);
    begin += sizes[i];
  }
  change_.setZero(rows);
  known_ = true;
  ++number_;
  return true;
}

}  // namespace camgyro
