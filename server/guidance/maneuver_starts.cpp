#include "server/guidance/maneuver_starts.hpp"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>

#include "server/guidance/on_off_search.hpp"

namespace slew {

namespace {

// With bounds +-1 and from rest to rest, a double integrator that switches twice, at a and a + T/2, is
// displaced by a T - T^2/4; one that switches at x, T/2 and T - x by 2 x T - 2 x^2 - T^2/4. Here for the part
// r of the largest displacement, T^2/4, in units of T.
double two_switches(double r) {
  return 0.25 * (1 + r);
}
double three_switches(double r) {
  return 0.5 * (1 - std::sqrt(0.5 * (1 - r)));
}

// Where the part is larger a control has no choice left.
constexpr double kCritical = 0.95;

}  // namespace

ManeuverStarts::ManeuverStarts(const ManeuverProblem& problem, const ManeuverBody& body, std::uint64_t seed)
    : problem_(&problem),
      body_(&body),
      random_(seed, RandomUse::maneuver_start, 0),
      eigenaxis_(
          eigenaxis_maneuver(body, slew::eigenaxis(problem.initial.attitude, problem.final.attitude))) {}

double ManeuverStarts::draw(std::uint64_t k, std::uint32_t which) const {
  return random_.uniform(64 * k + which);
}

double ManeuverStarts::value(std::size_t i, int sign) const {
  const auto row = static_cast<Eigen::Index>(i);
  if (sign == 0) return 0;
  return sign > 0 ? body_->plant.most_control[row] : body_->plant.least_control[row];
}

// Between the time in which all controls together would turn the body and the eigenaxis maneuver's.
double ManeuverStarts::time(double draw) const {
  if (problem_->time_start_s) return *problem_->time_start_s * (0.9 + 0.3 * draw);
  const double angle = std::max(eigenaxis_.eigenaxis.angle_rad, 1e-3);
  double boldest = 2 * std::sqrt(angle / std::max(eigenaxis_.boldest_rad_s2, 1e-300));
  // Rates that must be changed take their time, too.
  const Eigen::Vector3d change = problem_->final.rate_rad_s - problem_->initial.rate_rad_s;
  const Eigen::VectorXd effort =
      body_->plant.influence_N_m.completeOrthogonalDecomposition().solve(body_->plant.inertia_kg_m2 * change);
  boldest = std::max(boldest, effort.cwiseAbs().maxCoeff());
  const double slowest = std::max(boldest * 1.05, std::min(eigenaxis_.synthetic_s, 3 * boldest));
  return boldest * std::pow(slowest / boldest, 0.15 + 0.85 * draw);
}

double ManeuverStarts::share(std::size_t i, double time_s) const {
  const auto row = static_cast<Eigen::Index>(i);
  const double reach = 0.5 * (body_->plant.most_control[row] - body_->plant.least_control[row]);
  const double wanted = eigenaxis_.effort_s2[row] * eigenaxis_.eigenaxis.angle_rad / std::max(reach, 1e-300);
  return std::clamp(4 * wanted / (time_s * time_s), -1.0, 1.0);
}

OnOffProgram ManeuverStarts::start(std::uint64_t k) const {
  if (problem_->most_consumption || problem_->most_rate_rad_s) {
    if (k % 2 == 0) return coasting(k / 2);
    return problem_->most_consumption ? with_coasts(switching(k / 2)) : switching(k / 2);
  }
  return switching(k);
}

OnOffProgram ManeuverStarts::switching(std::uint64_t k) const {
  if (k >= 6 && k % 3 == 2) return anywhere(k);
  const std::size_t n = static_cast<std::size_t>(body_->plant.controls());
  OnOffProgram program;
  program.end_s = time(draw(k, 0));
  program.controls.resize(n);
  program.switch_times_s.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto which = static_cast<std::uint32_t>(4 + 4 * i);
    const double noise = 0.12 * (2 * draw(k, which) - 1);
    const double part = share(i, program.end_s);
    const bool is_critical = std::abs(part) > kCritical;
    // The corner of the cube: bit i of k.
    const int sign = is_critical ? (part > 0 ? 1 : -1) : ((k >> (i % 3)) & 1U) ? -1 : 1;
    const double along = sign * part;
    std::vector<double> times;
    if (is_critical && draw(k, which + 1) < 0.8) {
      times = {0.5 + 0.3 * noise};
    } else if (draw(k, which + 1) < 0.7) {
      const double a = std::clamp(two_switches(along) + noise, 0.02, 0.48);
      times = {a, a + 0.5};
    } else {
      const double x = std::clamp(three_switches(along) + noise, 0.02, 0.48);
      times = {x, 0.5, 1 - x};
    }
    int now = sign;
    program.controls[i].push_back(value(i, now));
    for (const double time : times) {
      now = -now;
      program.controls[i].push_back(value(i, now));
      program.switch_times_s[i].push_back(time * program.end_s);
    }
  }
  return program;
}

// Where the double integrators are no guide: couplings are strong, or rates at the ends are not zero.
OnOffProgram ManeuverStarts::anywhere(std::uint64_t k) const {
  OnOffProgram program;
  program.end_s = time(0.5) * (0.7 + 1.6 * draw(k, 0) * draw(k, 1));
  for (std::size_t i = 0; i < static_cast<std::size_t>(body_->plant.controls()); ++i) {
    const auto which = static_cast<std::uint32_t>(4 + 4 * i);
    int sign = draw(k, which) < 0.5 ? -1 : 1;
    std::vector<double> values = {value(i, sign)}, times;
    const int count = draw(k, which + 1) < 0.6 ? 2 : 3;
    const double first = 0.05 + 0.4 * draw(k, which + 2), last = 0.55 + 0.4 * draw(k, which + 3);
    for (int j = 0; j < count; ++j) {
      times.push_back(program.end_s * (first + (last - first) * j / (count - 1)));
      sign = -sign;
      values.push_back(value(i, sign));
    }
    program.controls.push_back(values);
    program.switch_times_s.push_back(times);
  }
  return program;
}

// A coast about each switch, and more time, so that it consumes what it may: to displace a double integrator
// as far with the part r of the thrust takes (1/r + r)/2 of the time.
OnOffProgram ManeuverStarts::with_coasts(const OnOffProgram& program) const {
  const double part =
      std::clamp(0.95 * *problem_->most_consumption / consumption_of(program, body_->plant), 0.02, 1.0);
  if (!(part < 0.999)) return program;
  const double stretch = 0.5 * (1 / part + part);
  OnOffProgram slower = program;
  slower.end_s = stretch * program.end_s;
  for (std::size_t i = 0; i < program.controls.size(); ++i) {
    const std::vector<double>& times = program.switch_times_s[i];
    std::vector<double> values, changes;
    // Of each segment the part r / stretch is kept: in its middle, or at the ends of the maneuver.
    const double kept = part / stretch;
    for (std::size_t j = 0; j < program.controls[i].size(); ++j) {
      const double from = stretch * (j == 0 ? 0 : times[j - 1]);
      const double to = stretch * (j == times.size() ? program.end_s : times[j]);
      const double slack = (to - from) * (1 - kept);
      const bool is_first = j == 0, is_last = j == times.size();
      const double before = is_first ? 0 : is_last ? slack : 0.5 * slack;
      if (!is_first) changes.push_back(from + before);
      values.push_back(program.controls[i][j]);
      if (!is_last) {
        changes.push_back(to - (slack - before));
        values.push_back(0);
      }
    }
    slower.controls[i] = values;
    slower.switch_times_s[i] = changes;
  }
  return slower;
}

// Thrust, coast, thrust: for so long that the limits on rate and consumption are met about the eigenaxis.
OnOffProgram ManeuverStarts::coasting(std::uint64_t k) const {
  const std::size_t n = static_cast<std::size_t>(body_->plant.controls());
  const double angle = std::max(eigenaxis_.eigenaxis.angle_rad, 1e-3);
  double largest = 0, per_rate = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double reach = std::max(0.5 * (value(i, 1) - value(i, -1)), 1e-300);
    largest = std::max(largest, std::abs(eigenaxis_.effort_s2[row]) / reach);
    per_rate += 2 * body_->plant.consumption(row) * std::abs(eigenaxis_.effort_s2[row]);
  }
  double rate = std::sqrt(angle / largest);  // without a coast
  if (problem_->most_rate_rad_s)
    for (int axis = 0; axis < 3; ++axis)
      rate = std::min(rate, 0.97 * (*problem_->most_rate_rad_s)[axis] /
                                std::max(std::abs(eigenaxis_.eigenaxis.axis[axis]), 1e-9));
  if (problem_->most_consumption && per_rate > 0)
    rate = std::min(rate, 0.95 * *problem_->most_consumption / per_rate);
  rate *= 0.8 + 0.2 * draw(k, 0);
  OnOffProgram program;
  program.end_s = angle / rate + largest * rate;
  program.controls.resize(n);
  program.switch_times_s.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto which = static_cast<std::uint32_t>(4 + 4 * i);
    const double reach = std::max(0.5 * (value(i, 1) - value(i, -1)), 1e-300);
    const double burn = std::abs(eigenaxis_.effort_s2[row]) / reach * rate;
    // A little more or less, of what there is.
    double more = 0.04 * program.end_s;
    if (problem_->most_consumption && body_->plant.consumption(row) > 0)
      more = std::min(more, 0.03 * *problem_->most_consumption / (body_->plant.consumption(row) * reach));
    int sign = eigenaxis_.effort_s2[row] < 0 ? -1 : 1;
    if (burn < 0.25 * more && draw(k, which + 3) < 0.5) sign = -sign;
    const double first = std::min(burn + more * draw(k, which), 0.48 * program.end_s);
    const double last = std::min(burn + more * draw(k, which + 1), 0.48 * program.end_s);
    program.controls[i] = {value(i, sign), value(i, 0), value(i, -sign)};
    program.switch_times_s[i] = {first, program.end_s - last};
    // Controls that push one way only.
    if (value(i, sign) == value(i, 0) || value(i, -sign) == value(i, 0)) {
      program.controls[i] = {value(i, 1), value(i, -1), value(i, 1)};
    }
  }
  return program;
}

bool ManeuverStarts::turns_about_the_eigenaxis() const {
  return body_->plant.is_free() && problem_->initial.rate_rad_s.isZero() &&
         problem_->final.rate_rad_s.isZero() && !problem_->most_consumption && !problem_->most_rate_rad_s &&
         eigenaxis_.eigenaxis.angle_rad > 0 && std::isfinite(eigenaxis_.time_s);
}

OnOffProgram ManeuverStarts::about_the_eigenaxis(int slots) const {
  OnOffProgram program;
  const auto n = static_cast<std::size_t>(body_->plant.controls());
  program.end_s = eigenaxis_.time_s;
  program.controls.assign(n, {});
  program.switch_times_s.resize(n);
  for (std::size_t i = 0; i < n; ++i) program.controls[i].push_back(value(i, -1));
  const std::vector<double>&times = eigenaxis_.times_s, &rates = eigenaxis_.rates_rad_s;
  const double slot_s = program.end_s / slots;
  const auto rate_at = [&](double t) {
    const auto after = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(std::upper_bound(times.begin(), times.end(), t) - times.begin(), 1,
                                   static_cast<std::ptrdiff_t>(times.size()) - 1));
    const double part = (t - times[after - 1]) / std::max(times[after] - times[after - 1], 1e-300);
    return rates[after - 1] + std::clamp(part, 0.0, 1.0) * (rates[after] - rates[after - 1]);
  };
  for (int k = 0; k < slots; ++k) {
    const double from = k * slot_s, w0 = rate_at(from), w1 = rate_at(from + slot_s);
    const double square = (w0 * w0 + w0 * w1 + w1 * w1) / 3;
    for (std::size_t i = 0; i < n; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double mean = eigenaxis_.effort_s2[row] * (w1 - w0) / slot_s + eigenaxis_.hold[row] * square;
      const double duty = std::clamp((mean - value(i, -1)) / (value(i, 1) - value(i, -1)), 0.0, 1.0);
      // The pulse in the middle of its slot: the displacement is the mean's, too.
      program.controls[i].insert(program.controls[i].end(), {value(i, 1), value(i, -1)});
      program.switch_times_s[i].insert(program.switch_times_s[i].end(),
                                       {from + 0.5 * (1 - duty) * slot_s, from + 0.5 * (1 + duty) * slot_s});
    }
  }
  return without_short_segments(program, 1e-4 * program.end_s);
}

OnOffProgram ManeuverStarts::start_of(const std::vector<SwitchSequence>& sequences, std::uint64_t k) const {
  OnOffProgram program;
  program.end_s = time(draw(k, 0));
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    const SwitchSequence& sequence = sequences[i];
    std::vector<double> values, times;
    const auto which = static_cast<std::uint32_t>(4 + 4 * i);
    const double along = sequence.front() * share(i, program.end_s);
    const double noise = (k == 0 ? 0.0 : 0.12) * (2 * draw(k, which) - 1);
    const bool has_coasts = std::find(sequence.begin(), sequence.end(), 0) != sequence.end();
    for (const int sign : sequence) values.push_back(value(i, sign));
    const std::size_t count = sequence.size() - 1;
    if (!has_coasts && count == 1) {
      times = {0.5 + 0.3 * noise};
    } else if (!has_coasts && count == 2) {
      const double a = std::clamp(two_switches(along) + noise, 0.02, 0.48);
      times = {a, a + 0.5};
    } else if (!has_coasts && count == 3 && k % 2 == 0) {
      const double x = std::clamp(three_switches(along) + noise, 0.02, 0.48);
      times = {x, 0.5, 1 - x};
    } else {
      for (std::size_t j = 0; j < count; ++j)
        times.push_back(has_coasts ? (static_cast<double>(j) + 0.6 + 0.3 * draw(k, which + 1)) /
                                         (static_cast<double>(count) + 0.5)
                                   : random_.uniform(64 * k + 40 + 4 * i + j));
      std::sort(times.begin(), times.end());
    }
    for (double& time : times) time *= program.end_s;
    program.controls.push_back(values);
    program.switch_times_s.push_back(times);
  }
  return program;
}

}  // namespace slew
