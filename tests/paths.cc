#include "tests/paths.h"

namespace camgyro {

std::string SourceDir() { return CAMGYRO_SOURCE_DIR; }
std::string BinaryDir() { return CAMGYRO_BINARY_DIR; }

}  // namespace camgyro
