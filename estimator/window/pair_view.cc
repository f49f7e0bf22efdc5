#include "estimator/window/pair_view.h"

#include <algorithm>

namespace camgyro {

bool RatesOfPair(const EstimationInput& input, const TimedPair& pair,
                 const Calibration& calibration, std::vector<double>* times_s,
                 Eigen::Matrix3Xd* rates) {
  const auto [from, to] = ExposureSpan({calibration.delay_s, calibration.readout_s},
                                       Eigen::Vector2d(calibration.width_px, calibration.height_px),
                                       calibration.pair_effects(), pair.first(), pair.second());
  const auto by_time = [](const TimedRate& rate, double t) { return rate.time_s < t; };
  auto first = std::lower_bound(input.rates.begin(), input.rates.end(), from, by_time);
  auto last = std::lower_bound(input.rates.begin(), input.rates.end(), to, by_time);
  if (first == input.rates.begin() || last == input.rates.end()) return false;
  --first;
  ++last;
  const double longest = std::max(0.03, 5.0 * (input.rates.back().time_s - input.rates[0].time_s) /
                                            static_cast<double>(input.rates.size()));
  times_s->clear();
  rates->resize(3, last - first);
  for (auto it = first; it != last; ++it) {
    if (it != first && it->time_s - std::prev(it)->time_s > longest) return false;
    times_s->push_back(it->time_s);
    rates->col(it - first) = TrueRate(calibration.pair_effects(), it->time_s,
                                      it->omega_gyro_rad_s - calibration.bias_gyro_rad_s);
  }
  return true;
}

bool ViewPair(const EstimationInput& input, const TimedPair& pair, const Calibration& calibration,
              double noise_px, const PairGraphOptions& options, PairView* view) {
  PairMeasurement& m = view->measurement;
  if (!RatesOfPair(input, pair, calibration, &m.rate_times_s, &view->rates)) return false;
  m.rate_group_sizes = {static_cast<int>(m.rate_times_s.size())};
  m.frame_a = pair.first();
  m.frame_b = pair.second();
  m.size_px << calibration.width_px, calibration.height_px;
  m.sigma_px = noise_px;
  m.noise = options.match_noise;
  m.robust_threshold = options.robust_threshold;
  m.lens = &GetLens(calibration.distortion_model);
  m.matches.clear();
  m.effects = calibration.pair_effects().set != nullptr ? calibration.effects : nullptr;
  const RotationChain chain(m.rate_times_s, view->rates);
  const ShutterParameters shutter(calibration.delay_s, calibration.readout_s);
  const Eigen::Matrix3d R_gyro_cam = calibration.q_gyro_cam.toRotationMatrix();
  view->bearings = {};
  Bearing a, b;
  for (const Match& match : pair.matches) {
    if (EvaluateBearing(*m.lens, calibration.lens, shutter, R_gyro_cam, chain, m.frame_a, m.size_px,
                        match.px_a, calibration.pair_effects(), &a) &&
        EvaluateBearing(*m.lens, calibration.lens, shutter, R_gyro_cam, chain, m.frame_b, m.size_px,
                        match.px_b, calibration.pair_effects(), &b)) {
      m.matches.push_back(match);
      view->bearings.a.push_back(a);
      view->bearings.b.push_back(b);
    }
  }
  return true;
}

}  // namespace camgyro
