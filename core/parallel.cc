#include "core/parallel.h"

#include <algorithm>
#include <atomic>
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

void GiveHelperBack() { --Helpers(); }

}  // namespace

void LimitThreads(int most) { Limit() = std::max(1, most); }

int MostThreads() { return Limit(); }

void ParallelFor(size_t count, const std::function<void(size_t)>& body) {
  std::atomic<size_t> next(0);
  const auto work = [&] {
    for (size_t i = next++; i < count; i = next++) body(i);
  };
  std::vector<std::thread> threads;
  while (threads.size() + 1 < count && TakeHelper()) {
    threads.emplace_back([&] {
      work();
      GiveHelperBack();
    });
  }
  work();
  for (std::thread& thread : threads) thread.join();
}

Beside::Beside(std::function<void()> work) : work_(std::move(work)), has_thread_(TakeHelper()) {
  if (!has_thread_) return;
  thread_ = std::thread([this] {
    work_();
    GiveHelperBack();
  });
}

Beside::~Beside() {
  if (thread_.joinable()) thread_.join();
}

void Beside::Wait() {
  if (has_thread_) {
    thread_.join();
  } else {
    work_();
  }
}

}  // namespace camgyro
