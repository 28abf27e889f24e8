// Paced work is admitted by what it costs, and refused with figures when it is too much.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

// Held, so that nothing flies and every one counts with its trial alone.
std::string dear_request(long operations, const char* start = "held") {
  return json{{"preset", "agrawal-bang-1995/rigid-single-sided"},
              {"simulation", {{"ballast_operations_per_step", operations}, {"duration_s", 60}}},
              {"stop", {{"when", "duration"}}},
              {"timing", {{"mode", "real_time"}, {"start", start}}}}
      .dump();
}

struct Count {
  int admitted = 0;
  std::string sentence;
};

Count admitted(long operations) {
  const ServerUnderTest server;
  const auto session = server.session();
  Count count;
  while (count.admitted < 1000) {
    const auto reply = session->submit(dear_request(operations), wire::Id::make(), std::chrono::seconds(10));
    if (!reply) {
      ADD_FAILURE() << "no reply";
      break;
    }
    if (reply->phase == slew_v1_REJECTED) {
      EXPECT_EQ(reply->code, "busy");
      count.sentence = json::parse(reply->json).at("sentence");
      break;
    }
    ++count.admitted;
  }
  return count;
}

// Medians of three, since the machine's speed is not its own.
int median_admitted(long operations) {
  std::vector<int> counts;
  for (int i = 0; i < 3; ++i) counts.push_back(admitted(operations).admitted);
  std::sort(counts.begin(), counts.end());
  return counts[1];
}

TEST(Admission, HalfAsManyWhenAStepCostsTwiceAsMuch) {
  const int cheap = median_admitted(8000);
  const int dear = median_admitted(16000);
  EXPECT_GT(dear, 10);
  EXPECT_NEAR(static_cast<double>(dear) / cheap, 0.5, 0.15 * 0.5) << cheap << " and " << dear;
}

TEST(Admission, TellsTheFiguresAndExitsWithSeven) {
  const ServerUnderTest server;
  int code = 0;
  std::string words;
  for (int i = 0; i < 50 && code == 0; ++i) {
    const Finished submitted = server.ctl({"submit", "-"}, dear_request(300000));
    code = submitted.exit_code;
    words = submitted.errors;
  }
  EXPECT_EQ(code, 7);
  EXPECT_NE(words.find("of a processor"), std::string::npos) << words;
  // As fast as possible there is always room.
  EXPECT_EQ(server.ctl({"run", "--preset", "agrawal-bang-1995/rigid-single-sided"}).exit_code, 0);
}

TEST(Admission, AHigherRateIsAskedForLikeANewExperiment) {
  const ServerUnderTest server;
  const json submitted = server.document({"submit", "-"}, dear_request(100000, "now"));
  const std::string id = submitted.at("experiment_id");
  const Finished refused = server.ctl({"rate", id, "1000"});
  EXPECT_EQ(refused.exit_code, 7) << refused.errors;
  EXPECT_EQ(server.document({"show", id}).at("phase"), "running");
  EXPECT_EQ(server.ctl({"rate", id, "0.5"}).exit_code, 0);
  EXPECT_EQ(server.ctl({"cancel", id}).exit_code, 0);
}

TEST(Admission, RoomIsGivenBackAtTheEnd) {
  const ServerUnderTest server;
  std::vector<std::string> ids;
  Finished submitted = server.ctl({"submit", "-"}, dear_request(300000));
  while (submitted.exit_code == 0 && ids.size() < 50) {
    ids.push_back(submitted.output.substr(0, submitted.output.find('\n')));
    submitted = server.ctl({"submit", "-"}, dear_request(300000));
  }
  ASSERT_FALSE(ids.empty());
  EXPECT_EQ(submitted.exit_code, 7);
  EXPECT_EQ(server.ctl({"cancel", ids.front()}).exit_code, 0);
  for (int i = 0; i < 100 && server.document({"show", ids.front()}).at("phase") != "cancelled"; ++i) {
  }
  EXPECT_EQ(server.ctl({"submit", "-"}, dear_request(300000)).exit_code, 0);
}

}  // namespace
