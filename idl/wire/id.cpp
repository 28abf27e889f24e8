#include "idl/wire/id.hpp"

#include <sys/random.h>

#include <chrono>
#include <stdexcept>

namespace slew::wire {

Id Id::make() {
  Id id;
  if (getrandom(id.octets.data(), id.octets.size(), 0) != static_cast<ssize_t>(id.octets.size()))
    throw std::runtime_error("the system gave no random bits for an identifier");
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto ms =
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(now).count());
  for (std::size_t i = 0; i < 6; ++i) id.octets[i] = static_cast<std::uint8_t>(ms >> (8 * (5 - i)));
  id.octets[6] = static_cast<std::uint8_t>(0x70 | (id.octets[6] & 0x0F));
  id.octets[8] = static_cast<std::uint8_t>(0x80 | (id.octets[8] & 0x3F));
  return id;
}

std::optional<Id> Id::parse(std::string_view text) {
  Id id;
  std::size_t digits = 0;
  for (const char c : text) {
    if (c == '-') continue;
    int value = 0;
    if (c >= '0' && c <= '9')
      value = c - '0';
    else if (c >= 'a' && c <= 'f')
      value = c - 'a' + 10;
    else if (c >= 'A' && c <= 'F')
      value = c - 'A' + 10;
    else
      return std::nullopt;
    if (digits == 32) return std::nullopt;
    auto& octet = id.octets[digits / 2];
    octet = static_cast<std::uint8_t>((octet << 4) | value);
    ++digits;
  }
  if (digits != 32) return std::nullopt;
  return id;
}

std::string Id::hex() const {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  text.reserve(32);
  for (const auto octet : octets) {
    text.push_back(kDigits[octet >> 4]);
    text.push_back(kDigits[octet & 0x0F]);
  }
  return text;
}

}  // namespace slew::wire
