#include "tools/batch/manifest.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "frontend/readers/csv_reader.h"
#include "tools/folder_names.h"

namespace camgyro::batch {
namespace {

namespace fs = std::filesystem;

bool IsFolderName(const std::string& name) {
  return !name.empty() && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
         });
}

}  // namespace

Result<std::vector<BatchRecording>> ReadManifest(const std::string& file) {
  CsvReader csv = CsvReader::ByName(file);
  const size_t device = csv.Column({"device"}), recording = csv.Column({"recording"});
  std::vector<BatchRecording> recordings;
  std::map<std::string, std::vector<std::string>> paths_of;
  std::set<std::string> seen;
  while (csv.NextRow()) {
    BatchRecording row{std::string(csv.Cell(device)), std::string(csv.Cell(recording)), ""};
    if (!IsFolderName(row.device)) {
      csv.Fail("device '" + row.device +
               "': expected letters, digits, '-', '_' and '.', as of a folder");
    } else if (row.path.empty()) {
      csv.Fail("recording: the cell is empty, expected a path");
    }
    row.path = (fs::path(file).parent_path() / row.path).lexically_normal().string();
    if (!seen.insert(row.path).second) csv.Fail("recording " + row.path + " is there twice");
    paths_of[row.device].push_back(row.path);
    recordings.push_back(std::move(row));
  }
  if (!csv.status()) return tl::unexpected(csv.status().error());
  if (recordings.empty()) {
    return BadInput(file + ": has no rows, expected a recording in each: device,recording");
  }
  for (const auto& [name, paths] : paths_of) {
    const std::vector<std::string> folders = FolderNames(paths);
    size_t next = 0;
    for (BatchRecording& row : recordings) {
      if (row.device == name) row.folder = (fs::path(name) / folders[next++]).string();
    }
  }
  return recordings;
}

std::vector<std::string> DevicesOf(const std::vector<BatchRecording>& recordings) {
  std::vector<std::string> devices;
  for (const BatchRecording& row : recordings) {
    if (std::find(devices.begin(), devices.end(), row.device) == devices.end()) {
      devices.push_back(row.device);
    }
  }
  return devices;
}

}  // namespace camgyro::batch
