#include "server/guidance/planned_motion.hpp"

#include <algorithm>
#include <cmath>

#include "server/guidance/plan_certificate.hpp"

namespace slew {
namespace {

using Eigen::Vector3d;

// So many knots to a maneuver, if nothing in it is steep, and at least so many between two breaks.
constexpr double kKnots = 400;
constexpr int kLeastBetweenBreaks = 8;
// Steps of a method of order 8 are too long for polynomials of degree five.
constexpr int kPartsOfProfileSteps = 4;

std::vector<double> knot_times_s(const ControlHistory& history) {
  std::vector<double> coarse = breaks_of(history);
  if (history.family != ProfileFamily::on_off)
    for (const double t : profile_grid(history.layout, history.parameters))
      coarse.push_back(t * history.time_s);
  std::sort(coarse.begin(), coarse.end());
  std::vector<double> times;
  for (std::size_t k = 0; k + 1 < coarse.size(); ++k) {
    const double length = coarse[k + 1] - coarse[k];
    const int least = history.family == ProfileFamily::on_off ? kLeastBetweenBreaks : kPartsOfProfileSteps;
    const int parts = std::max(least, static_cast<int>(std::ceil(kKnots * length / history.time_s)));
    for (int i = 0; i < parts; ++i) times.push_back(coarse[k] + length * i / parts);
  }
  times.push_back(history.time_s);
  // Breaks and steps that only rounding keeps apart are one.
  const double apart = 1e-9 * history.time_s;
  std::vector<double> kept;
  for (const double t : times)
    if (kept.empty() || t - kept.back() > apart) kept.push_back(t);
  kept.back() = history.time_s;
  return kept;
}

// p' = F w and what its derivative is (Kim & Crassidis 1998, Eq. 2).
MrpReference<double> reference(const Vector3d& p, const Vector3d& w, const Vector3d& acceleration) {
  const Vector3d v = mrp_rate<double>(p, w);
  const Vector3d turning = -2 * p.dot(v) * w + 2 * v.cross(w) + 2 * v.dot(w) * p + 2 * p.dot(w) * v;
  return {p, v, mrp_rate<double>(p, acceleration) + 0.25 * turning};
}

}  // namespace

MrpTable planned_motion(const ManeuverProblem& problem, const ControlHistory& history) {
  const RigidManeuverPlant& plant = problem.plant;
  const Eigen::Matrix3d inverse = plant.inertia_kg_m2.inverse();
  const std::vector<double> times_s = knot_times_s(history);
  const std::vector<RigidState> states = fly_controls(problem, history, times_s);
  const Vector4<double> to_final = euler_parameter_conjugate(problem.final.attitude);
  const auto relative = [&](const RigidState& state) {
    return euler_parameter_product<double>(to_final, state.attitude.normalized());
  };
  const double sign = relative(states.back())[0] < 0 ? -1 : 1;

  MrpTable table;
  const auto reference_at = [&](const RigidState& state, double t_s) {
    Vector3d torque = Vector3d::Zero();
    for (Eigen::Index i = 0; i < plant.controls(); ++i)
      torque += control_of(history, static_cast<std::size_t>(i), plant.least_control[i],
                           plant.most_control[i], t_s) *
                plant.influence_N_m.col(i);
    const Vector4<double> q = sign * relative(state);
    return reference(
        mrp<double>(q), state.rate_rad_s,
        rigid_rate<double>(plant, inverse, state.attitude, state.rate_rad_s, torque).acceleration_rad_s2);
  };
  const std::vector<double> breaks_s = breaks_of(history);
  for (std::size_t k = 0; k < times_s.size(); ++k) {
    const double t_s = times_s[k];
    // On-off controls are those of the segment, on either side.
    const double before_s = k > 0 ? 0.5 * (times_s[k - 1] + t_s) : t_s;
    const double after_s = k + 1 < times_s.size() ? 0.5 * (t_s + times_s[k + 1]) : t_s;
    const bool is_on_off = history.family == ProfileFamily::on_off;
    table.knots.push_back({t_s, reference_at(states[k], is_on_off ? before_s : t_s),
                           reference_at(states[k], is_on_off ? after_s : t_s)});
    const bool jumps = is_on_off && std::any_of(breaks_s.begin(), breaks_s.end(), [&](double at_s) {
                         return std::abs(at_s - t_s) <= 1e-9 * history.time_s;
                       });
    if (jumps || k == 0 || k + 1 == times_s.size()) table.jumps_s.push_back(t_s);
  }
  return table;
}

}  // namespace slew
