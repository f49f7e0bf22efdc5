// libFuzzer's program over the targets; tools/fuzz.sh runs it.
//   camgyro_fuzz --list                              names of the targets
//   camgyro_fuzz --target=NAME --write-seeds=FOLDER  writes the target's seeds
//   camgyro_fuzz --target=NAME FOLDER -OPTION...     fuzzes, with libFuzzer's options
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "tests/fuzz/targets.h"

namespace {

const camgyro::FuzzTarget* g_target = nullptr;

[[noreturn]] void WriteSeeds(const std::string& folder) {
  std::filesystem::create_directories(folder);
  int count = 0;
  for (const std::string& seed : camgyro::Seeds(*g_target)) {
    std::ofstream(folder + "/seed" + std::to_string(count++), std::ios::binary) << seed;
  }
  std::exit(0);
}

}  // namespace

// libFuzzer passes over arguments that begin with --.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  std::string seeds;
  for (int i = 1; i < *argc; ++i) {
    const std::string argument = (*argv)[i];
    for (const camgyro::FuzzTarget& target : camgyro::FuzzTargets()) {
      if (argument == "--list") std::puts(target.name);
      if (argument == std::string("--target=") + target.name) g_target = &target;
    }
    if (argument == "--list") std::exit(0);
    if (argument.rfind("--write-seeds=", 0) == 0) seeds = argument.substr(14);
  }
  if (g_target == nullptr) {
    std::fputs("expected --target= with one of the names that --list gives\n", stderr);
    std::exit(2);
  }
  if (!seeds.empty()) WriteSeeds(seeds);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const camgyro::FuzzFolder folder(*g_target);
  const std::string flaw = folder.Flaw(folder.Read({reinterpret_cast<const char*>(data), size}));
  if (flaw.empty()) return 0;
  std::fprintf(stderr, "the answer %s\n", flaw.c_str());
  std::abort();
}
