#include "frontend/readers/whole_file.h"

#include <filesystem>
#include <fstream>
#include <system_error>

#include "frontend/readers/text.h"

namespace camgyro {

Status CheckIsFile(const std::string& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status)) return {};
  return BadInput(Concat(file, ": is a folder or a device, expected a file"));
}

Result<std::string> ReadWholeFile(const std::string& file) {
  if (Status is_file = CheckIsFile(file); !is_file) return tl::unexpected(is_file.error());
  std::error_code error;
  std::ifstream in(file, std::ios::binary);
  if (!in) return BadInput(Concat(file, ": cannot be opened for reading"));
  // By read(), which says that it failed; an iterator over the stream throws instead.
  std::string content(std::filesystem::file_size(file, error), '\0');
  if (!error) in.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (error || in.bad()) return BadInput(Concat(file, ": cannot be read"));
  content.resize(static_cast<size_t>(in.gcount()));
  return content;
}

}  // namespace camgyro
