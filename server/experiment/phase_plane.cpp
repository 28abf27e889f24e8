#include "server/experiment/phase_plane.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "server/simulation/axis_channels.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr int kPathPoints = 4000;
constexpr std::int64_t kMostSteps = 2'000'000;
constexpr int kEdgePoints = 200;

// Keeps [error_deg, rate_deg_s, u] of every sample.
class Path final : public SampleSink {
 public:
  void sample(double, std::span<const double> state, std::span<const double> thrusters) override {
    most_rate_ = std::max(most_rate_, std::abs(state[1]));
    points_.push_back({state[2] * kDegPerRad, state[1] * kDegPerRad, thrusters[1] - thrusters[2]});
  }
  void event(const SwitchEvent&) override {}
  json& points() { return points_; }
  double most_rate_rad_s() const { return most_rate_; }

 private:
  json points_ = json::array();
  double most_rate_ = 0;
};

}  // namespace

json phase_plane(const OnOffAxisSpecification& specification) {
  auto spec = specification;
  spec.telemetry_period_s = spec.duration_s / kPathPoints;
  Path path;
  const auto run = make_on_off_axis_run(spec);
  const bool is_whole =
      run->advance(std::numeric_limits<double>::infinity(), kMostSteps, path) != RunStatus::running;

  const SwitchingFunction law(spec.law, spec.maneuver.final_angle_rad, slew_direction(spec.maneuver));
  json edges = json::array();
  if (spec.evaluation != Evaluation::program) {
    const double most = 1.15 * path.most_rate_rad_s();
    for (const double level_rad : std::set<double>{law.enter_above_rad(), law.leave_above_rad(),
                                                   law.enter_below_rad(), law.leave_below_rad()}) {
      json edge = json::array();
      for (int i = 0; i <= kEdgePoints; ++i) {
        const double rate = most * (1 - 2.0 * i / kEdgePoints);
        // s = level, solved for the error.
        const double error = level_rad - law.value(law.final_angle_rad(), rate);
        edge.push_back({error * kDegPerRad, rate * kDegPerRad});
      }
      edges.push_back({{"level_deg", level_rad * kDegPerRad}, {"curve", std::move(edge)}});
    }
  }
  json box;
  if (law.end_box())
    box = {{"angle_deg", law.end_box()->angle_rad * kDegPerRad},
           {"rate_deg_s", law.end_box()->rate_rad_s * kDegPerRad}};
  return {{"type", "phase_plane"},
          {"edges", std::move(edges)},
          {"end_box", std::move(box)},
          {"path", std::move(path.points())},
          {"path_is_whole", is_whole}};
}

}  // namespace slew
