#include "estimator/diagnosis/refused_start.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "core/effects/catalogue.h"
#include "core/format.h"
#include "core/robust_statistics.h"
#include "core/so3.h"
#include "core/time.h"
#include "core/usual_focal.h"
#include "estimator/start/lag_search.h"

namespace camgyro {
namespace {

// Frame rates of cameras over the 24, 25, 30 or 60 per second at which their pictures are played.
// What lies two percent beside these, the start finds (clock_rate.h).
constexpr std::array<double, 16> kSlowMotions = {1.2, 1.25, 1.5, 2.0,  2.4,  2.5,  4.0,  4.8,
                                                 5.0, 8.0,  9.6, 10.0, 16.0, 20.0, 32.0, 40.0};

// Of the gyro's motion, explained by the camera's, for a repair to be one.
constexpr double kRepaired = 0.8;

// Means over so long are slow motion [s].
constexpr double kSlowS = 4.0;

// What of the gyro's slow motion a picture has to explain, for one without the fast motion. Slow
// motion that is not the gyro's explains some 0.8 kSlowS / length by chance, and at most 1.2, or
// 0.25 of 12 s; a stabilised picture 0.41 to 0.59, and one smoothed over 2 s 0.25. (Trials without
// a commit: walking, running and in the hand, 12 to 60 s, two seeds.)
double LeastSlowlyExplained(double length_s) {
  return std::min(1.0 / 3.0, 1.5 * kSlowS / length_s);
}

// Power of rates in a band, by differences of moving averages; rates and the times between them.
double BandPower(const std::vector<Eigen::Vector3d>& rates, int shorter, int longer) {
  const int n = static_cast<int>(rates.size());
  const auto mean = [&](int at, int width) {
    const int from = std::max(0, at - width / 2), to = std::min(n, at - width / 2 + width);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = from; i < to; ++i) sum += rates[static_cast<size_t>(i)];
    return Eigen::Vector3d(sum / std::max(1, to - from));
  };
  std::vector<double> power;  // the median forgives wrong rotations of the camera
  for (int i = longer / 2; i + longer / 2 < n; ++i) {
    power.push_back((mean(i, shorter) - mean(i, longer)).squaredNorm());
  }
  return power.empty() ? 0.0 : MedianInPlace(&power);
}

// Mean over some seconds around each.
template <typename Item, typename TimeOf, typename VectorOf>
std::vector<Eigen::Vector3d> Smoothed(const std::vector<Item>& items, double seconds,
                                      const TimeOf& time_of, const VectorOf& vector_of) {
  std::vector<Eigen::Vector3d> means;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  size_t begin = 0, end = 0;
  for (const Item& item : items) {
    for (; end < items.size() && time_of(items[end]) <= time_of(item) + 0.5 * seconds; ++end) {
      sum += vector_of(items[end]);
    }
    for (; time_of(items[begin]) < time_of(item) - 0.5 * seconds; ++begin) {
      sum -= vector_of(items[begin]);
    }
    means.push_back(sum / static_cast<double>(end - begin));
  }
  return means;
}

// What a start needs.
Recording OutlineForStart(const Recording& recording) {
  Recording outline;
  outline.camera = recording.camera;
  outline.frames = recording.frames;
  outline.gyro = recording.gyro;
  outline.accel = recording.accel;
  return outline;
}

// Is the camera's slow rotation the gyro's? Means of a body's rates over the same time are to each
// other as the rates are.
bool FollowsSlowly(const Recording& of, std::vector<CameraRotation> rotations) {
  Recording recording = OutlineForStart(of);
  const int64_t origin_ns = recording.gyro.front().stamp_ns;
  const std::vector<Eigen::Vector3d> of_gyro = Smoothed(
      recording.gyro, kSlowS,
      [&](const GyroSample& sample) { return SecondsSince(origin_ns, sample.stamp_ns); },
      [](const GyroSample& sample) { return sample.omega_gyro_rad_s; });
  for (size_t i = 0; i < of_gyro.size(); ++i) recording.gyro[i].omega_gyro_rad_s = of_gyro[i];
  const auto stamp_s = [&](int frame) {
    return SecondsSince(origin_ns, recording.frames[static_cast<size_t>(frame)].stamp_ns);
  };
  const auto length_s = [&](const CameraRotation& r) {
    return stamp_s(r.frame_b) - stamp_s(r.frame_a);
  };
  const std::vector<Eigen::Vector3d> of_camera = Smoothed(
      rotations, kSlowS,
      [&](const CameraRotation& r) { return 0.5 * (stamp_s(r.frame_a) + stamp_s(r.frame_b)); },
      [&](const CameraRotation& r) { return Eigen::Vector3d(Log(r.q_a_b) / length_s(r)); });
  for (size_t i = 0; i < of_camera.size(); ++i) {
    rotations[i].q_a_b = Exp(Eigen::Vector3d(of_camera[i] * length_s(rotations[i])));
  }
  const GyroRates gyro(recording.gyro);
  const auto camera = MakeCameraRates(recording, rotations, gyro);
  if (!camera || camera->size() < 2) return false;
  const StartOptions usual;
  const double guess_s = recording.camera.delay_s.value_or(0.0) -
                         SecondsSince(recording.frames.front().stamp_ns, origin_ns);
  const LagSearch search = SearchLag(RateAlignment(gyro, *camera), guess_s - usual.search_s,
                                     guess_s + usual.search_s, usual.min_pairs);
  const double step_s = (stamp_s(rotations.back().frame_a) - stamp_s(rotations.front().frame_a)) /
                        static_cast<double>(rotations.size() - 1);
  return search.found && search.best.explained > LeastSlowlyExplained(step_s * search.best.pairs);
}

// A way in which a recording may be other than its format says.
struct Repair {
  std::string name, finding, advice;
  std::function<void(Recording*)> apply;
  double stretch = 1.0;  // of the frames' stamps over the gyro's, undone by `apply`
};

void ScaleRates(double scale, Recording* recording) {
  for (GyroSample& sample : recording->gyro) sample.omega_gyro_rad_s *= scale;
}

void ExchangeWithAccelerometer(Recording* recording) {
  std::vector<AccelSample> accel;
  for (const GyroSample& sample : recording->gyro) {
    accel.push_back({sample.stamp_ns, sample.omega_gyro_rad_s});
  }
  recording->gyro.clear();
  for (const AccelSample& sample : recording->accel) {
    recording->gyro.push_back({sample.stamp_ns, sample.accel_gyro_m_s2});
  }
  recording->accel = std::move(accel);
}

template <typename Stamped>
void StretchStamps(double factor, std::vector<Stamped>* items) {
  if (items->empty()) return;
  const int64_t first_ns = items->front().stamp_ns;
  for (Stamped& item : *items) {
    item.stamp_ns = StampAt(first_ns, factor * SecondsSince(first_ns, item.stamp_ns));
  }
}

std::vector<Repair> RepairsOfGyro(const Recording& recording) {
  constexpr double kDegree = M_PI / 180.0;
  // One axis mirrored is all of them mirrored, and a rotation.
  std::vector<Repair> repairs = {
      {"gyro_unit", "the gyro's rates are in deg/s, not rad/s",
       "convert them to rad/s in the recording", [](Recording* r) { ScaleRates(kDegree, r); }},
      {"gyro_unit", "the gyro's rates were divided by 57.3 once too often",
       "convert from deg/s to rad/s only once", [](Recording* r) { ScaleRates(1.0 / kDegree, r); }},
      {"gyro_axes",
       "the gyro's axes are left-handed: two axes are exchanged, or one has the wrong sign",
       "correct the order or the signs of the gyro's columns",
       [](Recording* r) { ScaleRates(-1.0, r); }},
      {"gyro_unit_and_axes",
       "the gyro's rates are in deg/s, and its axes left-handed (two exchanged, or one sign)",
       "correct the unit and the order or the signs of the gyro's columns",
       [](Recording* r) { ScaleRates(-kDegree, r); }}};
  if (recording.accel.size() > 2) {
    repairs.push_back(
        {"gyro_columns", "accelerations are where the gyro's rates belong, and rates where they do",
         "exchange the columns of gyro and accelerometer", ExchangeWithAccelerometer});
  }
  return repairs;
}

// Of frames whose stamps take as many times as long as the gyro's for the same motion.
Repair RepairOfFrameClock(double stretch) {
  return {"frame_clock",
          stretch > 1.0
              ? Format("the frames' stamps take %.3g times as long as the gyro's for the same "
                       "motion: those of a slow motion as it is played",
                       stretch)
              : Format("the gyro's stamps take %.3g times as long as the frames' for the same "
                       "motion: the frames' are those of a film that is played faster",
                       1.0 / stretch),
          "give the frames the stamps at which they were taken",
          [=](Recording* r) { StretchStamps(1.0 / stretch, &r->frames); }, stretch};
}

// The same where the camera turns as fast as the gyro with the frames' stamps as they are.
Repair RepairOfGyroClock(double stretch) {
  return {"gyro_clock",
          Format("the gyro's stamps take %.3g of the time that the frames' take for the same "
                 "motion: they were made for another rate of samples",
                 1.0 / stretch),
          "give the gyro's samples the stamps at which they were taken",
          [=](Recording* r) {
            StretchStamps(stretch, &r->gyro);
            StretchStamps(stretch, &r->accel);
          },
          stretch};
}

// What of slow and fast motions is filmed while the gyro runs, or nearly so.
std::vector<Repair> RepairsOfClocks(const Recording& recording) {
  constexpr double kBeyondGyro = 1.1;    // durations
  constexpr double kLeastFilmedS = 5.0;  // less may fit a long gyro somewhere by chance
  const double frames_s =
      SecondsSince(recording.frames.front().stamp_ns, recording.frames.back().stamp_ns);
  const double gyro_s =
      SecondsSince(recording.gyro.front().stamp_ns, recording.gyro.back().stamp_ns);
  std::vector<Repair> repairs;
  for (const double slower : kSlowMotions) {
    for (const double stretch : {slower, 1.0 / slower}) {
      const double filmed_s = frames_s / stretch;
      if (filmed_s > kBeyondGyro * gyro_s || filmed_s < kLeastFilmedS) continue;
      repairs.push_back(RepairOfFrameClock(stretch));
    }
  }
  return repairs;
}

}  // namespace

std::optional<DataFault> RepairRecording(const CameraRotationsAt& rotations_at,
                                         const StartOptions& options, Recording* recording) {
  if (recording->gyro.size() < 3 || recording->frames.size() < 3) return std::nullopt;
  const double focal = FocalToBeginWith(recording->camera);
  const std::vector<CameraRotation> rotations = rotations_at(*recording, {{focal, {}}}).front();
  Recording outline = OutlineForStart(*recording);
  outline.camera.q_gyro_cam.reset();
  std::vector<Repair> repairs = RepairsOfGyro(*recording);
  for (Repair& repair : RepairsOfClocks(*recording)) repairs.push_back(std::move(repair));

  std::optional<Repair> best;
  double best_explained = kRepaired;
  for (const Repair& repair : repairs) {
    Recording trial = outline;
    repair.apply(&trial);
    // Which of two clocks is wrong, rates tell: those of the gyro are right with either.
    const double clocks = std::max(repair.stretch, 1.0 / repair.stretch);
    StartOptions with = options;
    with.max_rate_ratio = options.max_rate_ratio * clocks;
    const Result<StartResult> start = FindStart(trial, rotations, with);
    if (!start || start->explained <= best_explained) continue;
    const double frames_wrong = std::abs(std::log(start->rate_ratio));
    const double gyro_wrong = std::abs(std::log(start->rate_ratio * repair.stretch));
    if (std::min(frames_wrong, gyro_wrong) > std::log(options.max_rate_ratio)) continue;
    best_explained = start->explained;
    best = gyro_wrong < frames_wrong ? RepairOfGyroClock(repair.stretch) : repair;
  }
  if (!best) return std::nullopt;
  recording->camera.q_gyro_cam.reset();
  best->apply(recording);
  recording->faults.push_back({best->name, 1, best->finding + "; repaired for this run"});
  return DataFault{best->name, best->finding, best->advice};
}

std::optional<std::string> FindElectronicStabilisation(
    const Recording& recording, const std::vector<CameraRotation>& rotations) {
  // Mean rates over the rotations, of the camera and, whatever the delay, of the gyro.
  std::vector<Eigen::Vector3d> camera, gyro;
  double interval_s = 0.0;
  for (const CameraRotation& rotation : rotations) {
    const double dt =
        SecondsSince(recording.frames[static_cast<size_t>(rotation.frame_a)].stamp_ns,
                     recording.frames[static_cast<size_t>(rotation.frame_b)].stamp_ns);
    camera.push_back(Log(rotation.q_a_b) / dt);
    interval_s += dt;
  }
  if (camera.size() < 60) return std::nullopt;
  interval_s /= static_cast<double>(camera.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int in_sum = 0;
  int64_t begin_ns = recording.gyro.front().stamp_ns;
  for (const GyroSample& sample : recording.gyro) {
    if (in_sum > 0 && SecondsSince(begin_ns, sample.stamp_ns) >= interval_s) {
      gyro.push_back(sum / in_sum);
      begin_ns = StampAt(begin_ns, interval_s);
      sum.setZero();
      in_sum = 0;
    }
    sum += sample.omega_gyro_rad_s;
    ++in_sum;
  }
  const auto frames = [&](double seconds) {
    return std::max(1, static_cast<int>(std::lround(seconds / interval_s)));
  };
  // Between averages over 0.1 and 0.5 s: about 1 to 5 Hz. Between 1 and 4 s: slow.
  const double fast = BandPower(camera, frames(0.1), frames(0.5)) /
                      std::max(1e-12, BandPower(gyro, frames(0.1), frames(0.5)));
  const double slow = BandPower(camera, frames(1.0), frames(4.0)) /
                      std::max(1e-12, BandPower(gyro, frames(1.0), frames(4.0)));
  if (fast < 0.15 && fast < 0.35 * slow && FollowsSlowly(recording, rotations)) {
    return Format(
        "of the gyro's rotation, the picture has %.0f %% below 0.5 Hz, but only %.0f %% "
        "above 1 Hz",
        100.0 * std::sqrt(slow), 100.0 * std::sqrt(fast));
  }
  return std::nullopt;
}

}  // namespace camgyro
