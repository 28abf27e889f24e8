// Identifiers of requests, experiments and servers: 16 octets, written as 32 hexadecimal digits.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

namespace slew::wire {

struct Id {
  std::array<std::uint8_t, 16> octets{};

  /// Time-ordered (UUID version 7): milliseconds since 1970, then random bits from the system.
  static Id make();
  /// From 32 hexadecimal digits of either case, hyphens ignored; empty when it is anything else.
  static std::optional<Id> parse(std::string_view text);
  static Id from(const std::uint8_t (&octets)[16]) {
    Id id;
    std::memcpy(id.octets.data(), octets, sizeof octets);
    return id;
  }

  void store(std::uint8_t (&target)[16]) const { std::memcpy(target, octets.data(), sizeof target); }
  std::string hex() const;
  bool is_zero() const { return octets == std::array<std::uint8_t, 16>{}; }
  auto operator<=>(const Id&) const = default;
};

/// For hash tables: the last eight octets are random already.
struct IdHash {
  std::size_t operator()(const Id& id) const {
    std::size_t word;
    std::memcpy(&word, id.octets.data() + 8, sizeof word);
    return word;
  }
};

}  // namespace slew::wire
