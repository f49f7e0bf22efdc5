#include "estimator/calibrate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "core/so3.h"

namespace camgyro {
namespace {

constexpr int kAttitudeGap = 4;         // frames between two attitudes of one rotation
constexpr int kMinPairsForUnseen = 60;  // below, setting frames aside costs more than it tells

class StageClock {
 public:
  explicit StageClock(std::vector<StageTime>* times) : times_(times) {}
  void Finish(const std::string& stage) {
    const auto now = std::chrono::steady_clock::now();
    times_->push_back({stage, std::chrono::duration<double>(now - begin_).count()});
    begin_ = now;
  }

 private:
  std::vector<StageTime>* times_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

std::string Format(const char* format, double a, double b = 0.0, double c = 0.0, double d = 0.0) {
  char text[300];
  std::snprintf(text, sizeof(text), format, a, b, c, d);
  return text;
}

std::vector<CameraRotation> NeighbourRotations(const Recording& recording) {
  std::vector<CameraRotation> rotations;
  for (const TimedPair& pair : MakeEstimationInput(recording, 1).pairs) {
    rotations.push_back(pair.rotation);
  }
  return rotations;
}

// Pairs for the unseen fit: five stretches of 4 % of the recording each, and a guard pair on both
// sides that belongs to neither share, so that no frame is in both.
void Split(const std::vector<TimedPair>& pairs, std::vector<TimedPair>* fit,
           std::vector<TimedPair>* unseen) {
  const size_t n = pairs.size(), block = n / 5, length = std::max<size_t>(3, n / 25);
  for (size_t i = 0; i < n; ++i) {
    const size_t place = i % block, begin = (block - length) / 2;
    if (place >= begin && place < begin + length) {
      unseen->push_back(pairs[i]);
    } else if (place + 1 != begin && place != begin + length) {
      fit->push_back(pairs[i]);
    }
  }
}

// A parameter is determined if the data shrank its prior and the result is of practical use.
void MarkDetermined(bool attitudes, Calibration* c) {
  StateVector useful;
  useful << 0.05 * c->lens[kFocal], 0.02 * c->width_px, 0.02 * c->width_px, 3e-3, 3e-3,
      Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.03);
  const StateVector sigma = c->sigma();
  for (int i = 0; i < kStateSize; ++i) {
    const bool pixels_needed = i <= kStateReadout;
    c->determined[static_cast<size_t>(i)] =
        !(attitudes && pixels_needed) && sigma[i] < useful[i] && sigma[i] < 0.5 * c->prior_sigma[i];
  }
}

void AddDoubts(const Recording& recording, CalibrationReport* report) {
  const Calibration& c = report->calibration;
  const StateVector sigma = c.sigma();
  const auto determined = [&](int i) { return c.determined[static_cast<size_t>(i)]; };
  if (!report->converged) {
    report->doubts.push_back("the refinement had not settled when it was stopped");
  }
  const double centre_off =
      std::hypot(c.lens[kCx] - 0.5 * c.width_px, c.lens[kCy] - 0.5 * c.height_px);
  if (determined(kStateCx) && determined(kStateCy) &&
      centre_off > 0.05 * std::hypot(c.width_px, c.height_px)) {
    report->doubts.push_back(Format(
        "the principal point is %.0f px off the centre of the picture: real lenses stay within "
        "3 %% of the diagonal, so another effect may hide there",
        centre_off));
  }
  if (determined(kStateReadout) && c.readout_s < -3.0 * sigma[kStateReadout]) {
    report->notes.push_back("the readout is negative: rows are read from bottom to top");
  }
  const double interval = MedianInterval(recording.frames);
  if (determined(kStateReadout) && std::abs(c.readout_s) > 1.05 * interval) {
    report->doubts.push_back(
        Format("the readout time of %.1f ms is longer than the frame interval of %.1f ms",
               1e3 * c.readout_s, 1e3 * interval));
  }
  if (report->unseen && report->unseen->rms_px > 1.3 * report->quality.rms_px) {
    report->doubts.push_back(
        Format("frames that the fit has not seen fit worse: %.3f px against %.3f px",
               report->unseen->rms_px, report->quality.rms_px));
  }
  if (report->online) {
    StateVector gap = Difference(*report->online, c).cwiseAbs();
    const StateVector scale = (report->online->sigma().cwiseAbs2() + sigma.cwiseAbs2()).cwiseSqrt();
    for (const int i : {kStateFocal, kStateReadout, kStateDelay}) {
      if (determined(i) && gap[i] > 6.0 * scale[i]) {
        report->doubts.push_back(StateNames()[static_cast<size_t>(i)] +
                                 Format(": online pass and refinement differ by %.1f of their "
                                        "sigmas",
                                        gap[i] / scale[i]));
      }
    }
  }
}

}  // namespace

Calibration MakePrior(const Recording& recording, const StartResult& start) {
  const CameraGuess& guess = recording.camera;
  Calibration prior;
  prior.width_px = guess.width_px;
  prior.height_px = guess.height_px;
  prior.distortion_model = guess.distortion_model;
  const Eigen::Vector2d centre(0.5 * (guess.width_px - 1), 0.5 * (guess.height_px - 1));
  const bool scanned = start.focal && start.focal->determined;
  const double focal = guess.focal_px ? *guess.focal_px
                       : scanned      ? start.focal->value_px
                                      : 0.8 * std::max(guess.width_px, guess.height_px);
  prior.lens = MakePinhole(focal, guess.principal_px.value_or(centre), guess.aspect_ratio);
  for (size_t i = 0; i < guess.distortion.size() && i < 4; ++i) {
    prior.lens[kK1 + static_cast<int>(i)] = guess.distortion[i];
  }
  const double interval = std::min(1.0 / 30.0, MedianInterval(recording.frames));
  prior.readout_s = guess.readout_s.value_or(0.5 * interval);
  prior.delay_s = start.delay_middle_row_s - 0.5 * prior.readout_s;
  prior.q_gyro_cam = start.q_gyro_cam;

  StateVector& sigma = prior.prior_sigma;
  sigma[kStateFocal] = (guess.focal_px ? 0.15 : 0.30) * focal;
  sigma[kStateCx] = sigma[kStateCy] = 0.02 * std::hypot(guess.width_px, guess.height_px);
  sigma[kStateReadout] = guess.readout_s ? 5e-3 : 0.6 * interval;
  if (recording.tracks.empty() && recording.matches.empty()) {
    // An attitude has neither pixels nor rows: nothing depends on the lens, and the readout is 0.
    prior.readout_s = 0.0;
    prior.delay_s = start.delay_middle_row_s;
    sigma.segment<4>(kStateFocal).setOnes();
  }
  sigma[kStateDelay] = 0.05;
  sigma.segment<3>(kStateBias).setConstant(0.1);
  sigma.segment<3>(kStateRotation) = start.rotation_sigma_rad.cwiseMax(0.15);
  return prior;
}

Result<CalibrationReport> CalibrateRecording(const Recording& recording,
                                             const CameraRotationsAtFocal& rotations_at,
                                             const CalibrateOptions& options,
                                             const Progress& progress) {
  const auto tell = [&](const std::string& stage, double done) {
    if (progress) progress(stage, done);
  };
  CalibrationReport report;
  StageClock clock(&report.times);
  const bool attitudes = recording.matches.empty() && recording.tracks.empty();
  const EstimationInput input = MakeEstimationInput(recording, kAttitudeGap);

  tell("start", 0.0);
  const Result<StartResult> start =
      attitudes ? FindStart(recording, NeighbourRotations(recording), options.start)
                : FindStartAndFocal(recording, rotations_at, options.start, options.focal_scan);
  if (!start) return tl::unexpected(start.error());
  report.start = *start;
  report.notes = start->notes;
  clock.Finish("start");

  const Calibration prior = MakePrior(recording, *start);
  Calibration estimate = prior;
  estimate.bias_gyro_rad_s = start->bias_gyro_rad_s;
  if (start->focal && start->focal->determined) estimate.lens[kFocal] = start->focal->value_px;
  PairGraphOptions graph_options = options.window.graph;
  graph_options.residual = options.residual;
  graph_options.match_noise = recording.match_noise;
  graph_options.gyro_sigma_rad_s = GyroSigma(recording, start->delay_middle_row_s);
  if (recording.gyro_info.random_walk_rad_s2_rtHz) {
    graph_options.bias_walk_rad_s2_rtHz =
        std::max(1e-6, *recording.gyro_info.random_walk_rad_s2_rtHz);
  }

  if (!attitudes) {
    SlidingWindowOptions window_options = options.window;
    window_options.graph = graph_options;
    SlidingWindow window(estimate, prior, input.origin_ns, window_options);
    window.SetListener([&](const WindowUpdate& update) { report.trace.push_back(update); });
    // In the order of real time: a sample is known when its time has come, a frame at its stamp.
    size_t next_sample = 0;
    for (size_t i = 0; i < input.pairs.size(); ++i) {
      const TimedPair& pair = input.pairs[i];
      for (; next_sample < input.rates.size() &&
             input.rates[next_sample].time_s <= pair.time_b_s + estimate.delay_s;
           ++next_sample) {
        if (window.AddGyroSample(recording.gyro[next_sample]) != AddResult::kAccepted) {
          return BadInput("gyro sample " + std::to_string(next_sample) +
                          ": the stamp repeats or goes back, or a rate is not finite");
        }
      }
      if (window.AddPair(recording.frames[static_cast<size_t>(pair.frame_a)].stamp_ns,
                         recording.frames[static_cast<size_t>(pair.frame_b)].stamp_ns,
                         pair.matches) != AddResult::kAccepted) {
        return BadInput("frames " + std::to_string(pair.frame_a) + " and " +
                        std::to_string(pair.frame_b) +
                        ": the stamp repeats or goes back, or a pixel is not finite");
      }
      if (i % 20 == 0) tell("window", static_cast<double>(i) / input.pairs.size());
    }
    for (; next_sample < input.rates.size(); ++next_sample) {
      if (window.AddGyroSample(recording.gyro[next_sample]) != AddResult::kAccepted) {
        return BadInput("gyro sample " + std::to_string(next_sample) +
                        ": the stamp repeats or goes back, or a rate is not finite");
      }
    }
    report.pairs_used_online = window.num_used_pairs();
    report.skipped_pairs = window.num_skipped_pairs();
    if (!report.trace.empty()) {
      estimate = window.latest().estimate;
      report.online = estimate;
      MarkDetermined(attitudes, &*report.online);
    }
    clock.Finish("window");
  }

  if (options.refine || !report.online) {
    RefinementOptions refinement = options.refinement;
    refinement.graph = graph_options;
    if (!report.trace.empty()) refinement.graph.sigma_px = report.trace.back().noise_px;
    Calibration from = estimate;
    from.prior_sigma = prior.prior_sigma;
    std::vector<TimedPair> fit, unseen;
    tell("refinement", 0.0);
    if (!attitudes && input.pairs.size() >= kMinPairsForUnseen) {
      Split(input.pairs, &fit, &unseen);
      const Result<Refined> partial = Refine(input, fit, from, prior, refinement);
      if (!partial) return tl::unexpected(partial.error());
      report.unseen = EvaluateUnseen(input, unseen, partial->calibration, partial->quality.noise_px,
                                     refinement.graph);
      from = partial->calibration;
      from.prior_sigma = prior.prior_sigma;
      refinement.graph.sigma_px = partial->quality.noise_px;
    }
    tell("refinement", 0.6);
    const Result<Refined> refined = Refine(input, input.pairs, from, prior, refinement);
    if (!refined) return tl::unexpected(refined.error());
    report.calibration = refined->calibration;
    report.quality = refined->quality;
    report.skipped_pairs = refined->skipped_pairs;
    report.converged = refined->converged;
    clock.Finish("refinement");
  } else {
    report.calibration = estimate;
    report.quality.pairs = report.pairs_used_online;
    report.quality.noise_px = report.trace.back().noise_px;
    report.converged = true;
  }
  report.calibration.prior_sigma = prior.prior_sigma;
  MarkDetermined(attitudes, &report.calibration);
  if (report.online) report.online->prior_sigma = prior.prior_sigma;
  AddDoubts(recording, &report);
  tell("refinement", 1.0);
  return report;
}

}  // namespace camgyro
