#include "server/guidance/modal_surrogate.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "server/guidance/plan_certificate.hpp"

namespace slew {
namespace {

constexpr double kPointsOfAPeriod = 24;
constexpr int kMostPoints = 20000;

// Between two points a and b of the drive f, h apart: z = eta' - conj(s) eta moves by z' = s z + f, s =
// W(-zeta
// + i sqrt(1 - zeta^2)), and eta = Im z / Im s.
std::complex<double> moved(std::complex<double> z, std::complex<double> s, double a, double b, double h) {
  const std::complex<double> grown = std::exp(s * h);
  const double slope = (b - a) / h;
  return grown * z + (grown - 1.0) / s * a + (grown - 1.0 - s * h) / (s * s) * slope;
}

std::complex<double> pole_of(const SurrogateMode& mode) {
  const double zeta = mode.damping_ratio;
  return mode.frequency_rad_s * std::complex<double>(-zeta, std::sqrt(1 - zeta * zeta));
}

// So fine that the drive is nearly linear between two of them; breaks are among them.
std::vector<double> fine_times_s(const ControlHistory& history, const std::vector<SurrogateMode>& modes) {
  double fastest_rad_s = 0;
  for (const SurrogateMode& mode : modes) fastest_rad_s = std::max(fastest_rad_s, mode.frequency_rad_s);
  const double points = kPointsOfAPeriod * history.time_s * fastest_rad_s / (2 * std::numbers::pi);
  const double finest_s = history.time_s / std::clamp(points, 200.0, static_cast<double>(kMostPoints));
  std::vector<double> times_s;
  const std::vector<double> breaks_s = breaks_of(history);
  for (std::size_t k = 0; k + 1 < breaks_s.size(); ++k) {
    const double length = breaks_s[k + 1] - breaks_s[k];
    const int parts = std::max(1, static_cast<int>(std::ceil(length / finest_s)));
    for (int i = 0; i < parts; ++i) times_s.push_back(breaks_s[k] + length * i / parts);
  }
  times_s.push_back(history.time_s);
  return times_s;
}

// `seen(t, z)` at every one of the times.
template <typename Seen>
void follow(const ManeuverProblem& problem, const ControlHistory& history,
            const std::vector<SurrogateMode>& modes, const std::vector<double>& times_s, const Seen& seen) {
  const std::vector<RigidState> states = fly_controls(problem, history, times_s);
  const RigidManeuverPlant& plant = problem.plant;
  const Eigen::Matrix3d inverse = plant.inertia_kg_m2.inverse();
  const auto acceleration = [&](const RigidState& state, double control_s) {
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < plant.controls(); ++i)
      torque += control_of(history, static_cast<std::size_t>(i), plant.least_control[i],
                           plant.most_control[i], control_s) *
                plant.influence_N_m.col(i);
    return rigid_rate<double>(plant, inverse, state.attitude, state.rate_rad_s, torque).acceleration_rad_s2;
  };
  const bool is_on_off = history.family == ProfileFamily::on_off;
  std::vector<std::complex<double>> z(modes.size(), 0);
  seen(times_s.front(), z);
  for (std::size_t k = 0; k + 1 < times_s.size(); ++k) {
    const double h = times_s[k + 1] - times_s[k], middle_s = times_s[k] + 0.5 * h;
    // On-off controls are those of the segment at both its ends.
    const Eigen::Vector3d begin = acceleration(states[k], is_on_off ? middle_s : times_s[k]);
    const Eigen::Vector3d end = acceleration(states[k + 1], is_on_off ? middle_s : times_s[k + 1]);
    for (std::size_t m = 0; m < modes.size(); ++m)
      z[m] = moved(z[m], pole_of(modes[m]), -modes[m].axis.dot(begin), -modes[m].axis.dot(end), h);
    seen(times_s[k + 1], z);
  }
}

}  // namespace

std::vector<SurrogateResponse> surrogate_responses(const ManeuverProblem& problem,
                                                   const ControlHistory& history,
                                                   const std::vector<SurrogateMode>& modes) {
  std::vector<SurrogateResponse> responses(modes.size());
  if (modes.empty() || !(history.time_s > 0)) return responses;
  follow(problem, history, modes, fine_times_s(history, modes),
         [&](double, const std::vector<std::complex<double>>& z) {
           for (std::size_t m = 0; m < modes.size(); ++m) {
             const double imaginary = pole_of(modes[m]).imag();
             responses[m].peak_rad = std::max(responses[m].peak_rad, std::abs(z[m].imag()) / imaginary);
             responses[m].residual_rad = std::abs(z[m]) / imaginary;
           }
         });
  return responses;
}

std::vector<std::vector<double>> surrogate_histories(const ManeuverProblem& problem,
                                                     const ControlHistory& history,
                                                     const std::vector<SurrogateMode>& modes,
                                                     const std::vector<double>& times_s) {
  std::vector<double> all_s = fine_times_s(history, modes);
  all_s.insert(all_s.end(), times_s.begin(), times_s.end());
  std::sort(all_s.begin(), all_s.end());
  all_s.erase(std::unique(all_s.begin(), all_s.end()), all_s.end());
  std::vector<std::vector<double>> rows;
  follow(problem, history, modes, all_s, [&](double t_s, const std::vector<std::complex<double>>& z) {
    if (rows.size() == times_s.size() || t_s != times_s[rows.size()]) return;
    std::vector<double>& row = rows.emplace_back();
    for (std::size_t m = 0; m < modes.size(); ++m) row.push_back(z[m].imag() / pole_of(modes[m]).imag());
  });
  return rows;
}

}  // namespace slew
