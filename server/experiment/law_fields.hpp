// The laws of attitude by the names of their fields: each says its own (server/control/attitude_sight.hpp),
// and what is here reads and writes any of them.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "server/control/attitude_law.hpp"

namespace slew {

/// Three numbers, or one for all three.
Eigen::Vector3d vector_of(const nlohmann::json& numbers);
/// Rows, or the diagonal.
Eigen::Matrix3d matrix_of(const nlohmann::json& rows);
nlohmann::json rows_of(const Eigen::Matrix3d& matrix);

/// Calls with a default-constructed law of every type, in the order of the variant.
template <typename Visit, std::size_t... I>
void for_each_law(Visit&& visit, std::index_sequence<I...>) {
  (visit(std::variant_alternative_t<I, AttitudeLaw>{}), ...);
}
template <typename Visit>
void for_each_law(Visit&& visit) {
  for_each_law(visit, std::make_index_sequence<std::variant_size_v<AttitudeLaw>>{});
}

/// The law of this type with its defaults; empty when there is none.
inline std::optional<AttitudeLaw> attitude_law_of(std::string_view type) {
  std::optional<AttitudeLaw> found;
  for_each_law([&](auto law) {
    if (type == decltype(law)::kType) found = std::move(law);
  });
  return found;
}

/// Into a law's fields, from its block in a request. What is left out stays as the law has it.
class LawReader {
 public:
  LawReader(const nlohmann::json& controller, const Eigen::Matrix3d& plant_inertia_kg_m2)
      : controller_(controller), plant_inertia_kg_m2_(plant_inertia_kg_m2) {}

  template <typename Value>
  void operator()(const char* name, Value& value) {
    if (const auto place = controller_.find(name); place != controller_.end()) read(*place, value);
  }
  void inertia(const char* name, Eigen::Matrix3d& value) {
    const auto place = controller_.find(name);
    value = place == controller_.end() ? plant_inertia_kg_m2_ : matrix_of(*place);
    belief_ = value;
  }
  /// The inertia that the law believes in, where it needs one.
  const std::optional<Eigen::Matrix3d>& belief_kg_m2() const { return belief_; }

 private:
  static void read(const nlohmann::json& place, double& value) { value = place.get<double>(); }
  static void read(const nlohmann::json& place, Eigen::Vector3d& value) { value = vector_of(place); }
  static void read(const nlohmann::json& place, Eigen::Matrix3d& value) { value = matrix_of(place); }
  static void read(const nlohmann::json& place, std::vector<double>& value) {
    value = place.get<std::vector<double>>();
  }

  const nlohmann::json& controller_;
  const Eigen::Matrix3d& plant_inertia_kg_m2_;
  std::optional<Eigen::Matrix3d> belief_;
};

/// From a law's fields.
class LawWriter {
 public:
  template <typename Value>
  void operator()(const char* name, const Value& value) {
    if constexpr (std::is_same_v<Value, Eigen::Matrix3d>)
      document_[name] = rows_of(value);
    else if constexpr (std::is_same_v<Value, Eigen::Vector3d>)
      document_[name] = std::vector<double>(value.begin(), value.end());
    else
      document_[name] = value;
  }
  void inertia(const char* name, const Eigen::Matrix3d& value) { (*this)(name, value); }
  const nlohmann::json& document() const { return document_; }

 private:
  nlohmann::json document_ = nlohmann::json::object();
};

/// The names of the fields of a law that are beliefs of the inertia.
class InertiaNames {
 public:
  template <typename Value>
  void operator()(const char*, const Value&) {}
  void inertia(const char* name, const Eigen::Matrix3d&) { names_.emplace_back(name); }
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
};

}  // namespace slew
