// Times that frames have of their own, around their stamps: how far they spread, and which they
// are.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_FRAME_TIMES_H_
#define CAMGYRO_ESTIMATOR_WINDOW_FRAME_TIMES_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace camgyro {

// What the matches of a pair of frames say of the offsets o of its two frames from their stamps,
// all else that is the pair's own (direction, bend, noise of the gyro) projected out:
//   chi2(o) = chi2(0) + 2 score . o + o . information o
struct PairTimes {
  int64_t frame_a = 0, frame_b = 0;                       // any numbers that name the frames
  Eigen::Vector2d score = Eigen::Vector2d::Zero();        // [1/s]
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  // [1/s^2]
};

// A number and its standard deviation.
struct Spread {
  double value_s = 0.0, sigma_s = 0.0;
};

// The standard deviation of independent Gaussian offsets with mean zero that makes what the pairs
// say most likely, offsets integrated out:
//   2 log L(s) = s^2 score . (I + s^2 W)^-1 score - log det(I + s^2 W)
// with W the sum of the pairs' information. Within [kLeastSpreadS, kMostSpreadS]. sigma_s is from
// the curvature of log L over log s; that of a spread at the least allowed is where 2 log L has
// fallen by 1: as large as it may be without being unlikely.
constexpr double kLeastSpreadS = 1e-6, kMostSpreadS = 0.1;
Spread MostLikelySpread(const std::vector<PairTimes>& pairs);

// 2 log L(spread), which is 0 at spread 0.
double TwoLogLikelihood(const std::vector<PairTimes>& pairs, double spread_s);

struct FrameOffset {
  int64_t frame = 0;
  double offset_s = 0.0, sigma_s = 0.0;
};
// Mean and standard deviation of each frame's offset given the spread, in the order of frames.
std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, double spread_s);
// The same of a spread that is known as well as its sigma says: offsets spread by the root of the
// mean of its square. Where frames tell little, the most likely spread may be none at all, and
// times taken for known to a microsecond would be no honest ones.
std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, const Spread& spread);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_FRAME_TIMES_H_
