#include "core/parallel.h"

#include <algorithm>
#include <atomic>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace camgyro {
namespace {

int Cores() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

std::atomic<int>& Limit() {
  static std::atomic<int> limit(Cores());
  return limit;
}

// Threads that work beside the one that the program began with.
std::atomic<int>& Helpers() {
  static std::atomic<int> helpers(0);
  return helpers;
}

// Takes a thread, if one is free.
bool TakeHelper() {
  int now = Helpers().load();
  while (now < Limit().load() - 1) {
    if (Helpers().compare_exchange_weak(now, now + 1)) return true;
  }
  return false;
}

// Runs the work in a thread, if one is free; else the future has no state.
std::future<void> InHelper(std::function<void()> work) {
  if (!TakeHelper()) return {};
  try {
    return std::async(std::launch::async, [work = std::move(work)] {
      struct GiveBack {
        ~GiveBack() { --Helpers(); }
      } const give_back;
      work();
    });
  } catch (const std::system_error&) {  // the system has no thread left
    --Helpers();
    return {};
  }
}

}  // namespace

void LimitThreads(int most) { Limit() = std::max(1, most); }

int MostThreads() { return Limit(); }

void ParallelFor(size_t count, const std::function<void(size_t)>& body) {
  std::atomic<size_t> next(0);
  const auto work = [&] {
    for (size_t i = next++; i < count; i = next++) body(i);
  };
  std::vector<std::future<void>> helpers;  // their destructors wait, should work() throw
  while (helpers.size() + 1 < count) {
    std::future<void> helper = InHelper(work);
    if (!helper.valid()) break;
    helpers.push_back(std::move(helper));
  }
  work();
  for (std::future<void>& helper : helpers) helper.get();
}

Beside::Beside(std::function<void()> work)
    : work_(std::move(work)), done_(InHelper(work_)), has_thread_(done_.valid()) {}

void Beside::Wait() {
  if (has_thread_) {
    done_.get();
  } else {
    work_();
  }
}

}  // namespace camgyro
