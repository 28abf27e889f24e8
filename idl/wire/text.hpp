// Text into the bounded strings of the wire, and back.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

namespace slew::wire {

/// Copies at most N-1 bytes and ends with a zero; a longer text is cut at a UTF-8 character's border.
template <std::size_t N>
void store(std::string_view text, char (&target)[N]) {
  std::size_t length = std::min(text.size(), N - 1);
  if (length < text.size())
    while (length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0) == 0x80) --length;
  std::memcpy(target, text.data(), length);
  target[length] = '\0';
}

template <std::size_t N>
std::string_view view(const char (&source)[N]) {
  return {source, strnlen(source, N)};
}

inline std::string_view view(const char* source) {
  return source ? std::string_view(source) : "";
}

/// The C types want a mutable pointer in samples that are only read.
inline char* borrowed(const std::string& text) {
  return const_cast<char*>(text.c_str());
}

}  // namespace slew::wire
