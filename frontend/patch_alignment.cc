#include "frontend/patch_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace camgyro {
namespace {

// Translation, four of the linear warp (in px at the patch's edge), gain, offset.
constexpr int kParameters = 8;
using Parameters = Eigen::Matrix<float, kParameters, 1>;
using Jacobian = Eigen::Matrix<float, Eigen::Dynamic, kParameters>;

constexpr int kMaxIterations = 15;
constexpr float kConvergedPx = 1e-3F;
constexpr float kMaxShiftPx = 1.0F;  // from the guess
// Of the weights, over half of the window: at its edge, the weight is 0.17.
constexpr float kWeightSigma = 0.53F;
// A warp moves the patch's edge by less than this from one picture to the next ...
constexpr float kWarpSigma = 0.05F;
// ... and the prior that says so weighs as much as grey values that are known to this.
constexpr float kGreySigma = 3.0F;

// Bilinear; the point and its right and lower neighbours must be inside.
float Sample(const cv::Mat& image, float x, float y) {
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const float a = x - static_cast<float>(u), b = y - static_cast<float>(v);
  const uchar *upper = image.ptr(v) + u, *lower = image.ptr(v + 1) + u;
  return (1.0F - b) * ((1.0F - a) * upper[0] + a * upper[1]) +
         b * ((1.0F - a) * lower[0] + a * lower[1]);
}

bool Inside(const cv::Mat& image, const Eigen::Vector2f& px, float reach) {
  return px.x() >= reach && px.y() >= reach &&
         px.x() + reach + 1.0F <= static_cast<float>(image.cols - 1) &&
         px.y() + reach + 1.0F <= static_cast<float>(image.rows - 1);
}

}  // namespace

std::optional<AlignedPatch> AlignPatch(const cv::Mat& before, const Eigen::Vector2d& px_before,
                                       const cv::Mat& after, const Eigen::Vector2d& guess,
                                       int window_px) {
  const int half = window_px / 2, n = window_px * window_px;
  const auto reach = static_cast<float>(half);
  const Eigen::Vector2f from = px_before.cast<float>();
  if (!Inside(before, from, reach + 1.0F)) return std::nullopt;

  // The template (y, x), one pixel wider for Scharr's derivatives; pixels in the order of columns.
  const int w = window_px;
  Eigen::ArrayXXf wide(w + 2, w + 2);
  for (int x = 0; x < w + 2; ++x) {
    for (int y = 0; y < w + 2; ++y) {
      wide(y, x) = Sample(before, from.x() + static_cast<float>(x - half - 1),
                          from.y() + static_cast<float>(y - half - 1));
    }
  }
  const Eigen::ArrayXXf dx = wide.rightCols(w) - wide.leftCols(w);
  const Eigen::ArrayXXf dy = wide.bottomRows(w) - wide.topRows(w);
  const Eigen::ArrayXXf gx =
      (3.0F * (dx.topRows(w) + dx.bottomRows(w)) + 10.0F * dx.middleRows(1, w)) / 32.0F;
  const Eigen::ArrayXXf gy =
      (3.0F * (dy.leftCols(w) + dy.rightCols(w)) + 10.0F * dy.middleCols(1, w)) / 32.0F;
  const Eigen::ArrayXXf grey = wide.block(1, 1, w, w);

  // Derivatives by the parameters.
  const Eigen::ArrayXf edge = Eigen::ArrayXf::LinSpaced(w, -1.0F, 1.0F);
  const Eigen::ArrayXf fall = (-0.5F * (edge / kWeightSigma).square()).exp();
  const Eigen::ArrayXXf s = edge.transpose().replicate(w, 1), t = edge.replicate(1, w);
  const Eigen::MatrixXf weight = fall.matrix() * fall.matrix().transpose();
  Jacobian J(n, kParameters);
  J << gx.reshaped(), gy.reshaped(), (gx * s).reshaped(), (gx * t).reshaped(), (gy * s).reshaped(),
      (gy * t).reshaped(), (grey - grey.mean()).reshaped() / 32.0F, Eigen::ArrayXf::Ones(n);
  const Jacobian weighted = weight.reshaped().asDiagonal() * J;
  const float prior = std::pow(kGreySigma / (kWarpSigma * reach), 2.0F);
  Eigen::Matrix<float, kParameters, kParameters> information = J.transpose() * weighted;
  information.diagonal().segment<4>(2).array() += prior;
  information.diagonal().tail<2>().array() += 1e-3F;
  const Eigen::LLT<Eigen::Matrix<float, kParameters, kParameters>> llt(information);
  if (llt.info() != Eigen::Success) return std::nullopt;

  // after(px + warp * offset) = before(px_before + offset)
  Eigen::Matrix2f warp = Eigen::Matrix2f::Identity();
  Eigen::Vector2f px = guess.cast<float>();
  Eigen::VectorXf difference(n);
  bool converged = false;
  for (int iteration = 0; iteration < kMaxIterations && !converged; ++iteration) {
    const float corner = reach * warp.cwiseAbs().rowwise().sum().maxCoeff();
    if (!(corner < 2.0F * reach) || !Inside(after, px, corner)) return std::nullopt;
    for (int x = 0, k = 0; x < w; ++x) {
      for (int y = 0; y < w; ++y, ++k) {
        const Eigen::Vector2f at =
            px + warp * Eigen::Vector2f(static_cast<float>(x - half), static_cast<float>(y - half));
        difference[k] = Sample(after, at.x(), at.y()) - grey(y, x);
      }
    }
    Parameters right = weighted.transpose() * difference;
    const Eigen::Matrix2f bent = (warp - Eigen::Matrix2f::Identity()) * reach;
    right.segment<4>(2) += prior * Eigen::Vector4f(bent(0, 0), bent(0, 1), bent(1, 0), bent(1, 1));
    const Parameters step = llt.solve(right);
    Eigen::Matrix2f change = Eigen::Matrix2f::Identity();
    change(0, 0) += step[2] / reach;
    change(0, 1) += step[3] / reach;
    change(1, 0) += step[4] / reach;
    change(1, 1) += step[5] / reach;
    warp = warp * change.inverse();
    px -= warp * step.head<2>();
    if (!((px - guess.cast<float>()).norm() < kMaxShiftPx)) return std::nullopt;
    converged = step.head<2>().norm() < kConvergedPx;
  }

  AlignedPatch aligned;
  aligned.px = px.cast<double>();
  const Eigen::Matrix<float, kParameters, 2> unit =
      Eigen::Matrix<float, kParameters, 2>::Identity();
  const Eigen::MatrixX2f influence = weighted * llt.solve(unit);
  aligned.covariance = (influence.transpose() * influence).cast<double>();
  return aligned;
}

}  // namespace camgyro
