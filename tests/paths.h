// Where the source and the build lie. Compiled once for all tests: with these paths in every test's
// command line, ccache could share none of them between two clones.
#ifndef CAMGYRO_TESTS_PATHS_H_
#define CAMGYRO_TESTS_PATHS_H_

#include <string>

namespace camgyro {

std::string SourceDir();
std::string BinaryDir();

}  // namespace camgyro

#endif  // CAMGYRO_TESTS_PATHS_H_
