// Who a process is on the wire: a directory with its certificate, its key and its signed permissions, as
// deploy/security/make-identities lays it out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace slew::wire {

class Identity {
 public:
  /// Checks that everything is there and that the dates of the certificates hold now. Throws WireError.
  explicit Identity(const std::filesystem::path& directory);

  /// When the first of the certificates runs out, seconds since 1970.
  std::int64_t expires_unix_s() const { return expires_unix_s_; }
  /// The profile with this identity in every domain of it.
  std::string joined_to(const std::string& profile) const;

 private:
  std::filesystem::path directory_;
  std::int64_t expires_unix_s_;
};

}  // namespace slew::wire
