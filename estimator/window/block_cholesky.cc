#include "estimator/window/block_cholesky.h"

#include <Eigen/Cholesky>
#include <iterator>
#include <utility>

namespace camgyro {

BlockCholesky::BlockCholesky(std::vector<int> sizes)
    : sizes_(std::move(sizes)), columns_(sizes_.size()) {
  int offset = 0;
  for (size_t k = 0; k < sizes_.size(); ++k) {
    offsets_.push_back(offset);
    offset += sizes_[k];
    columns_[k][static_cast<int>(k)] = Eigen::MatrixXd::Zero(sizes_[k], sizes_[k]);
  }
  offsets_.push_back(offset);
}

void BlockCholesky::AddSquare(const std::vector<int>& blocks, const Eigen::MatrixXd& J) {
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(J.cols(), J.cols());
  square.selfadjointView<Eigen::Lower>().rankUpdate(J.transpose());
  square.triangularView<Eigen::StrictlyUpper>() = square.transpose();
  Eigen::Index left = 0;
  for (const int j : blocks) {
    const int width = sizes_[static_cast<size_t>(j)];
    Eigen::Index top = 0;
    for (const int i : blocks) {
      const int height = sizes_[static_cast<size_t>(i)];
      if (i >= j) {
        Eigen::MatrixXd& block = columns_[static_cast<size_t>(j)][i];
        if (block.size() == 0) block.setZero(height, width);
        block += square.block(top, left, height, width);
      }
      top += height;
    }
    left += width;
  }
}

Eigen::VectorXd BlockCholesky::Diagonal() const {
  Eigen::VectorXd diagonal(offsets_.back());
  for (size_t k = 0; k < sizes_.size(); ++k) {
    diagonal.segment(offsets_[k], sizes_[k]) = columns_[k].begin()->second.diagonal();
  }
  return diagonal;
}

void BlockCholesky::AddToDiagonal(const Eigen::VectorXd& values) {
  for (size_t k = 0; k < sizes_.size(); ++k) {
    columns_[k].begin()->second.diagonal() += values.segment(offsets_[k], sizes_[k]);
  }
}

bool BlockCholesky::Factorize() {
  for (auto& column : columns_) {
    const auto diagonal = column.begin();
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(diagonal->second);
    if (llt.info() != Eigen::Success) return false;
    for (auto i = std::next(diagonal); i != column.end(); ++i) {
      llt.matrixU().solveInPlace<Eigen::OnTheRight>(i->second);
      for (auto j = std::next(diagonal); j != std::next(i); ++j) {
        Eigen::MatrixXd& block = columns_[static_cast<size_t>(j->first)][i->first];
        if (block.size() == 0) block.setZero(i->second.rows(), j->second.rows());
        block.noalias() -= i->second * j->second.transpose();
      }
    }
  }
  return true;
}

Eigen::MatrixXd BlockCholesky::Solve(Eigen::MatrixXd X) const {
  const auto rows = [&](int k) {
    return X.middleRows(offsets_[static_cast<size_t>(k)], sizes_[static_cast<size_t>(k)]);
  };
  for (const auto& column : columns_) {
    const auto& [k, diagonal] = *column.begin();
    auto x = rows(k);
    diagonal.triangularView<Eigen::Lower>().solveInPlace(x);
    for (auto i = std::next(column.begin()); i != column.end(); ++i) {
      rows(i->first).noalias() -= i->second * x;
    }
  }
  for (auto column = columns_.rbegin(); column != columns_.rend(); ++column) {
    const auto& [k, diagonal] = *column->begin();
    auto x = rows(k);
    for (auto i = std::next(column->begin()); i != column->end(); ++i) {
      x.noalias() -= i->second.transpose() * rows(i->first);
    }
    diagonal.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
  }
  return X;
}

}  // namespace camgyro
