// Names of files that a recording gives for its parts.
#ifndef CAMGYRO_FRONTEND_READERS_INSIDE_FOLDER_H_
#define CAMGYRO_FRONTEND_READERS_INSIDE_FOLDER_H_

#include <string>

#include "core/result.h"

namespace camgyro {

// The path of `name` in `folder`. Error: an empty name, an absolute one, or one that leads out of
// the folder by its `..`; `named_by` (a file, perhaps with a line) begins the message. A recording
// of somebody else cannot have other files of the machine read that way. Symbolic links are
// followed: whoever keeps the folder makes them, to have large files on another disk.
Result<std::string> PathInside(const std::string& folder, const std::string& name,
                               const std::string& named_by);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_INSIDE_FOLDER_H_
