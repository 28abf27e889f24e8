// The fields of a request that may be relied upon, for what judges a request that is not wholly sound.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/experiment/document.hpp"

namespace slew {

/// As a person would write it.
inline std::string number(double value) {
  const bool is_whole = value == std::floor(value) && std::abs(value) < 1e15;
  return is_whole ? std::to_string(static_cast<long long>(value)) : nlohmann::json(value).dump();
}

class SoundFields {
 public:
  SoundFields(const nlohmann::json& request, const std::vector<Violation>& violations)
      : request_(request), violations_(violations) {}

  const nlohmann::json* at(const std::string& pointer) const {
    const bool is_unsound =
        std::any_of(violations_.begin(), violations_.end(), [&](const Violation& violation) {
          return pointer.starts_with(violation.pointer) &&
                 (pointer.size() == violation.pointer.size() || pointer[violation.pointer.size()] == '/');
        });
    const nlohmann::json::json_pointer place(pointer);
    return !is_unsound && request_.contains(place) ? &request_.at(place) : nullptr;
  }
  std::optional<double> number(const std::string& pointer) const {
    const nlohmann::json* value = at(pointer);
    return value && value->is_number() ? std::optional(value->get<double>()) : std::nullopt;
  }
  bool says(const std::string& pointer, const char* text) const {
    const nlohmann::json* value = at(pointer);
    return value && *value == text;
  }
  /// Left out, and not wrong either.
  bool lacks(const std::string& block, const std::string& field) const {
    const nlohmann::json* value = at(block);
    return value && value->is_object() && !value->contains(field);
  }
  bool has(const std::string& pointer) const { return at(pointer) != nullptr; }

 private:
  const nlohmann::json& request_;
  const std::vector<Violation>& violations_;
};

/// Takes what a Violation is made of.
using Violate = std::function<void(std::string, std::string, std::string, std::string)>;

}  // namespace slew
