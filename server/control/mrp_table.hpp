// A reference p_d(t) between knots at which it and its first two derivatives are known: by polynomials of
// degree five, which meet all of them.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "server/control/attitude_sight.hpp"

namespace slew {

/// At least two knots, ascending in time. Before the first the reference rests where it begins, after the
/// last where it ends.
struct MrpTable {
  struct Knot {
    double t_s;
    MrpReference<double> before, after;  ///< they differ in p_d'' only, where a torque jumps
  };
  std::vector<Knot> knots;
  std::vector<double> jumps_s;  ///< ascending: the ends, and where p_d'' jumps

  /// As a step that began there sees it: up to the next jump, and at it, with what was before.
  MrpReference<double> at(double t_s, double step_began_s) const {
    const double jump_s = next_jump_s(step_began_s);
    if (step_began_s >= knots.back().t_s) return {knots.back().before.mrp};
    if (t_s < knots.front().t_s) return {knots.front().after.mrp};
    const auto to = t_s < jump_s ? std::upper_bound(knots.begin(), knots.end(), t_s,
                                                    [](double t, const Knot& knot) { return t < knot.t_s; })
                                 : std::lower_bound(knots.begin(), knots.end(), jump_s,
                                                    [](const Knot& knot, double t) { return knot.t_s < t; });
    return between(*(to - 1), *to, std::min(t_s, jump_s));
  }

  double next_jump_s(double t_s) const {
    const auto after = std::upper_bound(jumps_s.begin(), jumps_s.end(), t_s);
    return after == jumps_s.end() ? std::numeric_limits<double>::infinity() : *after;
  }

 private:
  // Beyond the polynomial of degree two that the first knot gives: c3 x^3 + c4 x^4 + c5 x^5.
  static MrpReference<double> between(const Knot& from, const Knot& to, double t_s) {
    const double h = to.t_s - from.t_s, x = (t_s - from.t_s) / h;
    const MrpReference<double>&a = from.after, &b = to.before;
    const Eigen::Vector3d v = h * a.rate_1_s, w = h * h * a.acceleration_1_s2;
    const Eigen::Vector3d d0 = b.mrp - a.mrp - v - 0.5 * w, d1 = h * b.rate_1_s - v - w,
                          d2 = h * h * b.acceleration_1_s2 - w;
    const Eigen::Vector3d c3 = 10 * d0 - 4 * d1 + 0.5 * d2, c4 = -15 * d0 + 7 * d1 - d2,
                          c5 = 6 * d0 - 3 * d1 + 0.5 * d2;
    MrpReference<double> reference;
    reference.mrp = a.mrp + x * (v + x * (0.5 * w + x * (c3 + x * (c4 + x * c5))));
    reference.rate_1_s = (v + x * (w + x * (3 * c3 + x * (4 * c4 + x * 5 * c5)))) / h;
    reference.acceleration_1_s2 = (w + x * (6 * c3 + x * (12 * c4 + x * 20 * c5))) / (h * h);
    return reference;
  }
};

}  // namespace slew
