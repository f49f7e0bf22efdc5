// printf into a string of any length.
#ifndef CAMGYRO_CORE_FORMAT_H_
#define CAMGYRO_CORE_FORMAT_H_

#include <string>

namespace camgyro {

__attribute__((format(printf, 1, 2))) std::string Format(const char* format, ...);

}  // namespace camgyro

#endif  // CAMGYRO_CORE_FORMAT_H_
