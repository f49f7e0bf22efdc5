// The problem behind two_view_rotation.h: rotation and translation direction between two pictures,
// from the rays of their matches.
#ifndef CAMGYRO_FRONTEND_TWO_VIEW_PROBLEM_H_
#define CAMGYRO_FRONTEND_TWO_VIEW_PROBLEM_H_

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "frontend/outliers.h"

namespace camgyro {

// Rays of a match in their own cameras, third component 1.
using RayMatch = RotatedMatch;

// A rotation with the direction of the translation: unit vector from the first to the second camera
// in the first one's frame; without meaning where nothing translated.
struct TwoViewMotion {
  Eigen::Matrix3d R_a_b = Eigen::Matrix3d::Identity();
  Eigen::Vector3d tau = Eigen::Vector3d::UnitZ();
};

// Median absolute residual as a standard deviation, corrected for the parameters fitted.
double SpreadOf(std::vector<double> squared, int num_parameters);

// Loss of a squared residual s: c^2 u / (1 + u), u = s / c^2 (Geman and McClure). Bounded, because
// a wrong match has leverage: its normal is long, and turns tau towards it even at Cauchy's weight
// (20 % of wrong matches: 2.2 mrad with Cauchy, 1.1 mrad with this).
class RobustLoss {
 public:
  explicit RobustLoss(double sigma) : c_sq_(9.0 * sigma * sigma) {}
  double Loss(double squared) const { return squared / (1.0 + squared / c_sq_); }
  double Weight(double squared) const {
    const double root = 1.0 / (1.0 + squared / c_sq_);
    return root * root;
  }
  bool IsInlier(double squared) const { return squared <= c_sq_; }
  // Derivative of psi = Weight * residual by the residual.
  double Slope(double squared) const {
    const double u = squared / c_sq_;
    return (1.0 - 3.0 * u) / ((1.0 + u) * (1.0 + u) * (1.0 + u));
  }

 private:
  double c_sq_;
};

// A rotation R_a_b with the covariance of its right perturbation [rad^2].
struct RotationFit {
  Eigen::Matrix3d R_a_b = Eigen::Matrix3d::Identity();
  std::optional<Eigen::Matrix3d> covariance;  // nothing: the matches do not determine it
  double variance_px = 0.0;                   // of one observation, per axis [px^2]
};

// Rotation alone, as if there were no translation. Iteratively re-weighted Gauss-Newton on the
// transfer error of a into the second image [px].
RotationFit FitRotationOnly(const std::vector<RayMatch>& matches, double min_sigma_px,
                            const Eigen::Matrix3d& begin_at);

// Rotation and direction together (two_view_rotation.h says what is minimised). The matches must
// outlive it.
class TwoViewProblem {
 public:
  TwoViewProblem(const std::vector<RayMatch>& matches, const Eigen::Matrix3d& R_a_b);

  struct Linearised {
    Eigen::Matrix<double, 5, 5> hessian;  // rotation (right perturbation), tangent of tau
    Eigen::Matrix<double, 5, 1> gradient;
    Eigen::Matrix<double, 3, 2> tangent;
  };

  void SetNoiseRotation(const Eigen::Matrix3d& R_a_b);

  // Squared residuals [px^2] of all matches.
  std::vector<double> SquaredResiduals(const TwoViewMotion& motion) const;

  // Of n n' / variance(tau . n), times weights if there are any.
  Eigen::Matrix3d SumOfNormals(const Eigen::Matrix3d& R_a_b, const Eigen::Vector3d& tau,
                               const std::vector<double>& weights) const;

  // Share of the matches on the wrong side of their epipole.
  double ShareBehind(const TwoViewMotion& motion) const;

  double Cost(const TwoViewMotion& motion, const RobustLoss& loss) const;

  Linearised Linearise(const TwoViewMotion& motion, const RobustLoss& loss) const;

  // Of the rotation, right perturbation [rad^2], as an M-estimator's: E psi^2 / (E psi')^2 on the
  // normal equations of the inliers. Nothing if they do not determine it.
  //
  // Noise in the normals looks like parallax and inflates the information on tau (errors in
  // variables: docs/architecture.md, traps). Its expectation is taken off again, up to half: the
  // rest is needed where there is no parallax at all.
  RotationFit FitWithCovariance(const TwoViewMotion& motion, const RobustLoss& loss) const;

  // Levenberg-Marquardt at a fixed loss.
  void Minimise(const RobustLoss& loss, int max_iterations, TwoViewMotion* motion) const;

 private:
  // Of one match: distance from the epipolar line and, on its wrong side, from the epipole. [px]
  struct Residual {
    bool is_behind = false;  // on the wrong side; else only the first of the two is there
    std::array<double, 2> value;
    // By a rotation in camera a (left perturbation), and by the tangent of tau.
    std::array<Eigen::Matrix<double, 5, 1>, 2> by;

    double Squared() const { return value[0] * value[0] + (is_behind ? value[1] * value[1] : 0.0); }
    Eigen::Matrix<double, 5, 5> Square(double weight) const {
      Eigen::Matrix<double, 5, 5> square = (weight * by[0]) * by[0].transpose();
      if (is_behind) square += (weight * by[1]) * by[1].transpose();
      return square;
    }
  };

  // What was of a rotation in camera a, for one in camera b.
  static Eigen::Matrix<double, 5, 5> InCameraB(const Eigen::Matrix<double, 5, 5>& square,
                                               const TwoViewMotion& motion);

  double SquaredResidual(size_t i, const TwoViewMotion& motion) const;

  Residual LineariseOne(size_t i, const TwoViewMotion& motion,
                        const Eigen::Matrix<double, 3, 2>& tangent) const;

  const std::vector<RayMatch>& matches_;
  std::vector<CoplanarityNormal> noise_;  // cov_n of each match; n is not used
};

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_TWO_VIEW_PROBLEM_H_
