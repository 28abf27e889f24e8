#include "server/guidance/singular_arcs.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace slew {

namespace {

// Of the Hamiltonian, which is -1: so little may another value of the control change it along an arc.
constexpr double kIndifferent = 1e-3;
// Of the maneuver's time: shorter arcs are none.
constexpr double kShortestArc = 5e-3;
// Of a control's range: levels begin so far within it.
constexpr double kWithin = 0.9;

// By how much the second best of a control's values is worse than the best.
double difference(const RigidManeuverPlant& plant, Eigen::Index i, double switching, double price) {
  const double least = plant.least_control[i], most = plant.most_control[i];
  std::array<double, 3> hamiltonian = {switching * least + price * std::abs(least), 0,
                                       switching * most + price * std::abs(most)};
  std::sort(hamiltonian.begin(), hamiltonian.end());
  return hamiltonian[1] - hamiltonian[0];
}

// Where the control is throttled.
void add_flown(const RigidManeuverPlant& plant, const OnOffProgram& maneuver, std::size_t control,
               std::vector<SingularArc>& arcs) {
  const std::vector<double>&values = maneuver.controls[control], &times = maneuver.switch_times_s[control];
  for (std::size_t k = 0; k < values.size(); ++k)
    if (is_throttled(plant, control, values[k]))
      arcs.push_back({control, k == 0 ? 0 : times[k - 1], k == times.size() ? maneuver.end_s : times[k]});
}

// From the first to the last switch, or end of a wrong sign, while the control's value hardly matters.
void add_indifferent(const RigidManeuverPlant& plant, const OnOffProgram& maneuver, const SignTest& signs,
                     std::size_t control, std::vector<SingularArc>& arcs) {
  const auto i = static_cast<Eigen::Index>(control);
  const double price = plant.consumption(i) * signs.multipliers.consumption;
  const double most = std::max(kIndifferent, 2 * signs.worst);
  const auto is_indifferent = [&](std::size_t p) {
    return difference(plant, i, signs.switching[p][i], price) <= most;
  };
  std::vector<double> marks = maneuver.switch_times_s[control];
  for (const SignViolation& violation : signs.violations)
    if (violation.control == control) marks.insert(marks.end(), {violation.from_s, violation.to_s});
  std::sort(marks.begin(), marks.end());
  for (std::size_t p = 0; p < signs.times_s.size(); ++p) {
    if (!is_indifferent(p)) continue;
    const auto first = std::lower_bound(marks.begin(), marks.end(), signs.times_s[p]);
    while (p + 1 < signs.times_s.size() && is_indifferent(p + 1)) ++p;
    const auto last = std::upper_bound(marks.begin(), marks.end(), signs.times_s[p]);
    if (last - first >= 2) arcs.push_back({control, *first, *(last - 1)});
  }
}

std::vector<SingularArc> joined(std::vector<SingularArc> arcs, double apart_s) {
  std::sort(arcs.begin(), arcs.end(),
            [](const SingularArc& a, const SingularArc& b) { return a.from_s < b.from_s; });
  std::vector<SingularArc> together;
  for (const SingularArc& arc : arcs) {
    if (!together.empty() && arc.from_s <= together.back().to_s + apart_s)
      together.back().to_s = std::max(together.back().to_s, arc.to_s);
    else
      together.push_back(arc);
  }
  return together;
}

// Switches of other controls within an arc. Many of them are another arc, and no reason to part this one.
std::vector<double> switches_within(const RigidManeuverPlant& plant, const OnOffProgram& maneuver,
                                    const SingularArc& arc, double shortest_s) {
  constexpr std::size_t kMost = 3;
  std::vector<double> within;
  for (std::size_t j = 0; j < maneuver.controls.size(); ++j)
    for (const double time : maneuver.switch_times_s[j])
      if (j != arc.control && !is_throttled_at(plant, maneuver, j, time) && time > arc.from_s + shortest_s &&
          time < arc.to_s - shortest_s)
        within.push_back(time);
  std::sort(within.begin(), within.end());
  within.erase(
      std::unique(within.begin(), within.end(), [&](double a, double b) { return b - a <= shortest_s; }),
      within.end());
  if (within.size() > kMost) within.clear();
  return within;
}

}  // namespace

bool is_throttled_at(const RigidManeuverPlant& plant, const OnOffProgram& maneuver, std::size_t control,
                     double time_s) {
  const std::vector<double>& times = maneuver.switch_times_s[control];
  const auto passed = std::upper_bound(times.begin(), times.end(), time_s) - times.begin();
  return is_throttled(plant, control, maneuver.controls[control][static_cast<std::size_t>(passed)]);
}

std::vector<SingularArc> likely_arcs(const RigidManeuverPlant& plant, const OnOffProgram& maneuver,
                                     const SignTest& signs) {
  const double shortest_s = kShortestArc * maneuver.end_s;
  std::vector<SingularArc> arcs;
  for (std::size_t control = 0; control < maneuver.controls.size(); ++control) {
    std::vector<SingularArc> found;
    add_flown(plant, maneuver, control, found);
    add_indifferent(plant, maneuver, signs, control, found);
    for (const SingularArc& arc : joined(found, 0.1 * shortest_s)) {
      std::vector<double> ends = switches_within(plant, maneuver, arc, shortest_s);
      ends.push_back(arc.to_s);
      double from = arc.from_s;
      for (const double to : ends) {
        if (to - from > shortest_s) arcs.push_back({control, from, to});
        from = to;
      }
    }
  }
  return arcs;
}

void throttle(const RigidManeuverPlant& plant, const SingularArc& arc, std::size_t pieces, ArcEnds ends,
              OnOffProgram& program) {
  std::vector<double>& values = program.controls[arc.control];
  std::vector<double>& times = program.switch_times_s[arc.control];
  const double middle = 0.5 * (arc.from_s + arc.to_s), half = 0.5 * (arc.to_s - arc.from_s);
  const auto begin_of = [&](std::size_t k) { return k == 0 ? 0 : times[k - 1]; };
  const auto end_of = [&](std::size_t k) { return k == times.size() ? program.end_s : times[k]; };
  // Of the control between two times: integrals of u, u x and u x^2, where x is -1 to 1 along the arc.
  const auto moments_of = [&](double from_s, double to_s) {
    Eigen::Vector3d moments = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double from = std::max(begin_of(k), from_s), to = std::min(end_of(k), to_s);
      if (!(to > from)) continue;
      const double a = (from - middle) / half, b = (to - middle) / half;
      moments += values[k] * Eigen::Vector3d(b - a, (b * b - a * a) / 2, (b * b * b - a * a * a) / 3);
    }
    return moments;
  };
  bool has_levels = false;
  for (std::size_t k = 0; k < values.size(); ++k)
    has_levels = has_levels || (is_throttled(plant, arc.control, values[k]) && end_of(k) > arc.from_s &&
                                begin_of(k) < arc.to_s);
  // The parabola nearest to a control that switches; levels have means of their own.
  Eigen::Matrix3d squares;
  squares << 2, 0, 2.0 / 3, 0, 2.0 / 3, 0, 2.0 / 3, 0, 2.0 / 5;
  const Eigen::Vector3d parabola = squares.inverse() * moments_of(arc.from_s, arc.to_s);

  std::vector<double> new_values, new_times;
  const auto add = [&](double value, double from) {
    if (!new_values.empty()) new_times.push_back(from);
    new_values.push_back(value);
  };
  for (std::size_t k = 0; k < values.size(); ++k)
    if (begin_of(k) < arc.from_s) add(values[k], begin_of(k));
  const auto i = static_cast<Eigen::Index>(arc.control);
  const double reach = 0.5 * (plant.most_control[i] - plant.least_control[i]);
  const double centre = 0.5 * (plant.most_control[i] + plant.least_control[i]);
  const double shorter = ends == ArcEnds::free ? 0.5 : 0;
  const double piece = 2 * half / (static_cast<double>(pieces) - 2 * shorter);
  for (std::size_t k = 0; k < pieces; ++k) {
    const double from = k == 0 ? arc.from_s : arc.from_s + piece * (static_cast<double>(k) - shorter);
    const double to =
        k + 1 == pieces ? arc.to_s : arc.from_s + piece * (static_cast<double>(k) + 1 - shorter);
    const double x = (0.5 * (from + to) - middle) / half;
    double level = has_levels ? moments_of(from, to)[0] * half / (to - from)
                              : parabola[0] + x * (parabola[1] + x * parabola[2]);
    level = std::clamp(level, centre - kWithin * reach, centre + kWithin * reach);
    if (level == 0) level = 1e-3 * reach;  // zero would be a coast
    add(level, from);
  }
  for (std::size_t k = 0; k < values.size(); ++k)
    if (end_of(k) > arc.to_s) add(values[k], std::max(begin_of(k), arc.to_s));
  values = std::move(new_values);
  times = std::move(new_times);
}

OnOffProgram with_saturated_levels(const RigidManeuverPlant& plant, OnOffProgram maneuver, double near) {
  for (std::size_t control = 0; control < maneuver.controls.size(); ++control) {
    const auto i = static_cast<Eigen::Index>(control);
    const double least = plant.least_control[i], most = plant.most_control[i];
    for (double& u : maneuver.controls[control]) {
      if (u > most - near * (most - least)) u = most;
      if (u < least + near * (most - least)) u = least;
    }
  }
  return maneuver;
}

OnOffProgram without_lone_levels(const RigidManeuverPlant& plant, const OnOffProgram& maneuver) {
  OnOffProgram changed = maneuver;
  for (std::size_t control = 0; control < maneuver.controls.size(); ++control) {
    const auto i = static_cast<Eigen::Index>(control);
    const double least = plant.least_control[i], most = plant.most_control[i];
    const std::vector<double>& values = maneuver.controls[control];
    const std::vector<double>& times = maneuver.switch_times_s[control];
    std::vector<double> new_values, new_times;
    const auto add = [&](double value, double from) {
      if (!new_values.empty()) new_times.push_back(from);
      new_values.push_back(value);
    };
    for (std::size_t k = 0; k < values.size(); ++k) {
      const bool is_last = k + 1 == values.size();
      const double from = k == 0 ? 0 : times[k - 1], to = is_last ? maneuver.end_s : times[k];
      const bool is_lone = values.size() > 1 && is_throttled(plant, control, values[k]) &&
                           (k == 0 || !is_throttled(plant, control, values[k - 1])) &&
                           (is_last || !is_throttled(plant, control, values[k + 1]));
      if (!is_lone) {
        add(values[k], from);
        continue;
      }
      const double high_s = (to - from) * (values[k] - least) / (most - least);
      const double before = k == 0 ? (values[k + 1] == most ? least : most) : values[k - 1];
      const double after = is_last ? (values[k - 1] == most ? least : most) : values[k + 1];
      if (before != after) {
        add(before, from);
        add(after, before == most ? from + high_s : to - high_s);
      } else {
        const double low_s = to - from - high_s, pulse_s = before == most ? low_s : high_s;
        const double middle = 0.5 * (from + to);
        add(before, from);
        add(before == most ? least : most, middle - 0.5 * pulse_s);
        add(after, middle + 0.5 * pulse_s);
      }
    }
    changed.controls[control] = std::move(new_values);
    changed.switch_times_s[control] = std::move(new_times);
  }
  return changed;
}

}  // namespace slew
