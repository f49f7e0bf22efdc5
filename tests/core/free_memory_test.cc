#include "core/free_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <vector>

namespace camgyro {
namespace {

#ifndef __has_feature
#define __has_feature(name) 0  // of clang, which the builds with sanitizers use
#endif
constexpr bool kOwnMalloc = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);

double ResidentMegabytes() {
  std::ifstream in("/proc/self/statm");
  double size = 0.0, resident = 0.0;
  in >> size >> resident;
  return 1e-6 * resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// 100 MB in blocks of 10 kB, of which every hundredth stays, so that there is one in use behind
// almost all that is freed: malloc alone keeps them.
TEST(FreeMemory, BetweenBlocksInUseIsGivenBack) {
  if (kOwnMalloc) GTEST_SKIP() << "a sanitizer's malloc keeps what is freed";
  constexpr size_t kBlocks = 10000, kBytes = 10000;
  std::vector<std::unique_ptr<char[]>> blocks;
  for (size_t i = 0; i < kBlocks; ++i) blocks.push_back(std::make_unique<char[]>(kBytes));
  const double full = ResidentMegabytes();
  for (size_t i = 0; i < kBlocks; ++i) {
    if (i % 100 != 99) blocks[i].reset();
  }
  const double freed = ResidentMegabytes();
  GiveBackFreeMemory();
  const double given_back = ResidentMegabytes();
  EXPECT_GT(freed, full - 10.0);
  EXPECT_LT(given_back, full - 90.0);
  EXPECT_EQ(blocks[99][kBytes - 1], 0);
}

}  // namespace
}  // namespace camgyro
