// Pictures of runs in three axes: parameters, rates, torques, and a row for each thruster.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "client/slewctl/picture.hpp"
#include "server/experiment/experiment.hpp"
#include "tests/unit/prepared.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

class Recorder final : public SampleSink {
 public:
  explicit Recorder(const ChannelTable& channels) : channels_(channels) {}
  void sample(double t_s, std::span<const double> state, std::span<const double> thrusters) override {
    series_["t_s"].push_back(t_s);
    for (std::size_t i = 0; i < state.size(); ++i)
      series_["columns"][channels_.state[i].name].push_back(state[i]);
    for (std::size_t i = 0; i < thrusters.size(); ++i)
      series_["columns"][channels_.thrusters[i].name].push_back(thrusters[i]);
  }
  void event(const SwitchEvent&) override {}
  const json& series() const { return series_; }

 private:
  const ChannelTable channels_;
  json series_;
};

std::string drawn(const json& request) {
  const Prepared made = test::prepared(request);
  const auto run = make_run(made);
  Recorder recorder(run->channels());
  while (run->advance(std::numeric_limits<double>::infinity(), 1 << 20, recorder) == RunStatus::running) {
  }
  const json result = result_document({"", "", "completed", std::nullopt, {}}, made, run.get(), std::nullopt);
  const auto file =
      std::filesystem::temp_directory_path() / ("slew-run-" + std::to_string(::getpid()) + ".svg");
  draw_run(result, recorder.series(), "a title", file);
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  std::filesystem::remove(file);
  return text.str();
}

TEST(RunPicture, ABarForEveryFiring) {
  const std::string svg = drawn({{"preset", "kim-crassidis-1998/case-c-disturbance-accommodating"}});
  for (const char* text : {"p, MRP", "rate, deg/s", "s, deg/s", "torque, N m", "thrusters", "a title", ">x<"})
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  // Valves that take their time tell of themselves; so does each of many.
  const json brief = {{"preset", "benchmark/twelve-thrusters"}, {"simulation", {{"duration_s", 10}}}};
  EXPECT_NE(drawn(brief).find(">12<"), std::string::npos);
  // More events than a result tells: as the samples have it.
  const json many = {{"preset", "benchmark/twelve-thrusters"}, {"simulation", {{"duration_s", 60}}}};
  EXPECT_NE(drawn(many).find("thrusters"), std::string::npos);
}

TEST(RunPicture, WheelsHaveNoThrusters) {
  const std::string svg = drawn({{"preset", "kim-crassidis-1998/figure-4-sliding-mode"}});
  EXPECT_NE(svg.find("torque, N m"), std::string::npos);
  EXPECT_EQ(svg.find("thrusters"), std::string::npos);
}

}  // namespace
}  // namespace slew::ctl
