#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/experiment/planning.hpp"
#include "server/guidance/maneuver_bounds.hpp"
#include "server/guidance/plan_certificate.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr int kPoints = 1000, kPointsWithVibration = 3000;

// Both sides of every switch, as near as a picture needs.
std::vector<double> times_of(const ControlHistory& history, int points) {
  std::vector<double> times;
  for (int i = 0; i <= points; ++i) times.push_back(history.time_s * i / points);
  const double aside = 1e-9 * history.time_s;
  for (const double at : breaks_of(history))
    for (const double t : {at - aside, at})
      if (t > 0 && t < history.time_s) times.push_back(t);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

}  // namespace

json plan_curves(const PlanningTask& task, const json& plan) {
  const ManeuverProblem& problem = task.problem;
  const ControlHistory history = controls_of(plan);
  const bool has_vibration = !task.vibration.empty();
  const std::vector<double> times_s = times_of(history, has_vibration ? kPointsWithVibration : kPoints);
  const std::vector<RigidState> states = fly_controls(problem, history, times_s);
  json curves = {{"t_s", times_s}};
  for (std::size_t k = 0; k < times_s.size(); ++k) {
    json controls = json::array();
    for (Eigen::Index i = 0; i < problem.plant.controls(); ++i)
      controls.push_back(control_of(history, static_cast<std::size_t>(i), problem.plant.least_control[i],
                                    problem.plant.most_control[i], times_s[k]));
    curves["controls"].push_back(std::move(controls));
    const Eigen::Vector3d rate = states[k].rate_rad_s * kDegPerRad;
    curves["rate_deg_s"].push_back({rate[0], rate[1], rate[2]});
    const Vector4<double> q = states[k].attitude.normalized();
    const Eigen::Vector3d angles = euler_angles_123<double>(q) * kDegPerRad;
    const double left = eigenaxis(q, problem.final.attitude).angle_rad * kDegPerRad;
    curves["attitude_deg"].push_back({angles[0], angles[1], angles[2], left});
  }
  if (!has_vibration) return curves;
  const auto modes = surrogate_histories(problem, history, task.vibration, times_s);
  for (const std::vector<double>& row : modes) {
    json degrees = json::array();
    for (const double eta : row) degrees.push_back(eta * kDegPerRad);
    curves["vibration_deg"].push_back(std::move(degrees));
  }
  return curves;
}

}  // namespace slew
