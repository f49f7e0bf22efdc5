// Folders for the results of several recordings, named after them.
#ifndef CAMGYRO_TOOLS_FOLDER_NAMES_H_
#define CAMGYRO_TOOLS_FOLDER_NAMES_H_

#include <string>
#include <vector>

namespace camgyro {

// The last part of each path without its extension, with a number where two would be the same.
std::vector<std::string> FolderNames(const std::vector<std::string>& paths);

}  // namespace camgyro

#endif  // CAMGYRO_TOOLS_FOLDER_NAMES_H_
