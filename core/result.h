// What can go wrong outside of our own code, as values. Each kind is an exit code of `camgyro`.
#ifndef CAMGYRO_CORE_RESULT_H_
#define CAMGYRO_CORE_RESULT_H_

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace camgyro {

enum class ErrorKind {
  kBadUsage = 2,        // unknown command or flag, value outside its range
  kBadInput = 3,        // a file is missing, malformed, inconsistent
  kCannotEstimate = 4,  // the data are sound, but do not determine what was asked
};

struct Error {
  ErrorKind kind = ErrorKind::kBadInput;
  std::string message;  // names file and line where there are any, and what was expected
};

template <typename T>
using Result = tl::expected<T, Error>;
using Status = tl::expected<void, Error>;

inline tl::unexpected<Error> BadUsage(std::string message) {
  return tl::unexpected<Error>({ErrorKind::kBadUsage, std::move(message)});
}
inline tl::unexpected<Error> BadInput(std::string message) {
  return tl::unexpected<Error>({ErrorKind::kBadInput, std::move(message)});
}
inline tl::unexpected<Error> CannotEstimate(std::string message) {
  return tl::unexpected<Error>({ErrorKind::kCannotEstimate, std::move(message)});
}

}  // namespace camgyro

#endif  // CAMGYRO_CORE_RESULT_H_
