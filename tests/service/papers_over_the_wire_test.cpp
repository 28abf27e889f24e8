// The table of tests/papers once more, as users see it: slewctl, DDS, slewd, and back.
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "tests/papers/acceptance_row.hpp"
#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew::test;
using nlohmann::json;

TEST(PapersOverTheWire, EveryRowHolds) {
  const ServerUnderTest server;
  std::ifstream file(SLEW_SOURCE_DIR "/tests/papers/acceptance.json");
  const json rows = json::parse(file);
  std::map<std::string, json> documents;
  for (const json& row : rows) {
    SCOPED_TRACE(row.dump());
    json& document = documents[row.at("command").dump()];
    if (document.is_null()) document = server.document(row.at("command").get<std::vector<std::string>>());
    ASSERT_TRUE(document.is_object());
    expect_row(row, document);
  }
}

}  // namespace
