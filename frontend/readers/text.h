// Text pieces that all readers share: numbers out of cells, messages out of pieces.
#ifndef CAMGYRO_FRONTEND_READERS_TEXT_H_
#define CAMGYRO_FRONTEND_READERS_TEXT_H_

#include <charconv>
#include <sstream>
#include <string>
#include <string_view>

namespace camgyro {

// The pieces, streamed one after the other.
template <typename... Pieces>
std::string Concat(const Pieces&... pieces) {
  std::ostringstream out;
  (out << ... << pieces);
  return out.str();
}

inline std::string_view Trim(std::string_view text) {
  constexpr char kBlank[] = " \t\r\n";
  const size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

inline bool EndsWith(std::string_view text, std::string_view ending) {
  return text.size() >= ending.size() && text.substr(text.size() - ending.size()) == ending;
}

// True if the whole text is one number of type T. Locale-independent.
template <typename T>
bool ParseNumber(std::string_view text, T* value) {
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, *value);
  return error == std::errc() && rest == end;
}

}  // namespace camgyro

#endif  // CAMGYRO_FRONTEND_READERS_TEXT_H_
