// The content of a file at once, and what is a file.
#ifndef CAMGYRO_FRONTEND_READERS_WHOLE_FILE_H_
#define CAMGYRO_FRONTEND_READERS_WHOLE_FILE_H_

#include <string>

#include "core/result.h"

namespace camgyro {

// An error if there is something else than a regular file, or a link to one, under this name: a
// pipe would be waited for without end.
Status CheckIsFile(const std::string& file);

// Errors: kBadInput that names the file: CheckIsFile, or it cannot be opened or read.
Result<std::string> ReadWholeFile(const std::string& file);

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_WHOLE_FILE_H_
