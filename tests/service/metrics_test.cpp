// The metrics page: what Prometheus reads is what the server counts.
#include <gtest/gtest.h>

#include <regex>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew::test;

double value_of(const std::string& page, const std::string& name) {
  std::smatch found;
  const std::regex line("(^|\n)" + name + " ([^\n]+)");
  return std::regex_search(page, found, line) ? std::stod(found[2]) : -1;
}

TEST(Metrics, TellWhatTheServerCounts) {
  const DomainLease other;  // a number nobody else uses now
  const std::string port = std::to_string(18000 + other.domain());
  const ServerUnderTest server({"--metrics-port", port});
  const std::string preset = "agrawal-bang-1995/rigid-single-sided";
  ASSERT_EQ(server.ctl({"run", "--preset", preset}).exit_code, 0);
  ASSERT_EQ(server.ctl({"run", "--preset", preset, "--set", "timing.mode=real_time"}).exit_code, 0);
  ASSERT_EQ(server.ctl({"run", "--preset", "no/such"}).exit_code, 2);
  const Finished got =
      run({"/usr/bin/curl", "-sS", "--noproxy", "*", "http://127.0.0.1:" + port + "/metrics"});
  ASSERT_EQ(got.exit_code, 0) << got.errors;
  const std::string& page = got.output;
  EXPECT_EQ(value_of(page, "slewd_requests_accepted_total"), 2) << page;
  EXPECT_EQ(value_of(page, "slewd_requests_rejected_total"), 1);
  EXPECT_EQ(value_of(page, R"(slewd_experiments_ended_total\{phase="completed"\})"), 2);
  EXPECT_GT(value_of(page, "slewd_telemetry_published_total"), 100);
  EXPECT_GT(value_of(page, "slewd_slice_lateness_seconds_count"), 100);
  EXPECT_EQ(value_of(page, "slewd_slice_lateness_seconds_count"),
            value_of(page, R"(slewd_slice_lateness_seconds_bucket\{le="\+Inf"\})"));
  EXPECT_EQ(value_of(page, "slewd_paced"), 0);
  EXPECT_NE(page.find("# HELP slewd_paced_load "), std::string::npos);
}

TEST(Metrics, APortThatIsTakenIsToldAtTheStart) {
  const DomainLease other;
  const std::string port = std::to_string(18200 + other.domain());
  const ServerUnderTest first({"--metrics-port", port});
  const DomainLease domain;
  const TemporaryDirectory state;
  const Finished second = run({SLEWD, "--domain", std::to_string(domain.domain()), "--state-dir",
                               state.path().string(), "--metrics-port", port});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.errors.find(port), std::string::npos) << second.errors;
}

}  // namespace
