// What the coplanarity factors share: the matches of one pair of frames, their parameter blocks,
// and the way from a derivative by bearings to Ceres' Jacobians.
#ifndef CAMGYRO_FACTORS_PAIR_BEARINGS_H_
#define CAMGYRO_FACTORS_PAIR_BEARINGS_H_

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/pair_model.h"
#include "core/recording.h"

namespace camgyro {

// One pair of frames as its factor sees it: matches, or the rotation between two camera attitudes.
// Times in seconds from the window's origin.
struct PairMeasurement {
  std::vector<Match> matches;
  // Of attitudes (RelativeRotation): vectors of camera b into camera a, and the row that it refers
  // to, of the height.
  Eigen::Quaterniond q_a_b = Eigen::Quaterniond::Identity();
  double row_fraction = 0.0;
  FrameTime frame_a, frame_b;
  Eigen::Vector2d size_px = Eigen::Vector2d::Zero();
  // > 0, per axis of a noisy observation [px], or of the rotation between attitudes [rad].
  double sigma = 1.0;
  MatchNoise noise = MatchNoise::kBothImages;
  double robust_threshold = 0.0;  // in sigmas (of a rotation: of each axis); 0: no loss
  // Of CoplanarityPlane: how the pictures are read (Scan), over the time between the frames.
  double readout_over_gap = 0.0;
  Eigen::Vector2d scan_shares{0.0, 1.0};
  const Lens* lens = nullptr;
  // Jacobians by the other lens parameters are zero, for solves that hold them; with effects: all.
  LensDerivatives by_lens = LensDerivatives::kAll;
  std::shared_ptr<const EffectSet> effects;  // null: none; else never without parameters
  // The matches' pixels where lens, shutter and effects are held (HoldRays), so that only the
  // camera's motion is evaluated; empty: all is.
  std::vector<TimedRay> rays_a, rays_b;
  // Each frame has a time of its own, a parameter: an offset from its stamp (CoplanarityPlane,
  // RelativeRotation).
  bool own_times = false;

  // Rates that the pair needs: their times, strictly increasing, split into consecutive groups of
  // these sizes (in samples), each with a parameter block. A parameter is the rate of a sample, or
  // with a step > 1 a correction of the rates rate_base of that many samples of the group in a row:
  // noise that is white over some 25 ms turns nothing that a pixel could see.
  std::vector<double> rate_times_s;
  std::vector<int> rate_group_sizes;
  int rate_step = 1;
  Eigen::Matrix3Xd rate_base;  // 3 x samples; empty: zero

  int num_rate_values(size_t group) const {
    return (rate_group_sizes[group] + rate_step - 1) / rate_step;
  }
  // Which value each sample's rate follows, counted over all groups.
  std::vector<int> RateValues() const;

  double variance_a() const { return noise == MatchNoise::kBothImages ? sigma * sigma : 0.0; }
  double variance_b() const { return sigma * sigma; }
};

// Order of the parameter blocks of the coplanarity factors:
//   lens kLensSize, shutter kShutterSize, q_gyro_cam 4 (RotationManifold),
//   [tau 3 (SphereManifold<3>), bend 6,] [effects, if the pair has any,]
//   [offsets of frame a and b from their stamps, 1 each, if they have times of their own,]
//   rate groups, 3 * num_rate_values each
// q_gyro_cam is stored [x y z w].
inline int NumEffectBlocks(const PairMeasurement& pair) { return pair.effects ? 1 : 0; }
inline int NumTimeBlocks(const PairMeasurement& pair) { return pair.own_times ? 2 : 0; }

struct PairBearings {
  std::vector<Bearing> a, b;
};

// Fills the rays of a pair's matches, for as long as these values do not change and nobody asks for
// derivatives by them. Leaves none where the lens lacks one of them, or where an effect follows the
// frames' own times.
void HoldRays(const double* lens, const double* shutter, const double* effects,
              PairMeasurement* pair);

// The bearings of a pair's matches, one match at a time: those of a whole pair are a quarter of a
// megabyte, which takes longer to allocate than to fill. Refers to its arguments. own_times: the
// two offsets from the stamps; null: none.
class BearingsOfMatch {
 public:
  BearingsOfMatch(const PairMeasurement& pair, const RotationChain& chain, const double* lens,
                  const double* shutter, const double* q_gyro_cam, const double* effects,
                  const double* const* own_times = nullptr);
  // False where the lens has no ray. PairRow needs `derivatives`.
  [[nodiscard]] bool Evaluate(size_t match, bool derivatives, Bearing* a, Bearing* b) const;

 private:
  const PairMeasurement& pair_;
  const RotationChain& chain_;
  const LensParameters lens_;
  const ShutterParameters shutter_;
  const Eigen::Matrix3d R_gyro_cam_;
  const PairEffects effects_;
  const double later_a_s_, later_b_s_;  // than the measurement says
  const FrameTime frame_a_, frame_b_;
};

// Evaluates both bearings of every match; false where the lens has no ray. PairRow needs
// `derivatives`.
[[nodiscard]] bool EvaluatePairBearings(const PairMeasurement& pair, const RotationChain& chain,
                                        const double* lens, const double* shutter,
                                        const double* q_gyro_cam, const double* effects,
                                        bool derivatives, PairBearings* bearings,
                                        const double* const* own_times = nullptr);

// The rates of a pair's samples as columns.
Eigen::Matrix3Xd GatherRates(const PairMeasurement& pair, const double* const* groups);
// The chain of these rates, with derivatives by the groups' parameters.
RotationChain ChainOf(const PairMeasurement& pair, const double* const* groups);
// Of groups whose parameters are the rates themselves.
Eigen::Matrix3Xd GatherRates(const std::vector<int>& group_sizes, const double* const* groups);

// One row of a residual's Jacobian, before it is written to Ceres' blocks.
class PairRow {
 public:
  explicit PairRow(const RotationChain& chain) : by_rates_(3, chain.num_values()) {}

  void Clear() {
    gradient_ = PairGradient();
    by_rates_.setZero();
  }
  // Adds the effect of one bearing (see Backpropagate).
  void Add(const Bearing& bearing, const RotationChain& chain, double height_px,
           const Eigen::Vector3d& by_ray, const Eigen::Matrix<double, 3, 2>& by_J_ray_px) {
    Backpropagate(bearing, chain, height_px, by_ray, by_J_ray_px, &gradient_, by_rates_);
  }
  const PairGradient& gradient() const { return gradient_; }
  const Eigen::Matrix3Xd& by_rates() const { return by_rates_; }
  // Writes the row, times `scale`, to the Jacobians of lens, shutter, rotation, effects and rate
  // groups. Entries of `jacobians` may be null (constant blocks). first_rate_group: index of that
  // block; the effects, if the pair has any, come before it and before the frames' own times.
  void Write(int row, double scale, const double* q_gyro_cam, const PairMeasurement& pair,
             int first_rate_group, double** jacobians) const;

 private:
  PairGradient gradient_;
  Eigen::Matrix3Xd by_rates_;
};

}  // namespace camgyro

#endif  // CAMGYRO_FACTORS_PAIR_BEARINGS_H_
