// The targets of the fuzzer as an ordinary test: seeds are sound, files that once brought a reader
// down are answered, and so are seeds with damage, the same in every run.
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/fuzz/targets.h"
#include "tests/paths.h"

namespace camgyro {
namespace {

namespace fs = std::filesystem;

class Fuzz : public ::testing::TestWithParam<FuzzTarget> {};

// Otherwise the fuzzer would begin at a refusal, and hardly get behind it.
TEST_P(Fuzz, SeedsAreSound) {
  const FuzzFolder folder(GetParam());
  for (const std::string& seed : Seeds(GetParam())) {
    const Status answer = folder.Read(seed);
    EXPECT_TRUE(answer) << answer.error().message;
  }
}

// tests/fuzz/found/TARGET has what tools/fuzz.sh has found.
TEST_P(Fuzz, WhatWasFoundIsAnswered) {
  const FuzzFolder folder(GetParam());
  const fs::path found = fs::path(SourceDir()) / "tests/fuzz/found" / GetParam().name;
  if (!fs::exists(found)) return;
  for (const fs::directory_entry& file : fs::directory_iterator(found)) {
    SCOPED_TRACE(file.path());
    std::ifstream in(file.path(), std::ios::binary);
    EXPECT_EQ(folder.Flaw(folder.Read({std::istreambuf_iterator<char>(in), {}})), "");
  }
}

// One of the ways in which files break, or are broken: other bits, an end too early, a part that is
// there twice, a number that is as large as it can be.
std::string Damaged(std::string bytes, std::mt19937* random) {
  const auto below = [&](size_t end) { return (*random)() % std::max<size_t>(end, 1); };
  for (size_t times = 1 + below(3); times > 0 && !bytes.empty(); --times) {
    const size_t at = below(bytes.size());
    switch (below(5)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 1:
        bytes.resize(at);
        break;
      case 2: {
        const std::string part = bytes.substr(at, below(64));
        bytes.insert(at, part);
        break;
      }
      case 3:
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    std::min<size_t>(4, bytes.size() - at), '\xff');
        break;
      default:
        bytes.insert(at, "-9223372036854775808");
    }
  }
  return bytes;
}

TEST_P(Fuzz, DamageIsAnswered) {
  constexpr int kDamaged = 40;  // of each seed: 3 s for all targets, 2 of them for videos
  const FuzzFolder folder(GetParam());
  std::mt19937 random(1);
  for (const std::string& seed : Seeds(GetParam())) {
    for (int i = 0; i < kDamaged; ++i) {
      const std::string damaged = Damaged(seed, &random);
      EXPECT_EQ(folder.Flaw(folder.Read(damaged)), "") << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Fuzz, ::testing::ValuesIn(FuzzTargets()),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace camgyro
