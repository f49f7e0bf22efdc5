#include "tools/comparison/estimator_runs.h"

#include <malloc.h>

#include <algorithm>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <optional>
#include <utility>

#include "estimator/moving_tracks.h"
#include "estimator/reference/calibrate_with_ekf.h"
#include "estimator/window/gyro_noise.h"
#include "estimator/window/refinement.h"
#include "estimator/window/sliding_window.h"

namespace camgyro::comparison {
namespace {

// A line of /proc/self/status [kB]; 0 if there is none.
double StatusKb(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind(key + ":", 0) == 0) return std::atof(line.c_str() + key.size() + 1);
  }
  return 0.0;
}

void Measure(const std::function<void()>& work, EstimatorRun* run) {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";  // forget the peak so far
  const double held_kb = StatusKb("VmRSS");
  const std::clock_t begin = std::clock();
  work();
  run->cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  run->memory_mb = std::max(0.0, StatusKb("VmHWM") - held_kb) / 1024.0;
}

PairGraphOptions WithNoiseOf(const Input& input, PairGraphOptions options) {
  options.match_noise = input.recording.match_noise;
  options.gyro_sigma_rad_s = GyroSigma(input.recording, input.start.delay_s);
  if (input.recording.gyro_info.random_walk_rad_s2_rtHz) {
    options.bias_walk_rad_s2_rtHz =
        std::max(1e-6, *input.recording.gyro_info.random_walk_rad_s2_rtHz);
  }
  return options;
}

// Pairs and samples in the order of real time, as CalibrateRecording feeds them.
std::vector<WindowUpdate> RunWindow(const Input& input, const EstimationInput& data,
                                    const std::vector<TimedPair>& pairs,
                                    SlidingWindowOptions options, const PairGraphOptions& graph) {
  std::vector<WindowUpdate> trace;
  options.graph = graph;
  SlidingWindow window(input.start, input.prior, data.origin_ns, options);
  window.SetListener([&](const WindowUpdate& update) { trace.push_back(update); });
  size_t next = 0;
  const auto feed_until = [&](double time_s) {
    for (; next < data.rates.size() && data.rates[next].time_s <= time_s; ++next) {
      if (window.AddGyroSample(input.recording.gyro[next]) != AddResult::kAccepted) return false;
    }
    return true;
  };
  for (const TimedPair& pair : pairs) {
    if (!feed_until(pair.time_b_s + input.start.delay_s)) return {};
    const auto stamp = [&](int frame) {
      return input.recording.frames[static_cast<size_t>(frame)].stamp_ns;
    };
    if (window.AddPair(stamp(pair.frame_a), stamp(pair.frame_b), pair.matches) !=
        AddResult::kAccepted) {
      return {};
    }
  }
  if (!feed_until(data.rates.back().time_s)) return {};
  return trace;
}

int FrameOf(const Recording& recording, int64_t stamp_ns) {
  const auto it =
      std::lower_bound(recording.frames.begin(), recording.frames.end(), stamp_ns,
                       [](const Frame& frame, int64_t stamp) { return frame.stamp_ns < stamp; });
  return static_cast<int>(it - recording.frames.begin());
}

void TakeResult(const Calibration& estimate, const Input& input, EstimatorRun* run) {
  run->error = Difference(estimate, input.truth);
  run->covariance = estimate.covariance;
  if (!run->error.allFinite() || !run->covariance.allFinite() ||
      !(run->covariance.diagonal().minCoeff() > 0.0)) {
    run->failure = "the estimate is not finite";
  }
}

void TakeTrace(const std::vector<WindowUpdate>& trace, const Input& input, EstimatorRun* run) {
  for (const WindowUpdate& update : trace) {
    run->trace.push_back({FrameOf(input.recording, update.frame_stamp_ns),
                          Difference(update.estimate, input.truth), update.estimate.sigma()});
  }
  if (trace.empty()) {
    run->failure = "no pair of frames could be used";
  } else {
    TakeResult(trace.back().estimate, input, run);
  }
}

void RunRefinement(const Input& input, const EstimationInput& data, const PairGraphOptions& graph,
                   const std::vector<WindowUpdate>& window_trace, EstimatorRun* run) {
  RefinementOptions options;
  options.graph = graph;
  Calibration from = input.start;
  if (!window_trace.empty()) {
    from = window_trace.back().estimate;
    options.graph.sigma = window_trace.back().noise_px;
  }
  const auto fit = [&](const std::vector<TimedPair>& pairs, const Refined* before) {
    if (before != nullptr) {
      options.graph.sigma = before->quality.noise_px;
      options.latents = before->latents;
    }
    return Refine(data, pairs, before != nullptr ? before->calibration : from, input.prior,
                  options);
  };
  std::optional<Result<StillFit>> still;
  Measure([&] { still = FitWhatIsStill(data, data.pairs, graph, fit); }, run);
  if (*still) {
    TakeResult((*still)->fit.calibration, input, run);
  } else {
    run->failure = still->error().message;
  }
}

}  // namespace

const std::vector<std::string>& EstimatorNames() {
  static const std::vector<std::string> names = {"window", "refinement", "ekf"};
  return names;
}

std::vector<EstimatorRun> RunEstimators(const std::vector<std::string>& names, const Input& input,
                                        const PairGraphOptions& graph, const EkfOptions& ekf) {
  const PairGraphOptions fit = WithNoiseOf(input, graph);
  const EstimationInput data = MakeEstimationInput(input.recording, SelectPairs(input.recording));
  std::vector<EstimatorRun> runs;
  // The window's, also for the refinement, which begins where it ends.
  std::optional<EstimatorRun> window;
  std::vector<WindowUpdate> window_trace;
  const auto run_window = [&] {
    if (window) return;
    window.emplace();
    const PairSelection selection = SelectPairs(input.recording, kGapLimitsOnline);
    std::vector<TimedPair> pairs = SideBySide(input.recording, selection);
    AddMatches(input.recording, &pairs);
    const SlidingWindowOptions options = WindowOptionsFor(selection);
    Measure([&] { window_trace = RunWindow(input, data, pairs, options, fit); }, &*window);
    TakeTrace(window_trace, input, &*window);
  };
  for (const std::string& name : names) {
    EstimatorRun run;
    if (name == "ekf") {
      const Prior start{input.start, input.prior.sigma};
      EkfRun result;
      const EstimationInput neighbours = MakeEstimationInput(input.recording);
      Measure([&] { result = RunEkf(neighbours, input.recording.frames, start, ekf); }, &run);
      TakeTrace(result.trace, input, &run);
    } else if (name == "window") {
      run_window();
      run = *window;
    } else {
      run_window();
      RunRefinement(input, data, fit, window_trace, &run);
    }
    run.estimator = name;
    run.frames = static_cast<int>(input.recording.frames.size());
    runs.push_back(std::move(run));
  }
  return runs;
}

namespace {

// Plain values as their bytes, strings and vectors after their lengths.
class Writer {
 public:
  void Bytes(const void* data, size_t size) { bytes_.append(static_cast<const char*>(data), size); }
  template <typename T>
  void Value(const T& value) {
    Bytes(&value, sizeof value);
  }
  template <typename Matrix>
  void Numbers(const Matrix& m) {
    Bytes(m.data(), sizeof(double) * static_cast<size_t>(m.size()));
  }
  void Text(const std::string& text) {
    Value(text.size());
    Bytes(text.data(), text.size());
  }
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}
  void Bytes(void* data, size_t size) {
    std::memcpy(data, bytes_.data() + at_, size);
    at_ += size;
  }
  template <typename T>
  T Value() {
    T value;
    Bytes(&value, sizeof value);
    return value;
  }
  template <typename Matrix>
  void Numbers(Matrix* m) {
    Bytes(m->data(), sizeof(double) * static_cast<size_t>(m->size()));
  }
  std::string Text() {
    std::string text(Value<size_t>(), '\0');
    Bytes(text.data(), text.size());
    return text;
  }

 private:
  const std::string& bytes_;
  size_t at_ = 0;
};

}  // namespace

std::string Pack(const SeedRun& run) {
  Writer out;
  out.Value(run.estimators.size());
  for (const EstimatorRun& e : run.estimators) {
    out.Text(e.estimator);
    out.Text(e.failure);
    out.Value(e.trace.size());
    for (const TracePoint& point : e.trace) {
      out.Value(point.frame);
      out.Numbers(point.error);
      out.Numbers(point.sigma);
    }
    out.Numbers(e.error);
    out.Numbers(e.covariance);
    out.Value(e.frames);
    out.Value(e.cpu_s);
    out.Value(e.memory_mb);
  }
  out.Value(run.bound.size());
  for (const StateCovariance& bound : run.bound) out.Numbers(bound);
  return out.Take();
}

SeedRun Unpack(const std::string& bytes) {
  Reader in(bytes);
  SeedRun run;
  run.estimators.resize(in.Value<size_t>());
  for (EstimatorRun& e : run.estimators) {
    e.estimator = in.Text();
    e.failure = in.Text();
    e.trace.resize(in.Value<size_t>());
    for (TracePoint& point : e.trace) {
      point.frame = in.Value<int>();
      in.Numbers(&point.error);
      in.Numbers(&point.sigma);
    }
    in.Numbers(&e.error);
    in.Numbers(&e.covariance);
    e.frames = in.Value<int>();
    e.cpu_s = in.Value<double>();
    e.memory_mb = in.Value<double>();
  }
  run.bound.resize(in.Value<size_t>());
  for (StateCovariance& bound : run.bound) in.Numbers(&bound);
  return run;
}

}  // namespace camgyro::comparison
