#include "estimator/diagnosis/contest.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/effects/catalogue.h"
#include "core/linear_algebra.h"
#include "core/parallel.h"
#include "estimator/astray.h"
#include "estimator/diagnosis/gain_rule.h"
#include "estimator/diagnosis/thresholds.h"

namespace camgyro {
namespace {

constexpr char kAnotherExplainsMore[] = "another explains more";

struct Rival {
  size_t at;  // index into the contestants
  Refined fit;
  std::vector<double> gain;  // by block of the choice share
};

// By the effect that was added last.
std::string ImplausibleByItsLast(const Calibration& fit, double start_focal_px) {
  return Implausible(fit.effects->items().back(), fit, start_focal_px);
}

class Contest {
 public:
  Contest(const ContestSetting& setting, std::vector<Contestant>* all)
      : fits_(*setting.fits),
        now_(*setting.now),
        choice_(*setting.choice),
        delay_moves_(setting.delay_moves),
        noise_(setting.now->quality.noise_px),
        most_noise_(kMostNoiseOfRival * noise_),
        ran_away_(setting.first_round &&
                  RanAway(now_.calibration.lens[kFocal], fits_.in().start.lens[kFocal])),
        all_(*all) {
    const CandidateResult& front = all_.front().result;
    best_gain_ = front.rejected.empty() ? front.gain.sum : 0.0;
    astray_ = setting.first_round &&
              (best_gain_ > kStrongMisfit * Chi2Of(choice_) || fits_.HasRunAway(now_.calibration));
  }

  std::optional<ContestResult> Run() {
    if (ran_away_) RefitWhatLeadsAstray();
    if (rivals_.empty()) {
      size_t next = 0;
      RefitTogether(NextTogether(kFirstRivals, &next));
      while (next < all_.size()) RefitTogether(NextTogether(all_.size(), &next));
    }
    if (rivals_.empty()) return std::nullopt;
    const size_t winner = Winner();
    for (size_t i = 0; i < rivals_.size(); ++i) {
      if (i != winner) all_[rivals_[i].at].result.rejected = kAnotherExplainsMore;
    }
    return ContestResult{rivals_[winner].at, std::move(rivals_[winner].fit)};
  }

  std::optional<ContestResult> RunLastResort() {
    for (size_t i = 0; i < all_.size(); ++i) {
      if (!all_[i].candidate.is_last_resort() || !all_[i].result.rejected.empty()) continue;
      if (std::optional<Rival> rival = RefitRival(i)) {
        return ContestResult{i, std::move(rival->fit)};
      }
    }
    return std::nullopt;
  }

 private:
  void RefitTogether(const std::vector<size_t>& together) {
    std::vector<std::optional<Rival>> refitted(together.size());
    ParallelFor(together.size(), [&](size_t k) {
      const size_t i = together[k];
      refitted[k] = all_[i].candidate.widens_prior() ? RefitWidened(i) : RefitRival(i);
    });
    for (std::optional<Rival>& rival : refitted) {
      if (rival) rivals_.push_back(std::move(*rival));
    }
  }

  // Before all others, and one effect after the other, in the order of the catalogue: the lens
  // first. Where one of these brings the fit back, the others are tested beside it in the next
  // round: what their linear gains say at the end of a fit that ran away is nothing.
  void RefitWhatLeadsAstray() {
    for (const EffectEntry& entry : EffectCatalogue()) {
      if (!entry.leads_astray) continue;
      std::vector<size_t> together;
      for (size_t i = 0; i < all_.size(); ++i) {
        if (all_[i].candidate.entry != &entry) continue;
        CandidateResult& r = all_[i].result;
        r.tried_anyway = !r.rejected.empty();
        r.rejected.clear();
        together.push_back(i);
      }
      RefitTogether(together);
      if (!rivals_.empty()) {
        WaitForTheFit(entry);
        break;
      }
    }
    what_led_astray_is_refitted_ = true;
  }

  // All but the effect that has brought the fit back.
  void WaitForTheFit(const EffectEntry& back) {
    for (Contestant& other : all_) {
      if (other.candidate.entry == &back || !other.result.rejected.empty()) continue;
      other.result.rejected = "asked when the fit is back";
    }
  }

  // Contestants from *next on, at most so many, that are refitted whatever comes of those before
  // them here: with each, there is at most one rival more. *next becomes the first of the others.
  std::vector<size_t> NextTogether(size_t at_most, size_t* next) {
    std::vector<size_t> together;
    for (; *next < all_.size() && together.size() < at_most; ++*next) {
      if (all_[*next].candidate.is_last_resort()) continue;
      if (what_led_astray_is_refitted_ && all_[*next].candidate.entry->leads_astray) continue;
      CandidateResult& r = all_[*next].result;
      const bool in_any_case = TriedInAnyCase(*all_[*next].candidate.entry);
      const bool widens = all_[*next].candidate.widens_prior();
      const auto most = static_cast<size_t>(fits_.options().max_rivals);
      if (r.rejected.empty() && !in_any_case && !widens && !together.empty() &&
          rivals_.size() + together.size() >= most) {
        break;
      }
      if (in_any_case && !r.rejected.empty()) {
        r.tried_anyway = true;
        r.rejected.clear();
      }
      if (!r.rejected.empty()) continue;
      if (!in_any_case && !widens &&
          (rivals_.size() >= most || r.gain.sum < kLeastGainOfRival * best_gain_)) {
        r.rejected = "others gain more";
        continue;
      }
      together.push_back(*next);
    }
    return together;
  }

  // Far from where the model belongs, a linear gain says little: then what throws the plain model
  // off most is tried in any case, and from where it all began. So is a step of a delay that moves:
  // where it leaves most matches beyond the loss, their scores scatter, or are nothing.
  bool TriedInAnyCase(const EffectEntry& entry) const {
    return (astray_ && entry.leads_astray) || (delay_moves_ && entry.step_at != nullptr);
  }

  // It frees numbers of every pair, whose gain the likelihood ratio has discounted: that one
  // stands, not the fall of chi2.
  std::optional<Rival> RefitWidened(size_t i) {
    auto& [r, candidate] = all_[i];
    Calibration start = now_.calibration;
    AddEffect(candidate, &start);
    const Result<Refined> fit = fits_.Fit(start, noise_);
    if (!fit) return std::nullopt;
    r.rejected = ImplausibleByItsLast(fit->calibration, fits_.in().start.lens[kFocal]);
    if (!r.rejected.empty()) return std::nullopt;
    r.refitted = true;
    return Rival{i, *fit, LatentGain(choice_)};
  }

  // Beyond, a refit is given up: it has more noise than the fit without it, or so much more than
  // one of the rivals that it cannot gain as much.
  double MostNoise() const {
    double least = noise_;
    for (const Rival& rival : rivals_) {
      if (all_[rival.at].candidate.widens_prior()) continue;  // numbers of its own in every pair
      least = std::min(least, rival.fit.quality.noise_px);
    }
    return kMostNoiseOfRival * least;
  }

  // The better of a fit from the present one and, where the model is astray, one from the start.
  // With what sends fits away, the end of one that ran away is nowhere to begin from.
  Result<Refined> FitWith(const CandidateResult& r, const Candidate& candidate) const {
    Calibration start = now_.calibration;
    AddEffect(candidate, &start);
    const int columns = candidate.effect->size();
    if (r.start.size() == columns) start.effect_values.tail(columns) = r.start;
    start.delay_s += r.start_delay_change_s;
    Calibration anew = fits_.in().start;
    AddEffect(candidate, &anew);
    const double most_noise = MostNoise();
    const auto from_start = [&] { return fits_.Fit(anew, fits_.in().noise, nullptr, most_noise); };
    if (ran_away_ && candidate.entry->leads_astray) return from_start();
    Result<Refined> fit = fits_.Fit(start, noise_, nullptr, most_noise);
    if (!astray_) return fit;
    const Result<Refined> other = from_start();
    const auto rank = [&](const Refined& f) {
      return std::pair(!ImplausibleByItsLast(f.calibration, fits_.in().start.lens[kFocal]).empty(),
                       f.quality.rms_px);
    };
    if (other && (!fit || rank(*other) < rank(*fit))) fit = other;
    return fit;
  }

  std::optional<Rival> RefitRival(size_t i) {
    auto& [r, candidate] = all_[i];
    Result<Refined> fit = FitWith(r, candidate);
    if (fit && fit->quality.noise_px > MostNoise()) {
      const bool by_itself = fit->quality.noise_px > most_noise_;
      r.rejected = by_itself ? "with it, the fit leads nowhere" : kAnotherExplainsMore;
      return std::nullopt;
    }
    if (fit && candidate.entry->step_at && fits_.PlaceSteps(noise_, &fit->calibration)) {
      r.shape = fit->calibration.effects->items().back().shape;
      fit = fits_.Fit(fit->calibration, noise_, fit->latents, MostNoise());
    }
    if (!fit) {
      r.rejected = "the fit with it failed: " + fit.error().message;
      return std::nullopt;
    }
    fit = fits_.Settle(*std::move(fit));
    r.refitted = true;
    const Scores with = fits_.ScoresOf(fits_.shares().choice, fit->calibration, nullptr, noise_);
    Rival rival{i, *fit, Fall(choice_, with)};
    r.gain = SumOf(rival.gain);
    const EffectSet::Item& item = fit->calibration.effects->items().back();
    r.estimate = fit->calibration.effect_values.segment(item.first, item.effect->size());
    r.sigma = fit->calibration.effect_covariance.diagonal()
                  .segment(item.first, item.effect->size())
                  .cwiseSqrt();
    r.rejected = WhyNot(r, fit->calibration);
    if (!r.rejected.empty()) return std::nullopt;
    return rival;
  }

  // Empty: nothing speaks against it.
  std::string WhyNot(const CandidateResult& r, const Calibration& fit) const {
    std::string implausible = ImplausibleByItsLast(fit, fits_.in().start.lens[kFocal]);
    if (!implausible.empty()) return implausible;
    if (!GainBearsOut(r, static_cast<double>(all_.size()))) {
      return "no gain on unseen frames beyond its noise";
    }
    // One that its score does not name is corrected for what could have been tried in its place:
    // a step in every stretch.
    const size_t stretches = fits_.shares().fit.size() + fits_.shares().choice.size();
    const double chances = r.tried_anyway ? static_cast<double>(all_.size() * stretches) : 1.0;
    if (chances * PValueOfFit(fit, r.inflation, r.gain.sum) > fits_.options().significance) {
      return "not significant once fitted";
    }
    return "";
  }

  // Of the rivals: the largest gain, or one with fewer parameters that is no worse beyond the noise
  // of the difference.
  size_t Winner() const {
    const auto gain_of = [&](const Rival& rival) { return all_[rival.at].result.gain.sum; };
    const auto size_of = [&](const Rival& rival) { return all_[rival.at].candidate.complexity(); };
    size_t winner = 0;
    for (size_t i = 1; i < rivals_.size(); ++i) {
      if (gain_of(rivals_[i]) > gain_of(rivals_[winner])) winner = i;
    }
    for (size_t i = 0; i < rivals_.size(); ++i) {
      if (size_of(rivals_[i]) >= size_of(rivals_[winner]) ||
          rivals_[i].gain.size() != rivals_[winner].gain.size()) {
        continue;
      }
      std::vector<double> difference;
      for (size_t b = 0; b < rivals_[i].gain.size(); ++b) {
        difference.push_back(rivals_[winner].gain[b] - rivals_[i].gain[b]);
      }
      const Gain behind = SumOf(difference);
      if (behind.sum < kBehindSigmas * behind.sigma) winner = i;
    }
    return winner;
  }

  const SharedFits& fits_;
  const Refined& now_;
  const Scores& choice_;
  const bool delay_moves_;
  const double noise_, most_noise_;
  const bool ran_away_;
  std::vector<Contestant>& all_;
  double best_gain_ = 0.0;
  bool astray_ = false;
  bool what_led_astray_is_refitted_ = false;
  std::vector<Rival> rivals_;
};

}  // namespace

std::optional<ContestResult> RunContest(const ContestSetting& setting,
                                        std::vector<Contestant>* contestants) {
  if (contestants->empty()) return std::nullopt;
  return Contest(setting, contestants).Run();
}

std::optional<ContestResult> RunLastResort(const ContestSetting& setting,
                                           std::vector<Contestant>* contestants) {
  if (contestants->empty()) return std::nullopt;
  return Contest(setting, contestants).RunLastResort();
}

double PValueOfFit(const Calibration& fit, double inflation, double gain) {
  const EffectSet::Item& item = fit.effects->items().back();
  const int n = item.effect->size();
  const Eigen::VectorXd value = fit.effect_values.segment(item.first, n);
  const Eigen::MatrixXd covariance = fit.effect_covariance.block(item.first, item.first, n, n);
  const double statistic = value.dot(LeastSquares(covariance, value).col(0));
  return ChiSquareTail((statistic + std::max(0.0, gain)) / std::max(1.0, inflation), 2 * n);
}

}  // namespace camgyro
