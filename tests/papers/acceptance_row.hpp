// One row of tests/papers/acceptance.json against the document that its command gives: the number at
// `pointer`, or the largest of a column of the rows there, is `expected` to `tolerance`, or `at_least` so
// much, or `at_most`.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

namespace slew::test {

inline double number_of(const nlohmann::json& row, const nlohmann::json& place) {
  if (!row.contains("largest_in_column")) return place.get<double>();
  double largest = 0;
  for (const nlohmann::json& line : place)
    largest =
        std::max(largest, std::abs(line.at(row.at("largest_in_column").get<std::size_t>()).get<double>()));
  return largest;
}

inline void expect_row(const nlohmann::json& row, const nlohmann::json& document) {
  const nlohmann::json::json_pointer pointer(row.at("pointer").get<std::string>());
  ASSERT_TRUE(document.contains(pointer)) << document.value("refused", "");
  const nlohmann::json& place = document.at(pointer);
  ASSERT_TRUE(row.contains("largest_in_column") ? place.is_array() : place.is_number());
  const double value = number_of(row, place);
  if (row.contains("expected")) {
    EXPECT_NEAR(value, row.at("expected").get<double>(), row.at("tolerance").get<double>());
  }
  constexpr double kAny = std::numeric_limits<double>::infinity();
  EXPECT_GE(value, row.value("at_least", -kAny));
  EXPECT_LE(value, row.value("at_most", kAny));
}

}  // namespace slew::test
