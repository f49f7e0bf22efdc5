#include "estimator/odometry/reduced_information.h"

#include <ceres/cost_function.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linear_algebra.h"

namespace camgyro {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Of the largest eigenvalue, in units of each coordinate's own. A landmark without parallax has a
// direction that nothing determines; rounding makes 1e-16 of it, divided by this.
constexpr double kLeastInformation = 1e-12;
constexpr double kLeastInformationOfOne = 1e-8;

// Eigenvectors of the information in units of each coordinate's own, those that carry some.
struct Spectrum {
  VectorXd unit;        // 1 / sqrt(diagonal)
  MatrixXd directions;  // columns
  VectorXd values;
};
Spectrum SpectrumOf(const MatrixXd& H, double least_information = kLeastInformation) {
  Spectrum spectrum;
  spectrum.unit = H.diagonal().unaryExpr(
      [](double value) { return value > 0.0 ? 1.0 / std::sqrt(value) : 0.0; });
  const SymmetricSpectrum eigen =
      SpectrumOfSymmetric(spectrum.unit.asDiagonal() * H * spectrum.unit.asDiagonal());
  const VectorXd& all = eigen.values;
  const double least = least_information * std::max(0.0, all[all.size() - 1]);
  Eigen::Index first = 0;
  while (first < all.size() && !(all[first] > least)) ++first;
  spectrum.values = all.tail(all.size() - first);
  spectrum.directions = eigen.vectors.rightCols(all.size() - first);
  return spectrum;
}

}  // namespace

// A residual block: its Jacobian's parts, and where they go.
struct ReducedInformation::Linearised {
  VectorXd residual;
  std::vector<const double*> blocks;  // of the parts
  std::vector<RowMajor> parts;
};

void ReducedInformation::AddBlock(const double* block, int tangent_size) {
  CHECK(columns_.emplace(block, std::make_pair(size_, tangent_size)).second);
  size_ += tangent_size;
}

void ReducedInformation::Grow() {
  if (sum_.H.rows() == size_) return;
  const Eigen::Index before = sum_.H.rows();
  sum_.H.conservativeResize(size_, size_);
  sum_.H.rightCols(size_ - before).setZero();
  sum_.H.bottomRows(size_ - before).setZero();
  sum_.g.conservativeResize(size_);
  sum_.g.tail(size_ - before).setZero();
}

bool ReducedInformation::Linearise(const ceres::Problem& problem, ceres::ResidualBlockId id,
                                   Linearised* linearised) const {
  std::vector<double*> blocks;
  problem.GetParameterBlocksForResidualBlock(id, &blocks);
  const int rows = problem.GetCostFunctionForResidualBlock(id)->num_residuals();
  linearised->residual.resize(rows);
  linearised->blocks.assign(blocks.begin(), blocks.end());
  linearised->parts.clear();
  std::vector<double*> pointers;
  for (double* block : blocks) {
    linearised->parts.emplace_back(rows, problem.ParameterBlockTangentSize(block));
  }
  for (size_t i = 0; i < blocks.size(); ++i) {
    pointers.push_back(problem.IsParameterBlockConstant(blocks[i]) ? nullptr
                                                                   : linearised->parts[i].data());
  }
  return problem.EvaluateResidualBlock(id, /*apply_loss_function=*/true, nullptr,
                                       linearised->residual.data(), pointers.data()) &&
         linearised->residual.allFinite();
}

bool ReducedInformation::Add(const ceres::Problem& problem, ceres::ResidualBlockId id) {
  Grow();
  Linearised l;
  if (!Linearise(problem, id, &l)) return false;
  // The parts side by side, so that a prior of a hundred blocks is one product and not thousands.
  std::vector<std::pair<int, int>> columns;  // of sum_
  int size = 0;
  for (const double* block : l.blocks) {
    const auto known = columns_.find(block);
    columns.push_back(known == columns_.end() ? std::make_pair(0, 0) : known->second);
    size += columns.back().second;
  }
  MatrixXd J(l.residual.size(), size);
  Eigen::Index at = 0;
  for (size_t a = 0; a < columns.size(); ++a) {
    if (columns[a].second > 0) J.middleCols(at, columns[a].second) = l.parts[a];
    at += columns[a].second;
  }
  MatrixXd JtJ = MatrixXd::Zero(size, size);
  JtJ.selfadjointView<Eigen::Lower>().rankUpdate(J.transpose());
  JtJ.triangularView<Eigen::StrictlyUpper>() = JtJ.transpose();
  const VectorXd Jtr = J.transpose() * l.residual;
  Eigen::Index row = 0;
  for (const auto& [first_a, size_a] : columns) {
    sum_.g.segment(first_a, size_a) += Jtr.segment(row, size_a);
    Eigen::Index column = 0;
    for (const auto& [first_b, size_b] : columns) {
      sum_.H.block(first_a, first_b, size_a, size_b) += JtJ.block(row, column, size_a, size_b);
      column += size_b;
    }
    row += size_a;
  }
  return true;
}

bool ReducedInformation::AddWithout(const ceres::Problem& problem,
                                    const std::vector<ceres::ResidualBlockId>& ids,
                                    const double* eliminated, int tangent_size) {
  Grow();
  std::vector<Linearised> all(ids.size());
  for (size_t i = 0; i < ids.size(); ++i) {
    if (!Linearise(problem, ids[i], &all[i])) return false;
  }
  MatrixXd own = MatrixXd::Zero(tangent_size, tangent_size);
  VectorXd own_g = VectorXd::Zero(tangent_size);
  // Coupling of the eliminated block with each of the others; few of them.
  std::vector<std::pair<std::pair<int, int>, MatrixXd>> coupling;
  for (size_t i = 0; i < ids.size(); ++i) {
    const Linearised& l = all[i];
    const auto at = std::find(l.blocks.begin(), l.blocks.end(), eliminated) - l.blocks.begin();
    CHECK_LT(static_cast<size_t>(at), l.blocks.size());
    const RowMajor& J = l.parts[static_cast<size_t>(at)];
    own += J.transpose() * J;
    own_g += J.transpose() * l.residual;
    for (size_t b = 0; b < l.blocks.size(); ++b) {
      const auto column = columns_.find(l.blocks[b]);
      if (column == columns_.end()) continue;
      auto known = std::find_if(coupling.begin(), coupling.end(),
                                [&](const auto& c) { return c.first == column->second; });
      if (known == coupling.end()) {
        coupling.emplace_back(column->second, MatrixXd::Zero(tangent_size, column->second.second));
        known = coupling.end() - 1;
      }
      known->second += J.transpose() * l.parts[b];
    }
    if (!Add(problem, ids[i])) return false;
  }
  // H -= C' inverse(own) C, by the root of the inverse.
  const Spectrum spectrum = SpectrumOf(own, kLeastInformationOfOne);
  const MatrixXd root = spectrum.values.cwiseSqrt().cwiseInverse().asDiagonal() *
                        spectrum.directions.transpose() * spectrum.unit.asDiagonal();
  const VectorXd rooted_g = root * own_g;
  for (auto& [column, part] : coupling) part = root * part;
  for (const auto& [row, part] : coupling) {
    sum_.g.segment(row.first, row.second) -= part.transpose() * rooted_g;
    for (const auto& [column, other] : coupling) {
      sum_.H.block(row.first, column.first, row.second, column.second) -= part.transpose() * other;
    }
  }
  return true;
}

Quadratic ReducedInformation::Without(int leading) const {
  if (leading == 0) return sum_;
  const Eigen::Index staying = size_ - leading;
  const Spectrum spectrum = SpectrumOf(sum_.H.topLeftCorner(leading, leading));
  const MatrixXd root = spectrum.values.cwiseSqrt().cwiseInverse().asDiagonal() *
                        spectrum.directions.transpose() * spectrum.unit.asDiagonal();
  const MatrixXd coupling = root * sum_.H.topRightCorner(leading, staying);
  Quadratic rest;
  rest.H = sum_.H.bottomRightCorner(staying, staying) - coupling.transpose() * coupling;
  rest.g = sum_.g.tail(staying) - coupling.transpose() * (root * sum_.g.head(leading));
  return rest;
}

SquareRoot RootOf(const Quadratic& quadratic) {
  const Spectrum spectrum = SpectrumOf(quadratic.H);
  const VectorXd root = spectrum.values.cwiseSqrt();
  // H = U^-1 V L V' U^-1 with U the units: S = sqrt(L) V' U^-1.
  const VectorXd inverse_unit =
      spectrum.unit.unaryExpr([](double value) { return value > 0.0 ? 1.0 / value : 0.0; });
  SquareRoot result;
  result.S = root.asDiagonal() * spectrum.directions.transpose() * inverse_unit.asDiagonal();
  result.r = root.cwiseInverse().asDiagonal() * spectrum.directions.transpose() *
             spectrum.unit.asDiagonal() * quadratic.g;
  return result;
}

}  // namespace camgyro
