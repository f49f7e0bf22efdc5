// What a name that nobody knows was probably meant to be.
#ifndef CAMGYRO_CORE_NEAREST_NAME_H_
#define CAMGYRO_CORE_NEAREST_NAME_H_

#include <cstddef>
#include <string>
#include <vector>

namespace camgyro {

// Levenshtein's: letters to insert, remove or replace.
size_t EditDistance(const std::string& a, const std::string& b);

// The known name within a third of the letters of `name`, or nothing.
std::string NearestName(const std::string& name, const std::vector<std::string>& known);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_NEAREST_NAME_H_
