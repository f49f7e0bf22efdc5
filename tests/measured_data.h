// Where measured recordings are. They are not part of the repository.
#ifndef CAMGYRO_TESTS_MEASURED_DATA_H_
#define CAMGYRO_TESTS_MEASURED_DATA_H_

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace camgyro {

// Path of a recording in $CAMGYRO_DATA, or in ../shared/data beside the source tree.
inline std::optional<std::string> MeasuredData(const std::string& name) {
  const char* folder = std::getenv("CAMGYRO_DATA");
  const std::filesystem::path path =
      (folder ? std::filesystem::path(folder)
              : std::filesystem::path(CAMGYRO_SOURCE_DIR) / ".." / "shared" / "data") /
      name;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nullopt;
  return path.string();
}

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_MEASURED_DATA_H_
