#include "estimator/diagnosis/structure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace camgyro {
namespace {

constexpr int kColumns = 6, kRows = 4;  // cells of the image
constexpr int kRowBins = 8;
constexpr int kValueBins = 5;  // of a rate, an acceleration, an exposure

// Also the derivatives by u and v.
using LensFunction = std::function<void(const Observation&, LensColumns, LensColumns, LensColumns)>;
using TimeFunction = std::function<void(const Observation&, TimeColumns)>;
using RateFunction = std::function<void(double, const Eigen::Vector3d&, RateColumns)>;

// A map as an effect: one parameter per cell. Weak priors of the given spread.
class Cells final : public Effect {
 public:
  Cells(int cells, double spread, LensFunction lens, TimeFunction time, RateFunction rate)
      : Effect(std::vector<EffectParameter>(static_cast<size_t>(cells),
                                            {"cell", "", spread, -1e9, 1e9})),
        lens_(std::move(lens)),
        time_(std::move(time)),
        rate_(std::move(rate)) {}
  void ChangeLens(const Observation& o, LensColumns c) const override {
    if (!lens_) return;
    Eigen::Matrix<double, kLensSize, Eigen::Dynamic> slope(kLensSize, 2 * size());
    lens_(o, c, slope.leftCols(size()), slope.rightCols(size()));
  }
  void ChangeLensSlope(const Observation& o, LensColumns by_u, LensColumns by_v) const override {
    if (!lens_) return;
    Eigen::Matrix<double, kLensSize, Eigen::Dynamic> c(kLensSize, size());
    lens_(o, c, by_u, by_v);
  }
  bool has_lens_slope() const override { return lens_ != nullptr; }
  void ChangeTime(const Observation& o, TimeColumns c) const override {
    if (time_) time_(o, c);
  }
  void ChangeRate(double t, const Eigen::Vector3d& w, RateColumns c) const override {
    if (rate_) rate_(t, w, c);
  }

 private:
  const LensFunction lens_;
  const TimeFunction time_;
  const RateFunction rate_;
};

int Bin(double value, double low, double high, int bins) {
  return std::clamp(static_cast<int>(bins * (value - low) / (high - low)), 0, bins - 1);
}

// Linear interpolation between `nodes` even nodes from 0 to `size`. Pixels go through the slope, as
// the noise does: with steps from cell to cell, clean data showed a pattern at p = 3e-8.
struct Hat {
  Hat(double value, double size, int nodes) {
    const double x = std::clamp(value / size * (nodes - 1), 0.0, nodes - 1 - 1e-9);
    first = static_cast<int>(x);
    weight[1] = x - first;
    weight[0] = 1.0 - weight[1];
    slope[1] = (nodes - 1) / size;
    slope[0] = -slope[1];
  }
  int first;
  double weight[2], slope[2];
};

// Borders of bins with equal shares of some values.
std::vector<double> Quantiles(std::vector<double> values, int bins) {
  std::sort(values.begin(), values.end());
  std::vector<double> borders;
  for (int i = 1; i < bins; ++i) {
    borders.push_back(values[values.size() * static_cast<size_t>(i) / static_cast<size_t>(bins)]);
  }
  return borders;
}
int BinOf(const std::vector<double>& borders, double value) {
  return static_cast<int>(std::upper_bound(borders.begin(), borders.end(), value) -
                          borders.begin());
}
// Middles of bins, for the axis: the quantiles between the borders.
std::vector<double> Middles(std::vector<double> values, int bins) {
  std::sort(values.begin(), values.end());
  std::vector<double> middles;
  for (int i = 0; i < bins; ++i) {
    middles.push_back(
        values[values.size() * static_cast<size_t>(2 * i + 1) / static_cast<size_t>(2 * bins)]);
  }
  return middles;
}

std::vector<double> EvenMiddles(double low, double high, int bins) {
  std::vector<double> middles;
  for (int i = 0; i < bins; ++i) middles.push_back(low + (i + 0.5) * (high - low) / bins);
  return middles;
}

// chi2 per residual, block by block, against that of the blocks that fit well (the lower quartile).
// Where the model is so far off that the loss takes everything for outliers, nothing else shows.
StructureMap MisfitOverTime(const Scores& scores) {
  constexpr double kOverdispersion = 4.0;  // wrong matches come in flocks
  StructureMap map;
  map.name = "misfit over time";
  map.unit = "chi2/dof";
  map.axis_unit = "time [s]";
  std::vector<double> values, sigmas;
  for (const BlockScore& block : scores.blocks) {
    if (block.residuals < 1) continue;
    map.axis.push_back(block.time_s);
    values.push_back(block.chi2 / block.residuals);
    sigmas.push_back(std::sqrt(2.0 * kOverdispersion / block.residuals));
  }
  const auto n = static_cast<Eigen::Index>(values.size());
  map.shape = {static_cast<int>(n)};
  map.value = Eigen::Map<const Eigen::VectorXd>(values.data(), n);
  map.sigma = Eigen::Map<const Eigen::VectorXd>(sigmas.data(), n).cwiseProduct(map.value);
  if (n < 4) return map;
  map.dof = static_cast<int>(n);
  map.inflation = kOverdispersion;
  std::sort(values.begin(), values.end());
  const double good = values[values.size() / 4];
  for (Eigen::Index i = 0; i < n; ++i) {
    const double sigma = sigmas[static_cast<size_t>(i)];
    const double z = (map.value[i] / good - 1.0) / sigma;
    map.statistic = std::max(map.statistic, map.value[i] / good);
    map.p_value = std::min(map.p_value, static_cast<double>(n) * ChiSquareTail(z * std::abs(z), 1));
  }
  return map;
}

}  // namespace

StructureMaps::StructureMaps(const EffectSetup& setup, const Eigen::Vector3d& bias_rad_s)
    : set_(std::make_shared<EffectSet>()) {
  static const EffectEntry entry = {"structure", ModelPart::kPicture, "", "", {}, {}};
  const auto add = [&](StructureMap map, int cells, double spread, LensFunction lens,
                       TimeFunction time, RateFunction rate) {
    set_->Add(
        &entry, map.name,
        std::make_shared<Cells>(cells, spread, std::move(lens), std::move(time), std::move(rate)));
    maps_.push_back(std::move(map));
  };
  StructureMap map;
  if (setup.has_pixels) {
    map.name = "shift over the image";
    map.unit = "px";
    map.shape = {kRows, kColumns};
    add(
        map, 2 * kRows * kColumns, 3.0,
        [](const Observation& o, LensColumns c, LensColumns by_u, LensColumns by_v) {
          const Hat x(o.px.x(), o.size_px.x(), kColumns), y(o.px.y(), o.size_px.y(), kRows);
          for (int i = 0; i < 2; ++i) {
            for (int k = 0; k < 2; ++k) {
              const int cell = 2 * (kColumns * (y.first + i) + x.first + k);
              c(kCx, cell) = c(kCy, cell + 1) = y.weight[i] * x.weight[k];
              by_u(kCx, cell) = by_u(kCy, cell + 1) = y.weight[i] * x.slope[k];
              by_v(kCx, cell) = by_v(kCy, cell + 1) = y.slope[i] * x.weight[k];
            }
          }
        },
        nullptr, nullptr);
    map = {};
    map.name = "delay over the rows";
    map.unit = "s";
    map.shape = {kRowBins};
    for (int i = 0; i < kRowBins; ++i) {
      map.axis.push_back(i * setup.size_px.y() / (kRowBins - 1));
    }
    map.axis_unit = "row [px]";
    add(
        map, kRowBins, 5e-3, nullptr,
        [](const Observation& o, TimeColumns c) {
          const Hat y(o.px.y(), o.size_px.y(), kRowBins);
          for (int i = 0; i < 2; ++i) {
            c(0, y.first + i) = y.weight[i];
            c(2, y.first + i) = y.slope[i];
          }
        },
        nullptr);
  }
  const double from_s = setup.from_s(), to_s = setup.to_s();
  const int time_bins = std::clamp(static_cast<int>((to_s - from_s) / 1.0), 4, 40);
  map = {};
  map.name = "delay over time";
  map.unit = "s";
  map.shape = {time_bins};
  map.axis = EvenMiddles(from_s, to_s, time_bins);
  map.axis_unit = "time [s]";
  add(
      map, time_bins, 0.02, nullptr,
      [=, delay = setup.delay_s](const Observation& o, TimeColumns c) {
        c(0, Bin(o.frame.stamp_s + delay, from_s, to_s, time_bins)) = 1.0;
      },
      nullptr);
  if (setup.has_pixels) {
    map.name = "focal length over time";
    map.unit = "px";
    add(
        map, time_bins, 20.0,
        [=, delay = setup.delay_s](const Observation& o, LensColumns c, LensColumns, LensColumns) {
          c(kFocal, Bin(o.frame.stamp_s + delay, from_s, to_s, time_bins)) = 1.0;
        },
        nullptr, nullptr);
  }
  map.name = "rate error over time";
  map.unit = "rad/s";
  map.shape = {time_bins, 3};
  add(map, 3 * time_bins, 0.05, nullptr, nullptr,
      [=](double t, const Eigen::Vector3d&, RateColumns c) {
        c.middleCols<3>(3 * Bin(t, from_s, to_s, time_bins)).setIdentity();
      });

  // The rates and their slopes while the camera ran.
  const auto n = static_cast<Eigen::Index>(setup.gyro_times_s.size());
  std::array<std::vector<double>, 3> rates, slopes;
  Eigen::Matrix3Xd slope = Eigen::Matrix3Xd::Zero(3, n);
  const double interval = (setup.gyro_times_s.back() - setup.gyro_times_s.front()) / (n - 1.0);
  const auto reach = std::max<Eigen::Index>(1, std::llround(0.015 / interval));
  for (Eigen::Index i = reach; i + reach < n; ++i) {
    const auto at = static_cast<size_t>(i), step = static_cast<size_t>(reach);
    slope.col(i) = (setup.gyro_rad_s.col(i + reach) - setup.gyro_rad_s.col(i - reach)) /
                   (setup.gyro_times_s[at + step] - setup.gyro_times_s[at - step]);
    if (setup.gyro_times_s[at] < from_s || setup.gyro_times_s[at] > to_s) continue;
    for (size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      rates[k].push_back(setup.gyro_rad_s(axis, i) - bias_rad_s[axis]);
      slopes[k].push_back(slope(axis, i));
    }
  }
  if (rates[0].size() < 100) return;
  const auto add_value_map = [&](const std::string& name, const std::string& axis_unit,
                                 const std::array<std::vector<double>, 3>& values, auto value_at) {
    std::array<std::vector<double>, 3> borders;
    StructureMap by_value;
    by_value.name = name;
    by_value.unit = "rad/s";
    by_value.shape = {kValueBins, 3};
    by_value.axis_unit = axis_unit;
    by_value.axis = Middles(values[0], kValueBins);
    for (size_t k = 0; k < 3; ++k) borders[k] = Quantiles(values[k], kValueBins);
    add(by_value, 3 * kValueBins, 0.05, nullptr, nullptr,
        [borders, value_at](double t, const Eigen::Vector3d& w, RateColumns c) {
          const Eigen::Vector3d value = value_at(t, w);
          for (int k = 0; k < 3; ++k) {
            c(k, 3 * BinOf(borders[static_cast<size_t>(k)], value[k]) + k) = 1.0;
          }
        });
  };
  add_value_map("rate error over the rate", "rate about x [rad/s]", rates,
                [](double, const Eigen::Vector3d& w) { return w; });
  add_value_map(
      "rate error over the angular acceleration", "slope of the rate about x [rad/s^2]", slopes,
      [slope, times = setup.gyro_times_s](double t, const Eigen::Vector3d&) {
        const auto it = std::lower_bound(times.begin(), times.end(), t - 1e-9);
        const auto last = static_cast<Eigen::Index>(times.size()) - 1;
        return Eigen::Vector3d(slope.col(std::min<Eigen::Index>(it - times.begin(), last)));
      });

  // What comes with a frame: the interval before it, its exposure.
  const auto add_frame_map = [&](const std::string& name, const std::string& axis_unit,
                                 const std::vector<double>& values) {
    const std::vector<double> borders = Quantiles(values, kValueBins);
    if (!(borders.back() > 1.02 * borders.front())) return;  // does not vary
    std::vector<double> stamps;
    for (const FrameTime& frame : setup.frames) stamps.push_back(frame.stamp_s);
    StructureMap by_frame;
    by_frame.name = name;
    by_frame.unit = "s";
    by_frame.shape = {kValueBins};
    by_frame.axis = Middles(values, kValueBins);
    by_frame.axis_unit = axis_unit;
    add(
        by_frame, kValueBins, 5e-3, nullptr,
        [borders, stamps, values](const Observation& o, TimeColumns c) {
          const auto it = std::lower_bound(stamps.begin(), stamps.end(), o.frame.stamp_s - 1e-9);
          if (it == stamps.end()) return;
          c(0, BinOf(borders, values[static_cast<size_t>(it - stamps.begin())])) = 1.0;
        },
        nullptr);
  };
  std::vector<double> intervals, exposures;
  for (size_t i = 0; i < setup.frames.size(); ++i) {
    const size_t next = std::max<size_t>(1, i);
    intervals.push_back(setup.frames[next].stamp_s - setup.frames[next - 1].stamp_s);
    if (std::isfinite(setup.frames[i].exposure_s)) exposures.push_back(setup.frames[i].exposure_s);
  }
  add_frame_map("delay over the frame interval", "interval [s]", intervals);
  if (exposures.size() == setup.frames.size()) {
    add_frame_map("delay over the exposure", "exposure [s]", exposures);
  }
}

std::vector<StructureMap> StructureMaps::Evaluate(const Scores& scores, int first,
                                                  const Eigen::VectorXd& prior_information) const {
  std::vector<StructureMap> maps = maps_;
  for (size_t m = 0; m < maps.size(); ++m) {
    const EffectSet::Item& item = set_->items()[m];
    std::vector<int> columns;
    for (int i = 0; i < item.effect->size(); ++i) columns.push_back(first + item.first + i);
    const ScoreTest test = TestColumns(scores, columns, prior_information);
    maps[m].value = test.estimate;
    if (test.dof > 0) maps[m].sigma = test.covariance.diagonal().cwiseSqrt();
    maps[m].statistic = test.statistic;
    maps[m].dof = test.dof;
    maps[m].p_value = test.p_value;
    maps[m].inflation = test.inflation;
  }
  if (!scores.blocks.empty()) maps.push_back(MisfitOverTime(scores));
  // The delay frame by frame: one value per pair, whose scatter is compared with its noise.
  if (!scores.pairs.empty()) {
    const ScoreTest test = TestDelayOfPairs(scores, prior_information);
    StructureMap map;
    map.name = "delay frame by frame";
    map.unit = "s";
    map.shape = {static_cast<int>(test.estimate.size())};
    map.axis_unit = "time [s]";
    for (const PairScore& pair : scores.pairs) map.axis.push_back(pair.time_s);
    map.value = test.estimate;
    map.sigma = test.covariance.col(0);
    map.statistic = test.statistic;
    map.dof = test.dof;
    map.p_value = test.p_value;
    map.inflation = test.inflation;
    maps.push_back(std::move(map));
  }
  return maps;
}

}  // namespace camgyro
