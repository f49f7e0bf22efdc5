// Normal equations of some factors of a graph by some of their blocks.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_LOCAL_EQUATIONS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_LOCAL_EQUATIONS_H_

#include <Eigen/Core>
#include <map>

#include "estimator/window/factor_graph.h"

namespace camgyro {

// The other blocks are held.
class LocalEquations {
 public:
  void AddBlock(const BlockId& id, const Block& block) {
    if (columns_.emplace(id, size_).second) size_ += block.tangent_size();
  }
  void Begin() {
    H_.setZero(size_, size_);
    g_.setZero(size_);
  }
  void Add(const FactorGraph& graph, const Factor& factor) { Add(graph, factor, *factor.cost); }
  // Where nothing of it is kept anyway: the cost function behind a KeptCost is asked for these
  // blocks alone.
  void AddAfresh(const FactorGraph& graph, const Factor& factor);
  // More information about one number of a block.
  void AddTo(const BlockId& id, double information, double score) {
    H_(columns_.at(id), columns_.at(id)) += information;
    g_[columns_.at(id)] += score;
  }
  // A step of Gauss and Newton.
  void Step(FactorGraph* graph) const;
  const Eigen::MatrixXd& H() const { return H_; }
  const Eigen::VectorXd& g() const { return g_; }

 private:
  void Add(const FactorGraph& graph, const Factor& factor, const ceres::CostFunction& cost);

  std::map<BlockId, int> columns_;
  int size_ = 0;
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_LOCAL_EQUATIONS_H_
