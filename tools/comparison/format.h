// printf into a string, for tables and pictures.
#ifndef CAMGYRO_TOOLS_COMPARISON_FORMAT_H_
#define CAMGYRO_TOOLS_COMPARISON_FORMAT_H_

#include <cstdarg>
#include <cstdio>
#include <string>

namespace camgyro::comparison {

// At most 500 characters.
__attribute__((format(printf, 1, 2))) inline std::string Format(const char* format, ...) {
  char text[500];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

}  // namespace camgyro::comparison

#endif  // CAMGYRO_TOOLS_COMPARISON_FORMAT_H_
