// What is fuzzed: every file that is read, inside of a recording that is sound but for it. One row
// per file; libFuzzer's program (fuzz.cc) and the replay among the tests walk the table.
#ifndef CAMGYRO_TESTS_FUZZ_TARGETS_H_
#define CAMGYRO_TESTS_FUZZ_TARGETS_H_

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "tests/frontend/readers/sound_logs.h"

namespace camgyro {

struct FuzzTarget {
  const char* name;
  const char* file;   // that the input becomes, relative to a folder
  const char* entry;  // that is read, relative to it; empty: the folder itself
  Files (*sound)();   // all files of the folder; `file` is the first seed
  Status (*read)(const std::string& path);
  // More seeds, where one does not reach all of the reader; null without.
  std::vector<std::string> (*more_seeds)() = nullptr;
};

// Without those of formats that this build cannot read.
const std::vector<FuzzTarget>& FuzzTargets();

std::vector<std::string> Seeds(const FuzzTarget& target);

// The folder of one target, with its sound files; removed at the end.
class FuzzFolder {
 public:
  explicit FuzzFolder(const FuzzTarget& target);
  ~FuzzFolder();
  FuzzFolder(const FuzzFolder&) = delete;
  FuzzFolder& operator=(const FuzzFolder&) = delete;

  // Reads the folder with `bytes` as the target's file.
  Status Read(const std::string& bytes) const;

  // What is wrong with a refusal; empty if nothing is. A refusal is a kBadInput that names a file
  // of the folder.
  std::string Flaw(const Status& answer) const;

 private:
  const FuzzTarget& target_;
  std::filesystem::path path_;
};

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_FUZZ_TARGETS_H_
