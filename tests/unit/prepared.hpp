// A request that is expected to be one.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/experiment/experiment.hpp"

namespace slew::test {

/// Its violations are failures of the test.
inline Prepared prepared(const nlohmann::json& request) {
  auto outcome = prepare(request.dump());
  if (auto* rejection = std::get_if<Rejection>(&outcome)) {
    for (const Violation& violation : rejection->violations) ADD_FAILURE() << to_json(violation);
    return {};
  }
  return std::get<Prepared>(std::move(outcome));
}

}  // namespace slew::test
