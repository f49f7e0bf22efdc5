// A progress bar on stderr, while somebody watches.
#ifndef CAMGYRO_TOOLS_PROGRESS_BAR_H_
#define CAMGYRO_TOOLS_PROGRESS_BAR_H_

#include <chrono>
#include <string>

namespace camgyro {

// Draws only if stderr is a terminal and --quiet was not given; wipes itself at the end.
class ProgressBar {
 public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // done: share 0..1 of the stage.
  void Show(const std::string& stage, double done);

 private:
  const bool active_;
  std::string stage_;
  std::chrono::steady_clock::time_point begin_, drawn_;
};

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_PROGRESS_BAR_H_
