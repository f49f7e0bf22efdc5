#include "estimator/vins/structure.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/linear_algebra.h"
#include "core/robust_statistics.h"

namespace camgyro {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kRounds = 12;
constexpr double kLossSigmas = 3.0;
constexpr double kMinNoiseRad = 1e-5;
constexpr int kMinPoints = 15;
constexpr double kWeightBehind = 1e-3;
constexpr double kNearest = 0.05;  // of the median depth; what seems nearer has no more weight

// The camera centre at an observation as a combination of the centres of up to three keyframes.
struct CentreAt {
  std::array<int, 3> keyframes{};
  std::array<double, 3> weights{};
};

CentreAt InterpolateCentre(const VinsWindow& window, const VinsObservation& seen) {
  const int last = static_cast<int>(window.keyframes.size()) - 1;
  const int before = std::max(0, seen.keyframe - 1), after = std::min(last, seen.keyframe + 1);
  const auto time_s = [&](int k) { return window.keyframes[static_cast<size_t>(k)].time_s; };
  const double share = (seen.time_s - time_s(seen.keyframe)) / (time_s(after) - time_s(before));
  return {{before, seen.keyframe, after}, {-share, 1.0, share}};
}

class Solver {
 public:
  explicit Solver(const VinsWindow& window)
      : window_(window), weights_(window.observations.size(), 1.0) {
    begin_.assign(window.track_ids.size() + 1, 0);
    for (const VinsObservation& seen : window.observations) {
      centre_at_.push_back(InterpolateCentre(window, seen));
      ++begin_[static_cast<size_t>(seen.landmark) + 1];
    }
    for (size_t j = 1; j < begin_.size(); ++j) begin_[j] += begin_[j - 1];
    structure_.centres = Eigen::Matrix3Xd::Zero(3, Keyframes());
    structure_.points.resize(window.track_ids.size());
  }

  Result<VinsStructure> Solve() {
    for (int round = 0; round < kRounds; ++round) {
      FindCentres();
      FindPoints();
      if (!UpdateWeights()) {
        return CannotEstimate("the tracks do not agree with any translation of the camera");
      }
    }
    int before_camera = 0;
    std::vector<double> parallax;
    for (size_t j = 0; j + 1 < begin_.size(); ++j) {
      double support = 0.0, widest = 1.0;
      for (size_t i = begin_[j]; i < begin_[j + 1]; ++i) {
        if (inlier_[i]) support += 1.0;
        widest = std::min(widest, Direction(begin_[j]).dot(Direction(i)));
      }
      // Of the sightings of a right point two thirds or more agree.
      if (3.0 * support < 2.0 * static_cast<double>(begin_[j + 1] - begin_[j])) {
        structure_.points[j].reset();
        continue;
      }
      ++before_camera;
      parallax.push_back(std::acos(std::clamp(widest, -1.0, 1.0)));
    }
    if (before_camera < kMinPoints) {
      return CannotEstimate("only " + std::to_string(before_camera) +
                            " tracked points agree with a translation of the camera");
    }
    structure_.parallax_rad = MedianInPlace(&parallax);
    return structure_;
  }

 private:
  Eigen::Index Keyframes() const { return static_cast<Eigen::Index>(window_.keyframes.size()); }
  const Vector3d& Direction(size_t i) const { return window_.observations[i].direction_world; }
  Matrix3d Projector(size_t i) const {
    return weights_[i] * (Matrix3d::Identity() - Direction(i) * Direction(i).transpose());
  }
  Vector3d Centre(size_t i) const {
    Vector3d centre = Vector3d::Zero();
    for (size_t n = 0; n < 3; ++n) {
      centre += centre_at_[i].weights[n] * structure_.centres.col(centre_at_[i].keyframes[n]);
    }
    return centre;
  }

  // Inverse with directions that nothing determines (a point at infinity) left at zero.
  static Matrix3d PseudoInverse(const Matrix3d& M) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(M);
    Vector3d inverse = Vector3d::Zero();
    for (int n = 0; n < 3; ++n) {
      if (eigen.eigenvalues()[n] > 1e-12 * eigen.eigenvalues()[2]) {
        inverse[n] = 1.0 / eigen.eigenvalues()[n];
      }
    }
    return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  }

  void FindCentres() {
    const Eigen::Index size = 3 * Keyframes();
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
    Eigen::MatrixXd coupling(3, size);
    for (size_t j = 0; j + 1 < begin_.size(); ++j) {
      Matrix3d M = Matrix3d::Zero();
      coupling.setZero();
      for (size_t i = begin_[j]; i < begin_[j + 1]; ++i) {
        const Matrix3d P = Projector(i);
        const CentreAt& at = centre_at_[i];
        M += P;
        for (size_t n = 0; n < 3; ++n) {
          coupling.middleCols<3>(3 * at.keyframes[n]) += at.weights[n] * P;
          for (size_t m = 0; m < 3; ++m) {
            H.block<3, 3>(3 * at.keyframes[n], 3 * at.keyframes[m]) +=
                at.weights[n] * at.weights[m] * P;
          }
        }
      }
      H -= coupling.transpose() * PseudoInverse(M) * coupling;
    }
    // The first centre is the origin.
    structure_.centres.setZero();
    Eigen::Map<Eigen::VectorXd>(structure_.centres.data(), size).tail(size - 3) =
        SpectrumOfSymmetric(H.bottomRightCorner(size - 3, size - 3)).vectors.col(0);
  }

  // Points, and the sign of the solution that has most of them before the camera.
  void FindPoints() {
    int before = 0, behind = 0;
    for (size_t j = 0; j + 1 < begin_.size(); ++j) {
      Matrix3d M = Matrix3d::Zero();
      Vector3d sum = Vector3d::Zero();
      for (size_t i = begin_[j]; i < begin_[j + 1]; ++i) {
        M += Projector(i);
        sum += Projector(i) * Centre(i);
      }
      structure_.points[j] = PseudoInverse(M) * sum;
      for (size_t i = begin_[j]; i < begin_[j + 1]; ++i) {
        (Direction(i).dot(*structure_.points[j] - Centre(i)) > 0.0 ? before : behind) += 1;
      }
    }
    if (behind <= before) return;
    structure_.centres = -structure_.centres;
    for (auto& point : structure_.points) {
      if (point) *point = -*point;
    }
  }

  // False if no observation has its point before the camera.
  bool UpdateWeights() {
    const size_t count = window_.observations.size();
    std::vector<double> angles(count, -1.0), depths(count, 0.0), seen, seen_depths;
    for (size_t j = 0; j + 1 < begin_.size(); ++j) {
      for (size_t i = begin_[j]; i < begin_[j + 1]; ++i) {
        const Vector3d line = *structure_.points[j] - Centre(i);
        depths[i] = Direction(i).dot(line);
        if (depths[i] <= 0.0) continue;
        angles[i] = (line - depths[i] * Direction(i)).norm() / depths[i];
        seen.push_back(angles[i]);
        seen_depths.push_back(depths[i]);
      }
    }
    if (seen.empty()) return false;
    // Median of the norm of two normal errors is 1.177 sigma.
    structure_.noise_rad = std::max(kMinNoiseRad, MedianInPlace(&seen) / 1.177);
    const double usual_depth = MedianInPlace(&seen_depths);
    inlier_.assign(count, false);
    for (size_t i = 0; i < count; ++i) {
      const double ratio = angles[i] / (kLossSigmas * structure_.noise_rad);
      inlier_[i] = angles[i] >= 0.0 && ratio <= 1.0;
      if (angles[i] < 0.0) {  // behind the camera now; it may return, so it keeps a little say
        weights_[i] = kWeightBehind / (usual_depth * usual_depth);
        continue;
      }
      const double scaled = std::max(kNearest * usual_depth, depths[i]) * (1.0 + ratio * ratio);
      weights_[i] = 1.0 / (scaled * scaled);
    }
    return true;
  }

  const VinsWindow& window_;
  std::vector<CentreAt> centre_at_;
  std::vector<size_t> begin_;  // first observation of each landmark
  std::vector<double> weights_;
  std::vector<bool> inlier_;
  VinsStructure structure_;
};

}  // namespace

Result<VinsStructure> FindStructure(const VinsWindow& window) { return Solver(window).Solve(); }

}  // namespace camgyro
