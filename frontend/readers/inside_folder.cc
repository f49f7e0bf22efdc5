#include "frontend/readers/inside_folder.h"

#include <filesystem>

#include "frontend/readers/text.h"

namespace camgyro {

Result<std::string> PathInside(const std::string& folder, const std::string& name,
                               const std::string& named_by) {
  const std::filesystem::path path = std::filesystem::path(name).lexically_normal();
  const std::filesystem::path first = path.empty() ? path : *path.begin();
  if (path.is_absolute() || first.empty() || first == ".." || first == ".") {
    return BadInput(Concat(named_by, ": names the file '", name,
                           "', expected one inside of the recording's folder"));
  }
  return (std::filesystem::path(folder) / path).string();
}

}  // namespace camgyro
