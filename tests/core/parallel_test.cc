#include "core/parallel.h"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace camgyro {
namespace {

// Restores the limit of the process.
class ParallelTest : public testing::Test {
 protected:
  ~ParallelTest() override { LimitThreads(before_); }
  const int before_ = MostThreads();
};

// Lets threads pass when `count` of them have come.
class Gate {
 public:
  explicit Gate(int count) : missing_(count) {}
  // False if the others have not come within a minute.
  bool Pass() {
    std::unique_lock<std::mutex> lock(mutex_);
    if (--missing_ == 0) all_here_.notify_all();
    return all_here_.wait_for(lock, std::chrono::minutes(1), [this] { return missing_ <= 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable all_here_;
  int missing_;
};

TEST_F(ParallelTest, CallsEveryBodyOnce) {
  for (const int threads : {1, 2, 5}) {
    LimitThreads(threads);
    EXPECT_EQ(MostThreads(), threads);
    std::vector<int> calls(100, 0);
    ParallelFor(calls.size(), [&](size_t i) { ++calls[i]; });
    EXPECT_THAT(calls, testing::Each(1)) << threads;
    ParallelFor(0, [&](size_t) { FAIL(); });
  }
}

TEST_F(ParallelTest, WorksInAsManyThreadsAsItMay) {
  LimitThreads(3);
  Gate gate(3);
  std::atomic<int> passed(0);
  ParallelFor(3, [&](size_t) { passed += gate.Pass() ? 1 : 0; });
  EXPECT_EQ(passed, 3);
}

// Each of 8 bodies has work of its own for 8: no more than three threads are at it at a time.
TEST_F(ParallelTest, SharesItsThreadsWithWorkInside) {
  LimitThreads(3);
  std::atomic<int> now(0), most(0), calls(0);
  ParallelFor(8, [&](size_t) {
    ParallelFor(8, [&](size_t) {
      const int here = ++now;
      for (int seen = most; seen < here && !most.compare_exchange_weak(seen, here);) continue;
      std::this_thread::yield();
      ++calls;
      --now;
    });
  });
  EXPECT_EQ(calls, 64);
  EXPECT_LE(most, 3);
}

TEST_F(ParallelTest, OneThreadIsTheCallers) {
  LimitThreads(1);
  std::set<std::thread::id> ids;
  ParallelFor(10, [&](size_t) { ids.insert(std::this_thread::get_id()); });
  EXPECT_THAT(ids, testing::ElementsAre(std::this_thread::get_id()));

  bool ran = false;
  Beside beside([&] { ran = true; });
  EXPECT_FALSE(beside.has_thread());
  EXPECT_FALSE(ran);  // nobody waits
  beside.Wait();
  EXPECT_TRUE(ran);
}

TEST_F(ParallelTest, BesideRunsWhileItsMakerDoes) {
  LimitThreads(2);
  Gate gate(2);
  bool passed = false;
  Beside beside([&] { passed = gate.Pass(); });
  EXPECT_TRUE(beside.has_thread());
  Beside no_thread_left([] { FAIL(); });
  EXPECT_FALSE(no_thread_left.has_thread());
  EXPECT_TRUE(gate.Pass());
  beside.Wait();
  EXPECT_TRUE(passed);
  // The thread is free again.
  EXPECT_TRUE(Beside([] {}).has_thread());
}

TEST_F(ParallelTest, MadeAheadComesInOrder) {
  for (const int threads : {1, 2}) {
    LimitThreads(threads);
    std::atomic<int> made(0);
    MadeAhead<int> numbers(3, [&] { return made++; });
    for (int i = 0; i < 50; ++i) {
      ASSERT_EQ(numbers.Take(), i);
      // Three that wait, one in the making and one that was just taken.
      EXPECT_LE(made, i + (threads == 1 ? 1 : 5));
    }
  }
}

// A library that throws in a thread must not end the process.
TEST_F(ParallelTest, PassesOnWhatIsThrown) {
  for (const int threads : {1, 2}) {
    LimitThreads(threads);
    EXPECT_THROW(ParallelFor(8,
                             [](size_t i) {
                               if (i == 5) throw std::runtime_error("five");
                             }),
                 std::runtime_error);
    Beside beside([] { throw std::runtime_error("beside"); });
    EXPECT_THROW(beside.Wait(), std::runtime_error);
    int made = 0;
    MadeAhead<int> numbers(3, [&] {
      if (made == 2) throw std::runtime_error("two");
      return made++;
    });
    EXPECT_EQ(numbers.Take(), 0);
    EXPECT_EQ(numbers.Take(), 1);
    EXPECT_THROW(numbers.Take(), std::runtime_error);
  }
  LimitThreads(2);
  EXPECT_TRUE(Beside([] {}).has_thread());  // none was lost
}

}  // namespace
}  // namespace camgyro
