#include "frontend/gyro_spikes.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/format.h"
#include "core/robust_statistics.h"
#include "core/time.h"
#include "frontend/readers/recording_checks.h"

namespace camgyro {
namespace {

// Samples whose scale is told together; that around a sample is of three such blocks.
constexpr size_t kBlock = 100;
// Of the scale [rad/s]: spikes of twenty times that, for a sample, turn a camera by less than a
// pixel.
constexpr double kLeastScale = 0.002;
// How well the neighbours agree, and how little the samples beyond them bend, in parts of the
// spike. A short movement, or a knock, of a device that rests otherwise bends there as well.
constexpr double kAgree = 0.25, kBeyond = 0.2;
constexpr size_t kReach = 3;

// How far sample i is from the middle of those next to it, about each axis.
Eigen::Vector3d Bend(const std::vector<GyroSample>& gyro, size_t i) {
  return gyro[i].omega_gyro_rad_s -
         0.5 * (gyro[i - 1].omega_gyro_rad_s + gyro[i + 1].omega_gyro_rad_s);
}

// Robust standard deviation of the bends of samples begin to end, about each axis.
Eigen::Vector3d ScaleOf(const std::vector<GyroSample>& gyro, size_t begin, size_t end) {
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> sizes;
    for (size_t i = std::max<size_t>(begin, 1); i < std::min(end, gyro.size() - 1); ++i) {
      sizes.push_back(std::abs(Bend(gyro, i)[axis]));
    }
    scale[axis] = kSigmaOfMedian * MedianOr(std::move(sizes), 0.0);
  }
  return scale;
}

bool IsSpike(const std::vector<GyroSample>& gyro, size_t i, const Eigen::Vector3d& scale) {
  const Eigen::Array3d size = Bend(gyro, i).cwiseAbs();
  if (!(size > kSpikeScales * scale.array()).any()) return false;
  const Eigen::Array3d disagree =
      (gyro[i + 1].omega_gyro_rad_s - gyro[i - 1].omega_gyro_rad_s).cwiseAbs();
  Eigen::Array3d beyond = Eigen::Array3d::Zero();
  for (size_t k = 2; k <= kReach; ++k) {
    beyond = beyond.max(Bend(gyro, i - k).array().abs()).max(Bend(gyro, i + k).array().abs());
  }
  return (size > kSpikeScales * scale.array() && disagree < kAgree * size &&
          beyond < kBeyond * size)
      .any();
}

}  // namespace

std::vector<size_t> FindSpikes(const std::vector<GyroSample>& gyro) {
  std::vector<size_t> spikes;
  if (gyro.size() < kBlock) return spikes;
  const Eigen::Vector3d of_all = ScaleOf(gyro, 0, gyro.size());
  Eigen::Vector3d scale;
  size_t scale_until = 0;
  for (size_t i = kReach + 1; i + kReach + 1 < gyro.size(); ++i) {
    if (i >= scale_until) {
      const size_t block = i / kBlock * kBlock;
      scale = ScaleOf(gyro, block - std::min(block, kBlock), block + 2 * kBlock)
                  .cwiseMax(of_all)
                  .cwiseMax(kLeastScale);
      scale_until = block + kBlock;
    }
    if (!IsSpike(gyro, i, scale)) continue;
    spikes.push_back(i);
    ++i;  // the next one is right
  }
  return spikes;
}

void MendSpikes(Recording* recording) {
  std::vector<GyroSample>& gyro = recording->gyro;
  const std::vector<size_t> spikes = FindSpikes(gyro);
  std::set<int64_t> places;
  for (const size_t i : spikes) places.insert(gyro[i].stamp_ns / 1'000'000'000);
  if (places.size() < kLeastPlaces) return;

  const double first_s = SecondsSince(gyro.front().stamp_ns, gyro[spikes.front()].stamp_ns);
  for (const size_t i : spikes) {
    const GyroSample &before = gyro[i - 1], &after = gyro[i + 1];
    const double part = SecondsSince(before.stamp_ns, gyro[i].stamp_ns) /
                        SecondsSince(before.stamp_ns, after.stamp_ns);
    gyro[i].omega_gyro_rad_s =
        (1.0 - part) * before.omega_gyro_rad_s + part * after.omega_gyro_rad_s;
  }
  AddFault("gyro_spikes", static_cast<int>(spikes.size()),
           Format("%zu of %zu gyro samples jump away from those around them and back, the first "
                  "%.2f s after the first sample; the line between those around them is in their "
                  "place",
                  spikes.size(), gyro.size(), first_s),
           recording);
}

}  // namespace camgyro
