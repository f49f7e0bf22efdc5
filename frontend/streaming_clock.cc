#include "frontend/streaming_clock.h"

#include <algorithm>

#include "core/time.h"
#include "frontend/stamp_clock.h"

namespace camgyro {
namespace {

constexpr double kFirstLookS = 2.0;
constexpr double kBetweenLooksS = 0.25;
constexpr double kHeldS = 0.25;  // as FindStampClock looks ahead
constexpr double kRememberedS = 20.0;
constexpr size_t kMostRemembered = 40'000;

}  // namespace

void StreamingClock::Add(const GyroSample& sample, std::vector<GyroSample>* passed) {
  if (recent_ns_.empty()) first_ns_ = looked_ns_ = sample.stamp_ns;
  recent_ns_.push_back(sample.stamp_ns);
  held_.push_back(sample);
  const bool first = !report_;
  const double wait_s = first ? kFirstLookS : kBetweenLooksS;
  if (SecondsSince(looked_ns_, sample.stamp_ns) >= wait_s || recent_ns_.size() > kMostRemembered) {
    Look();
  } else if (first) {
    return;
  }
  if (!report_->repaired) {
    for (const GyroSample& held : held_) Pass(held, passed);
    held_.clear();
    return;
  }
  if (sampled_ns_.empty()) return;  // not looked at since
  size_t index = sampled_ns_.size() - held_.size();
  while (!held_.empty() && SecondsSince(held_.front().stamp_ns, sample.stamp_ns) > kHeldS) {
    GyroSample at_clock = held_.front();
    at_clock.stamp_ns = sampled_ns_[index++];
    held_.pop_front();
    Pass(at_clock, passed);
  }
  sampled_ns_.clear();
}

void StreamingClock::Look() {
  looked_ns_ = recent_ns_.back();
  // The held ones stay remembered.
  const auto old = std::find_if(recent_ns_.begin(), recent_ns_.end(), [&](int64_t stamp_ns) {
    return SecondsSince(stamp_ns, recent_ns_.back()) <= kRememberedS;
  });
  const auto excess = static_cast<std::ptrdiff_t>(
      recent_ns_.size() > kMostRemembered ? recent_ns_.size() - kMostRemembered / 2 : 0);
  const auto most = static_cast<std::ptrdiff_t>(recent_ns_.size() - held_.size());
  const auto drop = std::min(most, std::max(old - recent_ns_.begin(), excess));
  recent_ns_.erase(recent_ns_.begin(), recent_ns_.begin() + drop);

  const bool was_repaired = report_ && report_->repaired;
  StampClock clock = FindStampClock(recent_ns_, /*even_if_clean=*/was_repaired);
  report_ = clock.report;
  if (was_repaired) report_->kind = StampKind::kArrival;
  report_->repaired = was_repaired || clock.report.kind == StampKind::kArrival;
  // Without a clock for now (after a long gap, say), what is held goes on as recorded.
  sampled_ns_ = clock.sampled_ns.empty() ? recent_ns_ : std::move(clock.sampled_ns);
}

void StreamingClock::Pass(const GyroSample& sample, std::vector<GyroSample>* passed) {
  passed->push_back(sample);
  int64_t& stamp_ns = passed->back().stamp_ns;
  if (passed_ns_ && stamp_ns <= *passed_ns_) stamp_ns = *passed_ns_ + 1;
  passed_ns_ = stamp_ns;
}

}  // namespace camgyro
