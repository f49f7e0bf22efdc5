#include "frontend/patch_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>

namespace camgyro {
namespace {

// Translation, four of the linear warp (in px at the patch's edge), gain, offset.
constexpr int kParameters = 8;
using Parameters = Eigen::Matrix<float, kParameters, 1>;
using Information = Eigen::Matrix<float, kParameters, kParameters>;

constexpr int kMaxIterations = 15;
constexpr float kConvergedPx = 3e-3F;
constexpr float kMaxShiftPx = 1.0F;  // from the guess
// Of the weights, over half of the window: at its edge, the weight is 0.17.
constexpr float kWeightSigma = 0.53F;
// A warp moves the patch's edge by less than this from one picture to the next ...
constexpr float kWarpSigma = 0.05F;
// ... and the prior that says so weighs as much as grey values that are known to this.
constexpr float kGreySigma = 3.0F;

// A row of the patch, filled up with zeros. Its length is known to the compiler, which makes
// vector instructions of what is done with it.
constexpr int kPitch = kMaxPatchPx + 1;
using Row = Eigen::Array<float, kPitch, 1>;
using Rows = std::array<Row, kMaxPatchPx>;

// The derivative by parameter i is base * s^of_s * t^of_t: base is the derivative along x or y, the
// grey value, or one; s and t are x and y in the patch, from -1 to 1.
enum Base { kX, kY, kGrey, kOne };
struct Column {
  Base base;
  int of_s, of_t;
};
constexpr std::array<Column, kParameters> kColumns = {{{kX, 0, 0},
                                                       {kY, 0, 0},
                                                       {kX, 1, 0},
                                                       {kX, 0, 1},
                                                       {kY, 1, 0},
                                                       {kY, 0, 1},
                                                       {kGrey, 0, 0},
                                                       {kOne, 0, 0}}};

// Sums over the patch are taken down its columns first, with the powers of t, then along x.
template <size_t kPowers>
using ColumnSums = std::array<Row, kPowers>;

template <size_t kPowers>
void AddRow(Row row, float t, ColumnSums<kPowers>* sums) {
  (*sums)[0] += row;
  for (size_t power = 1; power < kPowers; ++power) {
    row *= t;
    (*sums)[power] += row;
  }
}

template <size_t kPowers>
ColumnSums<kPowers> ZeroSums() {
  ColumnSums<kPowers> sums;
  sums.fill(Row::Zero());
  return sums;
}

bool Inside(const cv::Mat& image, const Eigen::Vector2f& px, float reach) {
  return px.x() >= reach && px.y() >= reach &&
         px.x() + reach + 1.0F <= static_cast<float>(image.cols - 1) &&
         px.y() + reach + 1.0F <= static_cast<float>(image.rows - 1);
}

// Two neighbouring grey values, the left one in the low byte: compilers make one load of it.
int NeighboursAt(const uchar* left) { return left[0] | left[1] << 8; }

// Grey values, bilinear, at px, px + step, ...; these and their right and lower neighbours are
// inside. Beyond `count`, anything.
Row SampleRow(const cv::Mat& image, const Eigen::Vector2f& px, const Eigen::Vector2f& step,
              int count) {
  const auto stride = static_cast<int>(image.step);
  using Whole = Eigen::Array<int, kPitch, 1>;
  Whole offset;
  Row a, b;
  for (int x = 0; x < kPitch; ++x) {
    const float fu = px.x() + static_cast<float>(x) * step.x();
    const float fv = px.y() + static_cast<float>(x) * step.y();
    const int u = static_cast<int>(fu), v = static_cast<int>(fv);
    a[x] = fu - static_cast<float>(u);
    b[x] = fv - static_cast<float>(v);
    offset[x] = v * stride + u;
  }
  for (int x = count; x < kPitch; ++x) offset[x] = offset[0];
  Whole upper, lower;
  for (int x = 0; x < kPitch; ++x) {
    const uchar* first = image.data + offset[x];
    upper[x] = NeighboursAt(first);
    lower[x] = NeighboursAt(first + stride);
  }
  Row row;
  for (int x = 0; x < kPitch; ++x) {
    const int upper_left = upper[x] & 0xFF, lower_left = lower[x] & 0xFF;
    const float above =
        static_cast<float>(upper_left) + a[x] * static_cast<float>((upper[x] >> 8) - upper_left);
    const float below =
        static_cast<float>(lower_left) + a[x] * static_cast<float>((lower[x] >> 8) - lower_left);
    row[x] = above + b[x] * (below - above);
  }
  return row;
}

// The patch of the first picture: grey values, derivatives, weights, normal equations.
class Template {
 public:
  // Inside() of the picture, with one pixel more than half of the patch.
  Template(const cv::Mat& image, const Eigen::Vector2f& px, int width) : width_(width) {
    edge_.setZero();
    weight_.setZero();
    edge_.head(width) = Eigen::ArrayXf::LinSpaced(width, -1.0F, 1.0F);
    weight_.head(width) = (-0.5F * (edge_.head(width) / kWeightSigma).square()).exp();
    ReadPicture(image, px);
  }

  const Row& grey(int y) const { return grey_[static_cast<size_t>(y)]; }

  Information NormalMatrix() const {
    auto xx = ZeroSums<3>(), xy = ZeroSums<3>(), yy = ZeroSums<3>();
    auto xg = ZeroSums<2>(), yg = ZeroSums<2>(), x1 = ZeroSums<2>(), y1 = ZeroSums<2>();
    auto gg = ZeroSums<1>(), g1 = ZeroSums<1>(), one = ZeroSums<1>();
    for (int y = 0; y < width_; ++y) {
      const auto k = static_cast<size_t>(y);
      const float t = edge_[y];
      const Row wx = weight_[y] * x_[k], wy = weight_[y] * y_[k], wg = weight_[y] * gain_[k];
      AddRow<3>(wx * x_[k], t, &xx);
      AddRow<3>(wx * y_[k], t, &xy);
      AddRow<3>(wy * y_[k], t, &yy);
      AddRow<2>(wx * gain_[k], t, &xg);
      AddRow<2>(wy * gain_[k], t, &yg);
      AddRow<2>(wx, t, &x1);
      AddRow<2>(wy, t, &y1);
      gg[0] += wg * gain_[k];
      g1[0] += wg;
      one[0] += weight_[y];
    }
    const std::array<std::array<const Row*, 4>, 4> sums = {{
        {xx.data(), xy.data(), xg.data(), x1.data()},
        {xy.data(), yy.data(), yg.data(), y1.data()},
        {xg.data(), yg.data(), gg.data(), g1.data()},
        {x1.data(), y1.data(), g1.data(), one.data()},
    }};
    const std::array<Row, 3> along = {weight_, weight_ * edge_, weight_ * edge_.square()};
    Information information;
    for (int i = 0; i < kParameters; ++i) {
      for (int j = 0; j <= i; ++j) {
        const Column &a = kColumns[static_cast<size_t>(i)], &b = kColumns[static_cast<size_t>(j)];
        const Row& down = sums[a.base][b.base][a.of_t + b.of_t];
        information(i, j) = (down * along[static_cast<size_t>(a.of_s + b.of_s)]).sum();
        information(j, i) = information(i, j);
      }
    }
    return information;
  }

  // The derivatives times weighted differences of grey values.
  class RightSide {
   public:
    explicit RightSide(const Template& patch) : patch_(patch) {}
    void Add(int y, const Row& difference) {
      const auto k = static_cast<size_t>(y);
      const Row weighted = patch_.weight_[y] * difference;
      AddRow<2>(weighted * patch_.x_[k], patch_.edge_[y], &x_);
      AddRow<2>(weighted * patch_.y_[k], patch_.edge_[y], &y_);
      gain_[0] += weighted * patch_.gain_[k];
      one_[0] += weighted;
    }
    Parameters Sum() const {
      const std::array<const Row*, 4> sums = {x_.data(), y_.data(), gain_.data(), one_.data()};
      const std::array<Row, 2> along = {patch_.weight_, patch_.weight_ * patch_.edge_};
      Parameters right;
      for (int i = 0; i < kParameters; ++i) {
        const Column& c = kColumns[static_cast<size_t>(i)];
        right[i] = (sums[c.base][c.of_t] * along[static_cast<size_t>(c.of_s)]).sum();
      }
      return right;
    }

   private:
    const Template& patch_;
    ColumnSums<2> x_ = ZeroSums<2>(), y_ = ZeroSums<2>();
    ColumnSums<1> gain_ = ZeroSums<1>(), one_ = ZeroSums<1>();
  };

  // Covariance of the translation, of grey values with variance 1; `gains`: the parameters' change
  // by a sum of weighted differences.
  Eigen::Matrix2d Covariance(const Eigen::Matrix<float, kParameters, 2>& gains) const {
    Row xx = Row::Zero(), xy = Row::Zero(), yy = Row::Zero();
    for (int y = 0; y < width_; ++y) {
      const auto k = static_cast<size_t>(y);
      const float t = edge_[y];
      std::array<Row, 2> by;
      for (int i = 0; i < 2; ++i) {
        const auto g = gains.col(i);
        by[static_cast<size_t>(i)] =
            weight_[y] * weight_ *
            (x_[k] * (g[0] + g[3] * t + g[2] * edge_) + y_[k] * (g[1] + g[5] * t + g[4] * edge_) +
             gain_[k] * g[6] + g[7]);
      }
      xx += by[0].square();
      xy += by[0] * by[1];
      yy += by[1].square();
    }
    Eigen::Matrix2d covariance;
    covariance << xx.sum(), xy.sum(), xy.sum(), yy.sum();
    return covariance;
  }

 private:
  void ReadPicture(const cv::Mat& image, const Eigen::Vector2f& px) {
    // One pixel wider, for Scharr's derivatives; their difference along x or y, and the mean of
    // three rows or columns.
    constexpr int kWide = kPitch + 4;
    const int half = width_ / 2;
    const Eigen::Vector2f corner = px.array() - static_cast<float>(half + 1);
    const int u = static_cast<int>(corner.x()), v = static_cast<int>(corner.y());
    const float a = corner.x() - static_cast<float>(u), b = corner.y() - static_cast<float>(v);
    std::array<Eigen::Array<float, kWide, 1>, kMaxPatchPx + 2> wide;
    for (int y = 0; y < width_ + 2; ++y) {
      auto& row = wide[static_cast<size_t>(y)];
      row.setZero();
      const uchar *upper = image.ptr(v + y) + u, *lower = image.ptr(v + y + 1) + u;
      for (int x = 0; x < width_ + 2; ++x) {
        row[x] = (1.0F - b) * ((1.0F - a) * upper[x] + a * upper[x + 1]) +
                 b * ((1.0F - a) * lower[x] + a * lower[x + 1]);
      }
    }
    float sum = 0.0F;
    for (size_t y = 0; y < static_cast<size_t>(width_); ++y) {
      const auto &above = wide[y], &here = wide[y + 1], &below = wide[y + 2];
      for (int x = 0; x < kPitch; ++x) {
        x_[y][x] = (3.0F * (above[x + 2] - above[x] + below[x + 2] - below[x]) +
                    10.0F * (here[x + 2] - here[x])) /
                   32.0F;
        y_[y][x] = (3.0F * (below[x] - above[x] + below[x + 2] - above[x + 2]) +
                    10.0F * (below[x + 1] - above[x + 1])) /
                   32.0F;
        grey_[y][x] = here[x + 1];
      }
      sum += grey_[y].head(width_).sum();
    }
    const float mean = sum / static_cast<float>(width_ * width_);
    for (size_t y = 0; y < static_cast<size_t>(width_); ++y) {
      gain_[y] = (grey_[y] - mean) / 32.0F;
    }
  }

  const int width_;
  Row edge_, weight_;  // s or t; along one side
  Rows grey_, x_, y_, gain_;
};

}  // namespace

std::optional<AlignedPatch> AlignPatch(const cv::Mat& before, const Eigen::Vector2d& px_before,
                                       const cv::Mat& after, const Eigen::Vector2d& guess,
                                       int window_px) {
  if (window_px < 3 || window_px > kMaxPatchPx || window_px % 2 == 0) return std::nullopt;
  const int half = window_px / 2;
  const auto reach = static_cast<float>(half);
  const Eigen::Vector2f from = px_before.cast<float>();
  if (!Inside(before, from, reach + 1.0F)) return std::nullopt;
  const Template patch(before, from, window_px);

  const float prior = std::pow(kGreySigma / (kWarpSigma * reach), 2.0F);
  Information information = patch.NormalMatrix();
  information.diagonal().segment<4>(2).array() += prior;
  information.diagonal().tail<2>().array() += 1e-3F;
  const Eigen::LLT<Information> llt(information);
  if (llt.info() != Eigen::Success) return std::nullopt;

  // after(px + warp * offset) = before(px_before + offset)
  Eigen::Matrix2f warp = Eigen::Matrix2f::Identity();
  Eigen::Vector2f px = guess.cast<float>();
  bool converged = false;
  for (int iteration = 0; iteration < kMaxIterations && !converged; ++iteration) {
    const float corner = reach * warp.cwiseAbs().rowwise().sum().maxCoeff();
    if (!(corner < 2.0F * reach) || !Inside(after, px, corner)) return std::nullopt;
    Template::RightSide right_side(patch);
    for (int y = 0; y < window_px; ++y) {
      const Eigen::Vector2f begin =
          px + warp * Eigen::Vector2f(-reach, static_cast<float>(y) - reach);
      right_side.Add(y, SampleRow(after, begin, warp.col(0), window_px) - patch.grey(y));
    }
    Parameters right = right_side.Sum();
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
  aligned.covariance = patch.Covariance(llt.solve(unit));
  return aligned;
}

}  // namespace camgyro
