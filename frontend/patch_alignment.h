// Where a patch of one picture is seen in the next, when it turns, shears and grows a little on the
// way and its brightness changes.
#ifndef CAMGYRO_FRONTEND_PATCH_ALIGNMENT_H_
#define CAMGYRO_FRONTEND_PATCH_ALIGNMENT_H_

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace camgyro {

constexpr int kMaxPatchPx = 31;  // widest patch

struct AlignedPatch {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  // of its middle
  // Of px, over the variance of the grey values' noise [px^2 / grey^2].
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
};

// The inverse compositional algorithm (Baker & Matthews, IJCV 2004) for an affine warp with gain
// and offset, Gaussian weights and a weak prior against deformation. before, after: 8-bit grey. The
// patch around px_before [px] is window_px wide (odd, at most kMaxPatchPx); `guess` [px] is where
// the search begins. Nothing if the width is none of these, the patch leaves a picture, has no
// texture, or the search goes astray.
std::optional<AlignedPatch> AlignPatch(const cv::Mat& before, const Eigen::Vector2d& px_before,
                                       const cv::Mat& after, const Eigen::Vector2d& guess,
                                       int window_px);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_PATCH_ALIGNMENT_H_
