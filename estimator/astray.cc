#include "estimator/astray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/format.h"
#include "core/parallel.h"
#include "core/standard_distortion.h"
#include "estimator/residual_table.h"
#include "estimator/start/focal_scan.h"
#include "estimator/starting_point.h"
#include "estimator/window/gyro_noise.h"
#include "estimator/window/smooth_motion.h"

namespace camgyro {
namespace {

// Factor of the focal length beyond which a fit has run away: with a fisheye that nothing declares,
// half of a recording went to 10 px (FindEffects.NamesNothingWithAFocalLengthThatRanAway).
constexpr double kRunAwayFocal = 2.0;

// Change of the focal length in a round of a fit (log) that is still running away: those of
// ov_handheld_rs without its lens move by 0.25 to 0.6 in their second round.
constexpr double kStillRunning = 0.1;

// How far the focal length of a fit may be from that of the rotations at the start (log), and in
// sigmas of the latter.
constexpr double kFarFromStart = 0.2, kFarFromStartSigmas = 5.0;

// Noise with an effect over that without it, at which the effect explains what led a fit astray: a
// tenth of the variance.
constexpr double kExplained = 0.32;

// Sigmas beyond which a fit bears out an effect that nobody has asked for.
constexpr double kSeenSigmas = 3.0;

}  // namespace

// Written so that what is no number has run away, and is far.
bool RanAway(double focal_px, double from_px) {
  if (from_px == 0.0) return false;  // of attitudes, which have no lens
  return !(std::abs(std::log(focal_px / from_px)) <= std::log(kRunAwayFocal));
}

bool IsRunningAway(double before_px, double now_px, double from_px) {
  return RanAway(now_px, from_px) && !(std::abs(std::log(now_px / before_px)) <= kStillRunning);
}

bool IsFarFromRotations(double focal_px, const std::optional<StartFocal>& start) {
  if (!start || !start->determined) return false;
  const double apart = std::abs(std::log(focal_px / start->value_px));
  return !(apart <
           std::max(kFarFromStart, kFarFromStartSigmas * start->sigma_px / start->value_px));
}

bool LensFollowsTurns(const Calibration& calibration) {
  if (calibration.effects == nullptr) return false;
  const auto& items = calibration.effects->items();
  return std::any_of(items.begin(), items.end(),
                     [](const EffectSet::Item& item) { return item.effect->hides_turns(); });
}

double NoiseOverSmooth(const Recording& recording, const EstimationInput& input,
                       const Calibration& fit, double noise_px, const PairGraphOptions& options) {
  constexpr size_t kPairs = 100;
  if (recording.HasOnlyAttitudes() || !options.residual->facts().has_direction) return 0.0;
  std::vector<TimedPair> pairs;
  const size_t step = std::max<size_t>(1, input.pairs.size() / kPairs);
  for (size_t k = 0; k < input.pairs.size(); k += step) pairs.push_back(input.pairs[k]);
  AddMatches(recording, &pairs);
  const std::vector<MatchResidual> rows = ComputeResiduals(input, pairs, fit, noise_px, options);
  const Eigen::Vector2d size_px(fit.width_px, fit.height_px);
  // A gyro's noise turns the whole picture, too: what it may leave of each pair, of its length.
  const double per_second_px2 =
      std::pow(fit.lens[kFocal], 2) *
      TurnVariancePerS(options.gyro_sigma_rad_s, MedianInterval(recording.gyro));
  const double interval_s = MedianInterval(recording.frames);
  struct OfPair {
    LeftOver left;
    double of_gyro_px2;
  };
  std::vector<OfPair> of_pairs;
  for (auto begin = rows.begin(); begin != rows.end();) {
    std::vector<Eigen::Vector2d> places_px, corrections_px;
    auto row = begin;
    for (; row != rows.end() && row->frame_a == begin->frame_a && row->frame_b == begin->frame_b;
         ++row) {
      places_px.push_back(row->match.px_b);
      corrections_px.push_back(row->correction_px);
    }
    if (const auto of_pair = SeparateSmooth(places_px, corrections_px, size_px)) {
      of_pairs.push_back(
          {*of_pair, per_second_px2 * interval_s * (begin->frame_b - begin->frame_a)});
    }
    begin = row;
  }
  // A picture that is shown twice, or a frame that is late, is one pair's, not the model's: a pair
  // may leave 10000 times what the others do.
  constexpr double kWorst = 0.1;
  std::sort(of_pairs.begin(), of_pairs.end(),
            [](const OfPair& a, const OfPair& b) { return a.left.all < b.left.all; });
  of_pairs.resize(of_pairs.size() - static_cast<size_t>(kWorst * of_pairs.size()));
  LeftOver sum;
  double of_gyro_px2 = 0.0;
  for (const OfPair& pair : of_pairs) {
    sum.all += pair.left.all;
    sum.unsmooth += pair.left.unsmooth;
    of_gyro_px2 += pair.of_gyro_px2;
  }
  const double all = std::max(std::min(sum.all, sum.unsmooth), sum.all - of_gyro_px2);
  return sum.unsmooth > 0.0 ? std::sqrt(all / sum.unsmooth) : 0.0;
}

void LookThroughFittedLens(const Recording& recording, const CalibrateOptions& options,
                           const CameraRotationsAt& rotations_at, CalibrationReport* report) {
  const Calibration& c = report->calibration;
  const std::optional<StartStabiliser>& found = report->start.stabiliser;
  if (LensFollowsTurns(c) && !(found && found->follows_turns) && report->start.focal) {
    report->start.focal->determined = false;
  }
  const LensParameters lens = c.FullLens();
  if (recording.HasOnlyAttitudes() || !rotations_at || lens == c.lens ||
      !IsFarFromRotations(c.lens[kFocal], report->start.focal)) {
    return;
  }
  const DistortionCoefficients distortion =
      StandardDistortion(c.distortion_model, lens, Eigen::Vector2d(c.width_px, c.height_px));
  Recording with = recording;
  with.camera.aspect_ratio = lens[kAspect];
  with.camera.distortion_model = distortion.model;
  with.camera.distortion.assign(distortion.k.data(), distortion.k.data() + 4);
  const Result<StartResult> start =
      FindStartFromPictures(with, rotations_at, options.start, options.focal_scan);
  if (start) report->start.focal = start->focal;
}

std::string Implausible(const EffectSet::Item& item, const Calibration& fit,
                        double start_focal_px) {
  for (int k = 0; k < item.effect->size(); ++k) {
    const EffectParameter& p = item.effect->parameters()[static_cast<size_t>(k)];
    const double value = fit.effect_values[item.first + k];
    const double sigma = std::sqrt(fit.effect_covariance(item.first + k, item.first + k));
    if (value < p.plausible_min - kImplausibleSigmas * sigma ||
        value > p.plausible_max + kImplausibleSigmas * sigma) {
      return p.name + " outside of what real devices show";
    }
  }
  return RanAway(fit.lens[kFocal], start_focal_px) ? "the fit runs away with it" : "";
}

bool IsSeen(const EffectSet::Item& item, const Calibration& fit) {
  const auto n = item.effect->size();
  const Eigen::VectorXd sigma =
      fit.effect_covariance.diagonal().segment(item.first, n).cwiseMax(0.0).cwiseSqrt();
  return (fit.effect_values.segment(item.first, n).cwiseAbs().array() > kSeenSigmas * sigma.array())
      .any();
}

bool IsBornOut(const CalibrationReport& fit, const std::string& effect, double begin_focal_px,
               double noise_px) {
  const Calibration& c = fit.calibration;
  if (c.effects == nullptr || !(fit.quality.noise_px < noise_px) ||
      IsFarFromRotations(c.lens[kFocal], fit.start.focal)) {
    return false;
  }
  const auto& items = c.effects->items();
  return std::any_of(items.begin(), items.end(), [&](const EffectSet::Item& item) {
    return item.entry->name == effect && Implausible(item, c, begin_focal_px).empty() &&
           IsSeen(item, c);
  });
}

double UnseenRms(const CalibrationReport& fit) {
  return fit.unseen ? fit.unseen->rms_px : fit.quality.rms_px;
}

std::optional<CalibrationReport> FitWithWhatLeadsAstray(
    const Recording& recording, const StartResult& start, const Calibration& from,
    const std::optional<AstrayFit>& astray,
    const std::function<Result<CalibrationReport>(const std::string& effect)>& fit_with) {
  constexpr size_t kTogether = 2;  // whatever the number of threads: a fixed order of trials
  const double noise_px = astray ? astray->noise_px : std::numeric_limits<double>::infinity();
  std::optional<CalibrationReport> best;
  const EffectEntry* added = nullptr;
  EffectSetup setup = MakeEffectSetup(recording, from);
  TellOfStabiliser(start, &setup);
  for (const EffectEntry& entry : EffectCatalogue()) {
    if (!entry.leads_astray || (from.effects != nullptr && from.effects->Has(entry.name))) continue;
    const double enough_px = noise_px * kExplained;
    std::vector<std::string> shapes = entry.shapes(setup);
    std::reverse(shapes.begin(), shapes.end());
    for (size_t begin = 0; begin < shapes.size(); begin += kTogether) {
      std::vector<Result<CalibrationReport>> fits(std::min(kTogether, shapes.size() - begin));
      ParallelFor(fits.size(),
                  [&](size_t i) { fits[i] = fit_with(entry.name + ":" + shapes[begin + i]); });
      for (Result<CalibrationReport>& fit : fits) {
        if (!fit || !IsBornOut(*fit, entry.name, from.lens[kFocal], noise_px)) continue;
        if (best && !(UnseenRms(*fit) < UnseenRms(*best))) continue;
        best = *std::move(fit);
        added = &entry;
      }
      if (best && added == &entry && best->quality.noise_px < enough_px) break;
    }
    if (!astray || (best ? best->noise_over_smooth : astray->over_smooth) <= kNoiseOfAstray) break;
  }
  if (!best) return best;
  const std::string without =
      astray
          ? Format(
                "without it the focal length was %.0f px (%.0f at the start), and the noise "
                "was %.2f instead of %.2f px",
                astray->focal_px, from.lens[kFocal], astray->noise_px, best->quality.noise_px)
          : Format("the matches alone show it (it moves corners of the picture by about %+.0f %%)",
                   100.0 * recording.camera.division_lambda);
  best->notes.push_back(added->name + " is fitted as well, although nobody asked for it: " +
                        without + "; " + added->advice);
  return best;
}

}  // namespace camgyro
