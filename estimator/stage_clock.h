// How long each stage of an estimation took.
#ifndef CAMGYRO_ESTIMATOR_STAGE_CLOCK_H_
#define CAMGYRO_ESTIMATOR_STAGE_CLOCK_H_

#include <chrono>
#include <string>
#include <vector>

namespace camgyro {

struct StageTime {
  std::string stage;
  double seconds = 0.0;
};

// Runs from when it is made, and from the end of one stage to that of the next.
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

}  // namespace camgyro

#endif  // CAMGYRO_ESTIMATOR_STAGE_CLOCK_H_
