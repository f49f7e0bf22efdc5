// Where the measured recordings lie, which are no part of the repository.
#ifndef CAMGYRO_TESTS_MEASURED_DATA_H_
#define CAMGYRO_TESTS_MEASURED_DATA_H_

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "tests/paths.h"

namespace camgyro {

// The path of a recording under $CAMGYRO_DATA (default: ../shared/data beside the source), or
// nothing if it is not there: the test then says GTEST_SKIP().
inline std::optional<std::string> MeasuredData(const std::string& name) {
  const char* root = std::getenv("CAMGYRO_DATA");
  const std::filesystem::path path =
      std::filesystem::path(root ? root : SourceDir() + "/../shared/data") / name;
  if (!std::filesystem::exists(path)) return std::nullopt;
  return path.string();
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_MEASURED_DATA_H_
