#include "frontend/readers/frame_order.h"

#include <cstdint>
#include <utility>

#include "frontend/readers/recording_checks.h"
#include "frontend/readers/text.h"

namespace camgyro {
namespace {

std::string Disorder(int64_t last_ns, int64_t stamp_ns) {
  return Concat("timestamp ", stamp_ns, stamp_ns == last_ns ? " repeats" : " goes back", ", after ",
                last_ns, "; expected strictly increasing stamps");
}

}  // namespace

void FrameOrder::Add(Frame frame, const std::function<std::string()>& place,
                     std::vector<Frame>* frames) {
  if (!first_ && !frames->empty() && frame.stamp_ns <= frames->back().stamp_ns) {
    first_ = place() + ": " + Disorder(frames->back().stamp_ns, frame.stamp_ns);
  }
  frames->push_back(std::move(frame));
}

Status FrameOrder::Mend(const std::string& where, Recording* recording) const {
  std::vector<int64_t> stamps_ns;
  std::optional<std::string> first = first_;
  for (const Frame& frame : recording->frames) {
    if (!first && !stamps_ns.empty() && frame.stamp_ns <= stamps_ns.back()) {
      first = Concat(where, ": frame ", stamps_ns.size() + 1, ": ",
                     Disorder(stamps_ns.back(), frame.stamp_ns));
    }
    stamps_ns.push_back(frame.stamp_ns);
  }
  if (!first) return {};
  const std::vector<size_t> in_order = LongestNonDecreasing(stamps_ns);
  std::vector<int> left_out;
  size_t next = 0;
  for (size_t i = 0; i < stamps_ns.size(); ++i) {
    const bool fits = next < in_order.size() && in_order[next] == i;
    const bool repeats = fits && next > 0 && stamps_ns[in_order[next - 1]] == stamps_ns[i];
    next += fits ? 1 : 0;
    if (!fits || repeats) left_out.push_back(static_cast<int>(i));
  }
  const size_t lost = left_out.size();
  if (TooManyLost(lost, stamps_ns.size())) {
    return BadInput(
        Concat(*first, " (", lost, " of ", stamps_ns.size(), " frames have such stamps)"));
  }
  const bool steps_back = in_order.size() < stamps_ns.size();
  LeaveOutFrames(left_out, /*repeats=*/false, recording);
  AddFault(steps_back ? "frame_stamps_step_back" : "frame_stamps_repeat", static_cast<int>(lost),
           Concat(*first, "; ", lost, " frames that do not fit into the order are left out"),
           recording);
  return {};
}

}  // namespace camgyro
