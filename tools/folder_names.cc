#include "tools/folder_names.h"

#include <algorithm>
#include <filesystem>

namespace camgyro {

std::vector<std::string> FolderNames(const std::vector<std::string>& paths) {
  std::vector<std::string> names;
  for (const std::string& path : paths) {
    std::filesystem::path last = std::filesystem::path(path).lexically_normal();
    if (!last.has_filename()) last = last.parent_path();
    std::string name = last.stem().string();
    if (name.empty() || name == "." || name == "..") name = "recording";
    const std::string plain = name;
    for (int n = 2; std::find(names.begin(), names.end(), name) != names.end(); ++n) {
      name = plain + "_" + std::to_string(n);
    }
    names.push_back(name);
  }
  return names;
}

}  // namespace camgyro
