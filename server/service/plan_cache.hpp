// Plans that were found, by the digest of their problem: the same problem is planned once, also after a
// restart. A file each, beside the journal; what is lost or damaged is planned again.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace slew::service {

/// One thread at a time.
class PlanCache {
 public:
  explicit PlanCache(std::filesystem::path directory);

  std::optional<nlohmann::json> find(const std::string& problem_text) const;
  /// Failures are logged: a plan can be found again.
  void keep(const std::string& problem_text, const nlohmann::json& plan);

 private:
  std::filesystem::path file_of(const std::string& problem_text) const;

  const std::filesystem::path directory_;
  std::size_t count_ = 0;
};

}  // namespace slew::service
