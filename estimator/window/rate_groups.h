// The gyro's side of a PairGraph: samples, the rates behind them in groups that pairs share, and
// the bias as it walks.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_RATE_GROUPS_H_
#define CAMGYRO_ESTIMATOR_WINDOW_RATE_GROUPS_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "core/calibration.h"
#include "core/effects/catalogue.h"
#include "estimator/window/factor_graph.h"
#include "estimator/window/pair_graph_options.h"
#include "estimator/window/timed_pair.h"

namespace camgyro {

enum class AddPairResult {
  kAdded,
  kGyroTooLate,    // the samples do not reach to the end of the pair yet
  kGyroTooEarly,   // samples at the start of the pair are missing or were dropped
  kGyroGap,        // a hole in the gyro samples inside the pair, or a saturated sample
  kTooFewMatches,  // fewer than PairGraph::kMinMatches with a residual
};

// What groups neglect when effects change after they were made, from values to others: how the
// rates of one value's samples change against their mean. The largest turn by that within a value,
// in pixels. rates: in time order.
double NeglectedPx(const std::vector<TimedRate>& rates, const PairGraphOptions& options,
                   double focal_px, const EffectSet& effects, const Eigen::VectorXd& from,
                   const Eigen::VectorXd& to);

// What a fit has found of the gyro's rates.
struct RatesFound {
  // By how much rates are above the readings less bias and effects, in the mean over some samples:
  // the gyro's noise.
  struct Correction {
    double first_s = 0.0, last_s = 0.0;  // the samples' times, as of TimedRate
    Eigen::Vector3d value_rad_s = Eigen::Vector3d::Zero();
  };
  std::vector<Correction> corrections;              // in time order
  std::map<int64_t, Eigen::Vector3d> biases_rad_s;  // by the number of the interval
};

class RateGroups {
 public:
  struct Group {
    int64_t first_sample = 0;  // absolute sample number
    int count = 0;
    int step = 1;  // samples of a value
    int64_t bias_index = 0;
    FactorGraph::FactorKey factor = 0;
    Eigen::Matrix3Xd base;  // see PairMeasurement::rate_base; empty with a step of 1
  };
  // The rates that a pair needs: groups that are there, and what is lacking, ready to be added.
  struct Cover {
    std::vector<int64_t> groups;  // ids, in time order; that which is lacking is the last
    std::vector<double> times_s;
    std::vector<int> sizes;  // of the groups, in samples
    int step = 1;            // samples of a value
    Eigen::Matrix3Xd base;   // of all groups; empty with a step of 1

    bool lacks_group = false;
    Group group;
    Eigen::VectorXd values;  // of its block
    std::shared_ptr<const ceres::CostFunction> reading;
    bool reading_has_effects = false;
  };

  // prior: of it, mean and sigma of the bias. start_bias: value of the first block. effects: null
  // without parameters.
  // start: of another fit, where rates and biases begin; read while groups are added. Null, and
  // where it has none: as the gyro reads.
  RateGroups(const PairGraphOptions& options, const Prior& prior, const Eigen::Vector3d& start_bias,
             std::shared_ptr<const EffectSet> effects, const RatesFound* start = nullptr);

  // In time order (CHECKed).
  void Add(const TimedRate& rate);
  // Drops the samples before a time that no group needs.
  void Forget(double before_s);

  // Samples of one value of the rates of pixels.
  int Step(double focal_px) const;
  // What covers [from_s, to_s] on the gyro clock. Changes nothing.
  AddPairResult Plan(double from_s, double to_s, int step, const FactorGraph& graph,
                     Cover* cover) const;
  // Adds what the plan lacks. Nothing may have been added since it was made.
  void AddTo(const Cover& cover, FactorGraph* graph);

  // The oldest groups that nobody needs any more; the last one stays: the next pair will start
  // inside it.
  std::vector<int64_t> Unneeded(const std::set<int64_t>& needed) const;
  // The bias blocks of a graph that no group depends on without these, the oldest.
  std::vector<BlockId> BiasesOnlyOf(const std::vector<int64_t>& oldest,
                                    const FactorGraph& graph) const;
  // Forgets groups; their blocks are the caller's.
  void Drop(const std::vector<int64_t>& ids);

  const std::map<int64_t, Group>& groups() const { return groups_; }
  RatesFound Found(const FactorGraph& graph) const;
  double StartOf(const Group& group) const { return sample(group.first_sample).time_s; }
  const Eigen::Vector3d& start_bias() const { return start_bias_; }

 private:
  const TimedRate& sample(int64_t number) const {
    return samples_[static_cast<size_t>(number - first_sample_)];
  }
  // The sample as the rotation chain wants it.
  Eigen::Vector3d ChainRateOf(int64_t number) const;
  // First and last sample that an interval needs.
  AddPairResult FindSamples(double from_s, double to_s, int64_t* first, int64_t* last) const;
  // That which some samples begin with, in the mean.
  Eigen::Vector3d StartingCorrection(int64_t first, int count) const;
  void PlanGroup(int64_t first, int64_t last, const FactorGraph& graph, Cover* cover) const;
  // The bias block before an index, kLens if there is none.
  static BlockId BiasBefore(int64_t index, const FactorGraph& graph);
  Eigen::Vector3d BiasAt(int64_t index, const FactorGraph& graph) const;
  void AddBias(int64_t index, FactorGraph* graph) const;

  const PairGraphOptions options_;
  const Eigen::Vector3d prior_bias_, prior_bias_sigma_, start_bias_;
  const std::shared_ptr<const EffectSet> effects_;
  const RatesFound* const start_;
  std::deque<TimedRate> samples_;
  int64_t first_sample_ = 0;  // absolute number of samples_.front()
  double median_interval_s_ = 0.0;
  std::map<int64_t, Group> groups_;  // by id, in time order
  int64_t next_group_ = 0;
};

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_RATE_GROUPS_H_
