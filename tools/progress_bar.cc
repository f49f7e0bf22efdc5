#include "tools/progress_bar.h"

#include <gflags/gflags.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

DEFINE_bool(quiet, false, "print results and errors only");

namespace camgyro {
namespace {

constexpr int kWidth = 32;
constexpr auto kRedraw = std::chrono::milliseconds(80);

}  // namespace

ProgressBar::ProgressBar() : active_(isatty(STDERR_FILENO) != 0 && !FLAGS_quiet) {}

ProgressBar::~ProgressBar() {
  if (active_ && !stage_.empty()) std::fputs("\r\033[K", stderr);
}

void ProgressBar::Show(const std::string& stage, double done) {
  if (!active_) return;
  const auto now = std::chrono::steady_clock::now();
  if (stage == stage_ && now - drawn_ < kRedraw) return;
  if (stage != stage_) begin_ = now;
  stage_ = stage;
  drawn_ = now;
  const double share = std::clamp(done, 0.0, 1.0);
  const int filled = static_cast<int>(std::lround(share * kWidth));
  std::string bar;
  for (int i = 0; i < kWidth; ++i) bar += i < filled ? "█" : "░";
  const double elapsed_s = std::chrono::duration<double>(now - begin_).count();
  std::fprintf(stderr, "\r\033[K%-11s %s %3.0f %%", stage.c_str(), bar.c_str(), 100.0 * share);
  if (share > 0.05 && elapsed_s > 2.0) {
    std::fprintf(stderr, "  %.0f s left", elapsed_s * (1.0 - share) / share);
  }
  std::fflush(stderr);
}

}  // namespace camgyro
