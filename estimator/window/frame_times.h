// Times that frames have of their own, around their stamps: how far they spread, and which they
// are.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_FRAME_TIMES_H_
#define CAMGYRO_ESTIMATOR_WINDOW_FRAME_TIMES_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
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

constexpr double kLeastSpreadS = 1e-6, kMostSpreadS = 0.1;

// Frames whose times do not follow the law of the others, as of a logger that is held up now and
// then; by their numbers. They are known to kMostSpreadS before any match has been looked at.
using LateFrames = std::set<int64_t>;
// So many spreads off, a frame may be one of them: of Gaussian times one in 1.7 million is, of
// exponential latencies one in 400.
constexpr double kLateSpreads = 5.0;
inline bool IsLate(double offset_s, double spread_s) {
  return std::abs(offset_s) > kLateSpreads * spread_s;
}
// The standard deviation of a frame's time, before any match has been looked at, where it is now.
inline double PriorSpread(double offset_s, double spread_s) {
  return IsLate(offset_s, spread_s) ? kMostSpreadS : spread_s;
}
// What a frame's time costs there, which is bounded [sigmas^2].
inline double PriorCost(double offset_s, double spread_s) {
  return std::pow(std::min(std::abs(offset_s) / spread_s, kLateSpreads), 2);
}
// Late frames are searched as if times had at least this spread: from 20 ms to either side.
constexpr double kSearchedSpreadS = 8e-3;

// The standard deviation of independent Gaussian offsets with mean zero that makes what the pairs
// say most likely, offsets integrated out:
//   2 log L(s) = score . S (I + S W S)^-1 S score - log det(I + S W S)
// with W the sum of the pairs' information, and S a diagonal of s, of late frames kMostSpreadS.
// Within [kLeastSpreadS, kMostSpreadS]. sigma_s is from the curvature of log L over log s; that of
// a spread at the least allowed is where 2 log L has fallen by 1: as large as it may be without
// being unlikely.
Spread MostLikelySpread(const std::vector<PairTimes>& pairs, const LateFrames& late = {});

// 2 log L(spread), which is 0 at spread 0; of no late frames.
double TwoLogLikelihood(const std::vector<PairTimes>& pairs, double spread_s);

struct FrameTimeLaw {
  Spread spread;  // of frames that are not late
  LateFrames late;
};
// Frames become late, and the spread of the others less, until no other frame is late by the spread
// and by how well the pairs know it. If the others then have kSpreadOfOthers of the spread of all,
// or more, none is late: the latest of exponential latencies are a part of their law, and the mean
// of the others, which the delay is, would be another.
constexpr double kSpreadOfOthers = 0.5;
FrameTimeLaw MostLikelyLaw(const std::vector<PairTimes>& pairs);

struct FrameOffset {
  int64_t frame = 0;
  double offset_s = 0.0, sigma_s = 0.0;
};
// Mean and standard deviation of each frame's offset given the spread, in the order of frames.
std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, double spread_s,
                                   const LateFrames& late = {});
// The same of a law, of which two things are not known for certain. The spread: its sigma stands in
// for it where that is larger. Where frames tell little, the most likely spread may be none at all,
// and times taken for known to a microsecond would be no honest ones. And whether a frame is late:
// mean and standard deviation are those over both cases, where late frames are as far off as those
// found, and as frequent as is most likely.
std::vector<FrameOffset> OffsetsOf(const std::vector<PairTimes>& pairs, const FrameTimeLaw& law);

// How many are late, and by how much, in a sentence. offsets: of the frames among which they are.
std::string Describe(const LateFrames& late, const std::vector<FrameOffset>& offsets);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_FRAME_TIMES_H_
