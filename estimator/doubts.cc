#include "estimator/doubts.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "core/format.h"
#include "core/state.h"
#include "estimator/astray.h"
#include "estimator/window/gyro_noise.h"

namespace camgyro {
namespace {

// No lens has a focal length outside of these, in diagonals of its picture: a fisheye that sees 220
// degrees along the diagonal has 0.26 of one, a 350 mm lens on 35 mm film 8.
constexpr double kShortestFocal = 0.15, kLongestFocal = 8.0;

// UnseenRatio beyond which it is doubted: 0.93 to 1.14 with the right model, and 1.23 to 1.25 where
// a lens moves as no model has it (docs/lab/random_faults.md#frames-that-the-fit-has-not-seen).
constexpr double kUnseenRatio = 1.2;

// How many times as much noise as is declared a gyro's samples show before a note says so: less
// with a right data sheet from 100 Hz on, 5 times with the motors of a drone
// (docs/lab/gyro_noise.md#more-than-is-declared).
constexpr double kMoreThanDeclared = 3.0;

// Empty where the samples bear out what is declared, or nothing is.
std::string GyroNoiseNote(const Recording& recording, double delay_s) {
  const std::optional<double>& declared = recording.gyro_info.noise_density_rad_s_rtHz;
  const double interval_s = MedianInterval(recording.gyro);
  if (!declared || !(interval_s > 0.0)) return "";
  const double shown = std::sqrt(ShownGyroSigma(recording, delay_s).squaredNorm() / 3.0);
  const double density = shown * std::sqrt(interval_s);
  if (density < kMoreThanDeclared * *declared) return "";
  return Format(
      "the gyro's samples scatter like noise of up to %.2g rad/s/rtHz, and %.2g is declared: "
      "motors that shake it, a data sheet that is wrong, or too few samples for this motion; the "
      "sigmas of noise are those of what is declared, and without gyroscope_noise_density in "
      "imu0/sensor.yaml of what the samples show",
      density, *declared);
}

bool FocalRanAway(bool attitudes, const Calibration& c) {
  const double diagonal_px = std::hypot(c.width_px, c.height_px);
  return !attitudes && !(c.lens[kFocal] > kShortestFocal * diagonal_px &&
                         c.lens[kFocal] < kLongestFocal * diagonal_px);
}

// The data shrank the prior, and the result is of practical use.
bool IsUseful(size_t i, const Prior& prior, const Calibration& c) {
  StateScales scales;
  scales.focal_px = c.lens[kFocal];
  scales.width_px = c.width_px;
  const double sigma = c.sigma()[static_cast<Eigen::Index>(i)];
  return sigma < StateTable()[i].useful_sigma.In(scales) &&
         sigma < 0.5 * prior.sigma[static_cast<Eigen::Index>(i)];
}

}  // namespace

void MarkDetermined(bool attitudes, const Prior& prior, Calibration* c) {
  for (size_t i = 0; i < kStateSize; ++i) {
    c->determined[i] = !(attitudes && StateTable()[i].needs_pixels) && IsUseful(i, prior, *c);
  }
  // What such a fit says of anything, the delay included, has no known error.
  if (FocalRanAway(attitudes, *c)) c->determined.fill(false);
  // Rows are timed by the angles between them: without a focal length there are none.
  if (!c->determined[kStateFocal]) c->determined[kStateReadout] = false;
}

void DisbelieveFit(bool ran_away, CalibrationReport* report) {
  Calibration& c = report->calibration;
  for (size_t i = 0; i < kStateSize; ++i) {
    if (StateTable()[i].needs_fit) c.determined[i] = false;
  }
  if (!ran_away) return;
  double& variance = c.covariance(kStateDelay, kStateDelay);
  const double middle_variance = variance + c.covariance(kStateDelay, kStateReadout) +
                                 0.25 * c.covariance(kStateReadout, kStateReadout);
  report->doubts.push_back(Format(
      "the fit went to a focal length of %.0f px, which times no rows: the readout is not "
      "known, and the delay of the first row no better than to half of it; in the middle "
      "row it is %.1f ± %.1f ms",
      c.lens[kFocal], 1e3 * (c.delay_s + 0.5 * c.readout_s), 1e3 * std::sqrt(middle_variance)));
  variance += std::pow(0.5 * report->prior.sigma[kStateReadout], 2);
  if (!IsUseful(kStateDelay, report->prior, c)) c.determined[kStateDelay] = false;
}

void DisbelievePulledFit(CalibrationReport* report) {
  report->calibration.determined.fill(false);
  const double noise_px = report->quality.noise_px;
  report->doubts.push_back(Format(
      "the fit leaves %.2f px, where the points move smoothly to within %.2f px: something moves "
      "the whole picture that the model lacks, and pulls every value by more than its sigma; "
      "was the picture stabilised?",
      noise_px, noise_px / report->noise_over_smooth));
}

double UnseenRatio(const CalibrationReport& report) {
  if (!report.unseen || !(report.quality.usual_rms_px > 0.0)) return 0.0;
  const double unseen_sq =
      std::pow(report.unseen->usual_rms_px, 2) - std::pow(report.unseen->gyro_px, 2);
  return std::sqrt(std::max(0.0, unseen_sq)) / report.quality.usual_rms_px;
}

void AddDoubts(const Recording& recording, CalibrationReport* report) {
  const Calibration& c = report->calibration;
  const StateVector sigma = c.sigma();
  const auto determined = [&](int i) { return c.determined[static_cast<size_t>(i)]; };
  if (!report->converged) {
    report->doubts.push_back("the refinement had not settled when it was stopped");
  }
  if (FocalRanAway(recording.HasOnlyAttitudes(), c)) {
    report->doubts.push_back(Format(
        "the focal length ran away, to %.3g px, which no lens has: nothing of this fit is to "
        "be believed; by rotation alone, the start found a delay of %.1f ms in the middle "
        "row",
        c.lens[kFocal], 1e3 * report->start.delay_middle_row_s));
  }
  if (IsFarFromRotations(c.lens[kFocal], report->start.focal)) {
    report->doubts.push_back(Format(
        "the focal length of the fit, %.0f px, is far from the %.0f ± %.0f px of the rotations at "
        "the start: it makes up for something that the lens has and the model lacks; try "
        "--effects=radial_distortion",
        c.lens[kFocal], report->start.focal->value_px, report->start.focal->sigma_px));
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
  const std::string gyro_noise = GyroNoiseNote(recording, c.delay_s);
  if (!gyro_noise.empty()) report->notes.push_back(gyro_noise);
  const double interval = MedianInterval(recording.frames);
  if (determined(kStateReadout) && std::abs(c.readout_s) > 1.05 * interval) {
    report->doubts.push_back(
        Format("the readout time of %.1f ms is longer than the frame interval of %.1f ms",
               1e3 * c.readout_s, 1e3 * interval));
  }
  if (UnseenRatio(*report) > kUnseenRatio) {
    report->doubts.push_back(
        Format("frames that the fit has not seen fit worse: %.3f px against %.3f px, without the "
               "worst tenth of each",
               report->unseen->usual_rms_px, report->quality.usual_rms_px));
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

}  // namespace camgyro
