// camgyro_hours SCENARIO.yaml [KEY=VALUE...]: the library's Calibrator over a stream of hours, fed
// as fast as it works. Prints a csv row per second of the stream; tools/hours.py makes
// docs/lab/hours.md of it.
//
// The estimate is that for the newest frame: with the clocks' rates, from the frame that it is of.
// The stream's tracks are simulated frame by frame and never held; gyro samples come when they
// would, right after the exposure of the frame's last row. Seconds of the processor are those of
// the whole process while a frame and its samples are worked on, and not of the simulator.
#include <glog/logging.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "camgyro/calibrator.h"
#include "core/time.h"
#include "simulation/simulate.h"

namespace camgyro {
namespace {

double ProcessorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double ResidentMb() {
  std::ifstream file("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  file >> pages >> resident;
  return 1e-6 * resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

class Stream {
 public:
  Stream(const simulation::Scenario& scenario, const simulation::Simulated& sensors)
      : sensors_(sensors), readout_s_(std::max(0.0, scenario.camera.readout_s)) {
    api::CalibratorOptions options;
    options.camera.width_px = scenario.camera.width_px;
    options.camera.height_px = scenario.camera.height_px;
    calibrator_ = api::Calibrator::Create(options, nullptr);
    per_row_ = std::max<size_t>(1, std::llround(scenario.camera.rate_hz));
    std::printf(
        "time_s,delay_ms,estimate_ms,sigma_ms,sigma_total_ms,frame_ms,frame_max_ms,resident_mb,"
        "starts\n");
  }

  void Add(size_t frame, const std::vector<TrackedPoint>& tracks) {
    std::vector<api::TrackPoint> points;
    for (const TrackedPoint& p : tracks) points.push_back({p.track_id, p.px.x(), p.px.y()});
    const int64_t stamp_ns = sensors_.recording.frames[frame].stamp_ns;
    const double delay_s = sensors_.frames[frame].delay_s;
    const double begin_s = ProcessorSeconds();
    calibrator_->AddTracks(stamp_ns, points.data(), points.size());
    const int64_t until_ns = StampAt(stamp_ns, delay_s + readout_s_);
    const std::vector<GyroSample>& gyro = sensors_.recording.gyro;
    for (; next_gyro_ < gyro.size() && gyro[next_gyro_].stamp_ns <= until_ns; ++next_gyro_) {
      const Eigen::Vector3d& w = gyro[next_gyro_].omega_gyro_rad_s;
      calibrator_->AddGyro(gyro[next_gyro_].stamp_ns, w.x(), w.y(), w.z());
    }
    constexpr double kHangsS = 600.0;
    CHECK(calibrator_->WaitUntilIdle(kHangsS));
    const double spent_ms = 1e3 * (ProcessorSeconds() - begin_s);
    sum_ms_ += spent_ms;
    most_ms_ = std::max(most_ms_, spent_ms);
    if ((frame + 1) % per_row_ == 0) Print(stamp_ns, delay_s);
  }

 private:
  static double DelayAt(const api::Snapshot& snapshot, int64_t stamp_ns) {
    return snapshot.calibration.delay_s +
           snapshot.clock_skew * SecondsSince(snapshot.frame_stamp_ns, stamp_ns);
  }

  // The estimate as it stands when a frame has come, beside what is true of that frame.
  void Print(int64_t stamp_ns, double delay_s) {
    const auto snapshot = calibrator_->snapshot();
    const api::ParameterState& delay = snapshot->parameters[api::kDelay];
    const double nan = std::nan("");
    const bool is_there = snapshot->has_estimate;
    std::printf("%.3f,%.4f,%.4f,%.4f,%.4f,%.3f,%.3f,%.2f,%d\n",
                SecondsSince(sensors_.recording.frames.front().stamp_ns, stamp_ns), 1e3 * delay_s,
                1e3 * (is_there ? DelayAt(*snapshot, stamp_ns) : nan),
                1e3 * (is_there ? delay.sigma : nan), 1e3 * (is_there ? delay.sigma_total : nan),
                sum_ms_ / static_cast<double>(per_row_), most_ms_, ResidentMb(), snapshot->starts);
    std::fflush(stdout);
    sum_ms_ = most_ms_ = 0.0;
  }

  const simulation::Simulated& sensors_;
  const double readout_s_;
  std::unique_ptr<api::Calibrator> calibrator_;
  size_t per_row_ = 1, next_gyro_ = 0;
  double sum_ms_ = 0.0, most_ms_ = 0.0;
};

int Run(int argc, char** argv) {
  FLAGS_minloglevel = google::ERROR;
  if (argc < 2) {
    std::fprintf(stderr, "camgyro_hours SCENARIO.yaml [KEY=VALUE...]\n");
    return 2;
  }
  const auto scenario = simulation::LoadScenario(argv[1], {argv + 2, argv + argc});
  if (!scenario) {
    std::fprintf(stderr, "%s\n", scenario.error().message.c_str());
    return 2;
  }
  const auto sensors = simulation::SimulateSensors(*scenario);
  if (!sensors) {
    std::fprintf(stderr, "%s\n", sensors.error().message.c_str());
    return 2;
  }
  Stream stream(*scenario, *sensors);
  simulation::ForEachFrame(
      *scenario, *sensors,
      [&](size_t frame, std::vector<TrackedPoint>* tracks,
          std::vector<simulation::PointTruth>* /*truths*/) { stream.Add(frame, *tracks); });
  return 0;
}

}  // namespace
}  // namespace camgyro

int main(int argc, char** argv) { return camgyro::Run(argc, argv); }
