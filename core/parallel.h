// Work in several threads, whose results do not depend on how many there are.
#ifndef CAMGYRO_CORE_PARALLEL_H_
#define CAMGYRO_CORE_PARALLEL_H_

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <future>
#include <mutex>
#include <utility>

namespace camgyro {

// How many threads work in this process at most, the caller's own included: one per core, if nobody
// says otherwise. It is of the process and not of a call, because cores are, too: work within work
// finds the threads that are free, and no more. No result depends on it.
void LimitThreads(int most);  // at least 1
int MostThreads();

// Calls body(0) to body(count - 1), each once, in any order and in as many threads as are free;
// returns when all are done. What a body writes is its own, so that the order does not matter.
// Passes on what a body throws, when no body runs any more.
void ParallelFor(size_t count, const std::function<void(size_t)>& body);

// A function that runs beside the caller if a thread is free when this is made, else when it is
// waited for; not at all if nobody waits.
class Beside {
 public:
  explicit Beside(std::function<void()> work);  // the destructor waits for the thread

  bool has_thread() const { return has_thread_; }
  // Returns when the function has returned, and passes on what it throws; to be called once.
  void Wait();

 private:
  std::function<void()> work_;
  std::future<void> done_;
  bool has_thread_ = false;
};

// What a function gives, call after call, made up to `most` calls ahead of who takes it if a thread
// is free, else on demand. It is called more often than somebody takes, and not after the
// destructor has returned. What it throws, Take() throws in its place.
template <typename T>
class MadeAhead {
 public:
  MadeAhead(size_t most, std::function<T()> make)
      : most_(most), make_(std::move(make)), maker_([this] { MakeAll(); }) {}
  ~MadeAhead() {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
    changed_.notify_all();
  }

  T Take() {
    if (!maker_.has_thread()) return make_();
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !made_.empty() || failure_; });
    if (made_.empty()) std::rethrow_exception(failure_);
    T first = std::move(made_.front());
    made_.pop_front();
    changed_.notify_all();
    return first;
  }

 private:
  void MakeAll() {
    try {
      MakeUntilStopped();
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      failure_ = std::current_exception();
      changed_.notify_all();
    }
  }
  void MakeUntilStopped() {
    for (;;) {
      {
        std::unique_lock<std::mutex> lock(mutex_);
        changed_.wait(lock, [this] { return stop_ || made_.size() < most_; });
        if (stop_) return;
      }
      T next = make_();
      const std::lock_guard<std::mutex> lock(mutex_);
      made_.push_back(std::move(next));
      changed_.notify_all();
    }
  }

  const size_t most_;
  const std::function<T()> make_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<T> made_;
  bool stop_ = false;
  std::exception_ptr failure_;
  Beside maker_;  // last: its thread uses all else, and ends first
};

}  // namespace camgyro

#endif  // CAMGYRO_CORE_PARALLEL_H_
