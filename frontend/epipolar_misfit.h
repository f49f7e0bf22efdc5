// How far the matches of two pictures are off their epipolar lines, without a calibration.
#ifndef CAMGYRO_FRONTEND_EPIPOLAR_MISFIT_H_
#define CAMGYRO_FRONTEND_EPIPOLAR_MISFIT_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// For each match the shortest shift of px_b [px] that takes it onto the epipolar line of px_a, by
// the fundamental matrix that fits most of the matches (cv::findFundamentalMat, least median of
// squares, then the eight-point method of those within 2.5 robust sigmas). What lens and rolling
// shutter bend is in it, and is a smooth function of the place. Empty with fewer than 20 matches,
// or where no matrix fits. Deterministic.
std::vector<Eigen::Vector2d> EpipolarCorrections(const std::vector<Match>& matches);

// Indices of the matches within so many robust sigmas of the epipolar lines that fit most of them
// (least median of squares). Empty as above. Deterministic.
std::vector<size_t> EpipolarInliers(const std::vector<Match>& matches, double sigmas);

// The same corrections by the matrix that the eight-point method makes of all the matches, which
// have to be right ones. Empty with fewer than 10.
std::vector<Eigen::Vector2d> LinearEpipolarCorrections(const std::vector<Match>& matches);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_EPIPOLAR_MISFIT_H_
