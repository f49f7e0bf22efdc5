// How far the residuals of a track keep to one side: the mark of what moves by itself.
#ifndef CAMGYRO_ESTIMATOR_WINDOW_TRACK_LEAN_H_
#define CAMGYRO_ESTIMATOR_WINDOW_TRACK_LEAN_H_

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "core/recording.h"

namespace camgyro {

// Noise falls on either side of the epipolar line in each pair of frames anew; what moves goes on
// in its direction, also where no single residual is large enough for the robust loss.
//
//   chi2 = S' C^-1 S,   S = sum psi(r_i) u_i,   C = v sum u_i u_i'
//
// r_i: residual of the track in pair i in sigmas, psi: bounded at kBound, u_i: unit vector across
// the epipolar line in the picture, v: mean of psi^2 over all matches, so that neither the noise
// nor its shape has to be known. Of a point at rest it is chi-square with two degrees of freedom.
// Short tracks have lighter tails, as psi is bounded.
struct TrackLean {
  // In sigmas. Lower bounds let wrong matches of points at rest say less, higher ones tell short
  // tracks of things that move; at 1.5 a mean of Gaussian residuals loses 4 % (Huber 1964).
  static constexpr double kBound = 1.5;
  static constexpr int kLeastMatches = 4;  // fewer say nothing

  int64_t track_id = 0;
  int matches = 0;
  double chi2 = 0.0;
};

// S and C of tracks, pair by pair.
class TrackLeans {
 public:
  // sigmas: the residual, of either sign. correction_px: the shift that takes the match onto its
  // plane (MatchMisfit). Matches without a track (Match::kNoTrack) are left out.
  void Add(int64_t track_id, double sigmas, const Eigen::Vector2d& correction_px);
  void Add(const TrackLeans& other);
  // Of other tracks than these nothing is known any more.
  void KeepOnly(const TrackLeans& others);

  // Of all tracks with kLeastMatches, by ascending id.
  std::vector<TrackLean> All() const;

 private:
  struct Sums {
    int matches = 0;
    double squares = 0.0;  // of psi
    Eigen::Vector2d residuals = Eigen::Vector2d::Zero();
    Eigen::Matrix2d directions = Eigen::Matrix2d::Zero();
  };
  std::map<int64_t, Sums> tracks_;
};

// Ids, ascending, of tracks that lean beyond chance: of those named, a share of kFalseDiscoveries
// is expected to be at rest (Benjamini & Hochberg 1995); of a scene at rest, most often none is
// named. What lets all tracks lean, an effect that nobody has declared, is no motion: chi2 is
// divided by as much as its lower quartile is too large ("genomic control", Devlin & Roeder 1999).
// The lower one: half of the scene may move. None where more than that do; then it is the model.
constexpr double kFalseDiscoveries = 0.05;
constexpr double kMostMoving = 0.5;
std::vector<int64_t> MovingTracks(const std::vector<TrackLean>& leans);

// Takes out the matches of these tracks (ascending ids).
void EraseMatchesOf(const std::vector<int64_t>& track_ids, std::vector<Match>* matches);

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_WINDOW_TRACK_LEAN_H_
