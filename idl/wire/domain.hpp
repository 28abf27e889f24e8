// A process's place in a DDS domain: its own configuration, one participant, errors in words.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "idl/wire/entity.hpp"
#include "idl/wire/identity.hpp"

namespace slew::wire {

/// Ids above this collide with the ephemeral ports of Linux.
inline constexpr std::uint32_t kLargestDomain = 99;

/// What went wrong between us and DDS, as a sentence; `what()` includes DDS's own log lines.
class WireError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The configuration used unless another is given: loopback only, unicast discovery, lease 5 s.
/// The same text as deploy/dds/loopback.xml.
const std::string& loopback_profile();

struct DomainOptions {
  std::uint32_t domain = 0;  ///< 1 to kLargestDomain
  std::string profile;       ///< Cyclone DDS configuration as XML; empty: loopback_profile()
  std::string identity{};    ///< directory of an Identity; empty: without DDS Security
};

/// Creates the domain with the profile and one participant in it. Only one per process and domain id.
/// Throws WireError.
class Domain {
 public:
  explicit Domain(const DomainOptions& options);

  dds_entity_t participant() const { return participant_.get(); }
  std::uint32_t id() const { return id_; }
  /// Null without DDS Security.
  const Identity* identity() const { return identity_ ? &*identity_ : nullptr; }
  /// Whether a wall clock that is set back holds up DDS; so it does under sanitizers only.
  static bool minds_the_wall_clock();

 private:
  std::uint32_t id_;
  std::optional<Identity> identity_;
  Entity domain_;  // deleted after everything in it
  Entity participant_;
};

}  // namespace slew::wire
