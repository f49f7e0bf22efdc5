// The maps that StructureMaps evaluates, each as an effect with a parameter per cell.

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "estimator/diagnosis/structure.h"

namespace camgyro {
namespace {

// Cells: fine enough to show a shape, and with enough matches in each.
constexpr int kColumns = 6, kRows = 4;  // of the image
constexpr int kRowBins = 8;
constexpr int kValueBins = 5;      // of a rate, an acceleration, an exposure
constexpr double kTimeBinS = 1.0;  // of time, within these numbers of bins
constexpr int kLeastTimeBins = 4, kMostTimeBins = 40;
// Standard deviations of the weak priors of a cell: several times what real devices show.
constexpr double kShiftSpreadPx = 3.0, kRowDelaySpreadS = 5e-3, kTimeDelaySpreadS = 0.02,
                 kFocalSpreadPx = 20.0, kRateSpreadRadS = 0.05;
constexpr double kSlopeReachS = 0.015;    // of the differences that make an angular acceleration
constexpr size_t kLeastRates = 100;       // samples while the camera ran
constexpr double kLeastVariation = 1.02;  // of an interval or an exposure, largest bin over least

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

class MapMaker {
 public:
  MapMaker(const EffectSetup& setup, EffectSet* set, std::vector<StructureMap>* maps)
      : setup_(setup),
        from_s_(setup.from_s()),
        to_s_(setup.to_s()),
        time_bins_(std::clamp(static_cast<int>((to_s_ - from_s_) / kTimeBinS), kLeastTimeBins,
                              kMostTimeBins)),
        set_(*set),
        maps_(*maps) {}

  void AddImage() {
    StructureMap map;
    map.name = "shift over the image";
    map.unit = "px";
    map.shape = {kRows, kColumns};
    Add(
        map, 2 * kRows * kColumns, kShiftSpreadPx,
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
  }

  void AddRows() {
    StructureMap map;
    map.name = "delay over the rows";
    map.unit = "s";
    map.shape = {kRowBins};
    for (int i = 0; i < kRowBins; ++i) {
      map.axis.push_back(i * setup_.size_px.y() / (kRowBins - 1));
    }
    map.axis_unit = "row [px]";
    Add(
        map, kRowBins, kRowDelaySpreadS, nullptr,
        [](const Observation& o, TimeColumns c) {
          const Hat y(o.px.y(), o.size_px.y(), kRowBins);
          for (int i = 0; i < 2; ++i) {
            c(0, y.first + i) = y.weight[i];
            c(2, y.first + i) = y.slope[i];
          }
        },
        nullptr);
  }

  void AddTime() {
    const auto bin = [from = from_s_, to = to_s_, bins = time_bins_](double time_s) {
      return Bin(time_s, from, to, bins);
    };
    StructureMap map = OverTime("delay over time", "s");
    map.kind = MapKind::kDelayOverTime;
    Add(
        map, time_bins_, kTimeDelaySpreadS, nullptr,
        [bin, delay = setup_.delay_s](const Observation& o, TimeColumns c) {
          c(0, bin(o.frame.stamp_s + delay)) = 1.0;
        },
        nullptr);
    if (setup_.has_pixels) {
      Add(
          OverTime("focal length over time", "px"), time_bins_, kFocalSpreadPx,
          [bin, delay = setup_.delay_s](const Observation& o, LensColumns c, LensColumns,
                                        LensColumns) {
            c(kFocal, bin(o.frame.stamp_s + delay)) = 1.0;
          },
          nullptr, nullptr);
    }
    map = OverTime("rate error over time", "rad/s");
    map.shape = {time_bins_, 3};
    Add(map, 3 * time_bins_, kRateSpreadRadS, nullptr, nullptr,
        [bin](double t, const Eigen::Vector3d&, RateColumns c) {
          c.middleCols<3>(3 * bin(t)).setIdentity();
        });
  }

  // Over the rates and their slopes while the camera ran. False if they are too few.
  bool AddRates(const Eigen::Vector3d& bias_rad_s) {
    const std::vector<double>& times_s = setup_.gyro->times_s;
    const Eigen::Matrix3Xd& readings = setup_.gyro->values;
    const auto n = static_cast<Eigen::Index>(times_s.size());
    std::array<std::vector<double>, 3> rates, slopes;
    const double interval = (times_s.back() - times_s.front()) / (n - 1.0);
    const auto reach = std::max<Eigen::Index>(1, std::llround(kSlopeReachS / interval));
    const auto slope_at = [gyro = setup_.gyro, reach, n](Eigen::Index i) -> Eigen::Vector3d {
      if (i < reach || i + reach >= n) return Eigen::Vector3d::Zero();
      const auto before = static_cast<size_t>(i - reach), after = static_cast<size_t>(i + reach);
      return (gyro->values.col(i + reach) - gyro->values.col(i - reach)) /
             (gyro->times_s[after] - gyro->times_s[before]);
    };
    for (Eigen::Index i = reach; i + reach < n; ++i) {
      const double time_s = times_s[static_cast<size_t>(i)];
      if (time_s < from_s_ || time_s > to_s_) continue;
      const Eigen::Vector3d slope = slope_at(i);
      for (size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        rates[k].push_back(readings(axis, i) - bias_rad_s[axis]);
        slopes[k].push_back(slope[axis]);
      }
    }
    if (rates[0].size() < kLeastRates) return false;
    AddOverValue("rate error over the rate", "rate about x [rad/s]", rates,
                 [](double, const Eigen::Vector3d& w) { return w; });
    AddOverValue("rate error over the angular acceleration", "slope of the rate about x [rad/s^2]",
                 slopes, [slope_at, gyro = setup_.gyro, n](double t, const Eigen::Vector3d&) {
                   const auto it =
                       std::lower_bound(gyro->times_s.begin(), gyro->times_s.end(), t - 1e-9);
                   return slope_at(std::min(it - gyro->times_s.begin(), n - 1));
                 });
    return true;
  }

  // What comes with a frame: the interval before it, its exposure.
  void AddFrames(bool with_intervals) {
    std::vector<double> intervals, exposures;
    for (size_t i = 0; i < setup_.frames.size(); ++i) {
      const size_t next = std::max<size_t>(1, i);
      intervals.push_back(setup_.frames[next].stamp_s - setup_.frames[next - 1].stamp_s);
      if (std::isfinite(setup_.frames[i].exposure_s)) {
        exposures.push_back(setup_.frames[i].exposure_s);
      }
    }
    if (with_intervals) {
      AddOverFrameValue("delay over the frame interval", "interval [s]", intervals);
    }
    if (exposures.size() == setup_.frames.size()) {
      AddOverFrameValue("delay over the exposure", "exposure [s]", exposures);
    }
  }

 private:
  void Add(StructureMap map, int cells, double spread, LensFunction lens, TimeFunction time,
           RateFunction rate) {
    static const EffectEntry entry = {"structure", ModelPart::kPicture, "", ""};
    set_.Add(
        &entry, map.name,
        std::make_shared<Cells>(cells, spread, std::move(lens), std::move(time), std::move(rate)));
    maps_.push_back(std::move(map));
  }

  StructureMap OverTime(const std::string& name, const std::string& unit) const {
    StructureMap map;
    map.name = name;
    map.unit = unit;
    map.shape = {time_bins_};
    map.axis = EvenMiddles(from_s_, to_s_, time_bins_);
    map.axis_unit = "time [s]";
    return map;
  }

  template <typename ValueAt>
  void AddOverValue(const std::string& name, const std::string& axis_unit,
                    const std::array<std::vector<double>, 3>& values, ValueAt value_at) {
    std::array<std::vector<double>, 3> borders;
    StructureMap map;
    map.name = name;
    map.unit = "rad/s";
    map.shape = {kValueBins, 3};
    map.axis_unit = axis_unit;
    map.axis = Middles(values[0], kValueBins);
    for (size_t k = 0; k < 3; ++k) borders[k] = Quantiles(values[k], kValueBins);
    Add(map, 3 * kValueBins, kRateSpreadRadS, nullptr, nullptr,
        [borders, value_at](double t, const Eigen::Vector3d& w, RateColumns c) {
          const Eigen::Vector3d value = value_at(t, w);
          for (int k = 0; k < 3; ++k) {
            c(k, 3 * BinOf(borders[static_cast<size_t>(k)], value[k]) + k) = 1.0;
          }
        });
  }

  void AddOverFrameValue(const std::string& name, const std::string& axis_unit,
                         const std::vector<double>& values) {
    const std::vector<double> borders = Quantiles(values, kValueBins);
    if (!(borders.back() > kLeastVariation * borders.front())) return;
    std::vector<double> stamps;
    for (const FrameTime& frame : setup_.frames) stamps.push_back(frame.stamp_s);
    StructureMap map;
    map.name = name;
    map.unit = "s";
    map.shape = {kValueBins};
    map.axis = Middles(values, kValueBins);
    map.axis_unit = axis_unit;
    Add(
        map, kValueBins, kRowDelaySpreadS, nullptr,
        [borders, stamps, values](const Observation& o, TimeColumns c) {
          const auto it = std::lower_bound(stamps.begin(), stamps.end(), o.frame.stamp_s - 1e-9);
          if (it == stamps.end()) return;
          c(0, BinOf(borders, values[static_cast<size_t>(it - stamps.begin())])) = 1.0;
        },
        nullptr);
  }

  const EffectSetup& setup_;
  const double from_s_, to_s_;
  const int time_bins_;
  EffectSet& set_;
  std::vector<StructureMap>& maps_;
};

}  // namespace

StructureMaps::StructureMaps(const EffectSetup& setup, const Eigen::Vector3d& bias_rad_s,
                             bool frames_have_times)
    : set_(std::make_shared<EffectSet>()) {
  MapMaker maker(setup, set_.get(), &maps_);
  if (setup.has_pixels) {
    maker.AddImage();
    maker.AddRows();
  }
  maker.AddTime();
  if (maker.AddRates(bias_rad_s)) maker.AddFrames(!frames_have_times);
}

}  // namespace camgyro
