#include "server/propagation/axis_events.hpp"

#include <algorithm>

namespace slew {
namespace {

// Where omega keeps its sign sigma, s is a quadratic in tau,
//   s = (theta_0 - theta_f + T omega_0 + sigma k omega_0^2) + (omega_0 (1 + 2 sigma k alpha) + T alpha) tau
//       + alpha/2 (1 + 2 sigma k alpha) tau^2,
// and monotone on either side of where ds/dtau = 0; with T = 0 that is where omega = 0.
struct Piece {
  double begin;
  double end;
  double sigma;
};

struct Pieces {
  int count;
  std::array<Piece, 4> piece;
};

double sign_of(double value) {
  return value < 0 ? -1 : 1;
}

double first_coefficient(const QuadraticArc<double>& arc, const SwitchingFunction& law, double slope) {
  return arc.rate_rad_s * slope + law.rate_gain() * arc.acceleration_rad_s2;
}

Pieces monotone_pieces(const QuadraticArc<double>& arc, const SwitchingFunction& law, double h) {
  const double rate = arc.rate_rad_s;
  const double sigma = rate != 0 ? sign_of(rate) : sign_of(arc.acceleration_rad_s2);
  Pieces pieces{1, {Piece{0, h, sigma}, Piece{}, Piece{}, Piece{}}};
  if (rate != 0)
    if (const auto rest = rest_time(arc, h); rest && *rest < h)
      pieces = {2, {Piece{0, *rest, sigma}, Piece{*rest, h, -sigma}, Piece{}, Piece{}}};
  if (law.rate_gain() == 0) return pieces;

  Pieces divided{0, {}};
  const auto add = [&divided](const Piece& piece) {
    divided.piece[static_cast<std::size_t>(divided.count++)] = piece;
  };
  for (int i = 0; i < pieces.count; ++i) {
    const Piece& piece = pieces.piece[static_cast<std::size_t>(i)];
    const double slope = 1 + 2 * piece.sigma * law.curvature() * arc.acceleration_rad_s2;
    const double tau = -first_coefficient(arc, law, slope) / (arc.acceleration_rad_s2 * slope);
    if (!(tau > piece.begin && tau < piece.end)) {
      add(piece);
      continue;
    }
    add({piece.begin, tau, piece.sigma});
    add({tau, piece.end, piece.sigma});
  }
  return divided;
}

double s_at(const QuadraticArc<double>& arc, const SwitchingFunction& law, double tau) {
  return law.value(arc.angle_at(tau), arc.rate_at(tau));
}

// The time in the piece at which s = level, which is known to be passed there.
double crossing_time(const QuadraticArc<double>& arc, const SwitchingFunction& law, const Piece& piece,
                     double level_rad) {
  const double k = law.curvature();
  const double slope = 1 + 2 * piece.sigma * k * arc.acceleration_rad_s2;
  const double c0 = arc.angle_rad - law.final_angle_rad() + law.rate_gain() * arc.rate_rad_s +
                    piece.sigma * k * arc.rate_rad_s * arc.rate_rad_s - level_rad;
  const auto roots =
      quadratic_roots(c0, first_coefficient(arc, law, slope), 0.5 * arc.acceleration_rad_s2 * slope);
  // Rounding may put the root a little outside; the nearest one is meant. Without any, s has been beyond all
  // along.
  double best = piece.begin;
  double distance = HUGE_VAL;
  for (int i = 0; i < roots.count; ++i) {
    const double tau = roots.tau[static_cast<std::size_t>(i)];
    const double inside = std::clamp(tau, piece.begin, piece.end);
    if (std::abs(tau - inside) < distance) {
      distance = std::abs(tau - inside);
      best = inside;
    }
  }
  return best;
}

// With theta - reference at a level.
template <typename Function>
void each_time_at_angle(const QuadraticArc<double>& arc, double reference_rad, double level_rad,
                        Function&& each) {
  const auto roots = quadratic_roots(arc.angle_rad - reference_rad - level_rad, arc.rate_rad_s,
                                     0.5 * arc.acceleration_rad_s2);
  for (int i = 0; i < roots.count; ++i) each(roots.tau[static_cast<std::size_t>(i)]);
}

template <typename Function>
void each_time_at_angle(const HubPath& path, double reference_rad, double level_rad, Function&& each) {
  path.each_time_at_angle(reference_rad + level_rad, each);
}

template <typename Function>
void each_time_at_rate(const QuadraticArc<double>& arc, double rate_rad_s, Function&& each) {
  if (arc.acceleration_rad_s2 != 0) each((rate_rad_s - arc.rate_rad_s) / arc.acceleration_rad_s2);
}

template <typename Function>
void each_time_at_rate(const HubPath& path, double rate_rad_s, Function&& each) {
  path.each_time_at_rate(rate_rad_s, each);
}

template <typename Path>
bool in_box(const Path& arc, const EndBox& box, double final_angle_rad, double tau) {
  return std::abs(arc.angle_at(tau) - final_angle_rad) <= box.angle_rad &&
         std::abs(arc.rate_at(tau)) <= box.rate_rad_s;
}

}  // namespace

std::optional<SideCrossing> side_crossing(const QuadraticArc<double>& arc, const SwitchingFunction& law,
                                          SwitchingSide side, double h, double margin_rad) {
  const double enter_above = law.enter_above_rad() + margin_rad,
               leave_above = law.leave_above_rad() - margin_rad;
  const double enter_below = law.enter_below_rad() - margin_rad,
               leave_below = law.leave_below_rad() + margin_rad;
  const Pieces pieces = monotone_pieces(arc, law, h);
  for (int i = 0; i < pieces.count; ++i) {
    const Piece& piece = pieces.piece[static_cast<std::size_t>(i)];
    const double end = s_at(arc, law, piece.end);
    const auto at = [&](double level) { return crossing_time(arc, law, piece, level); };
    switch (side) {
      case SwitchingSide::below:
        if (end > leave_below) return SideCrossing{at(leave_below), law.beyond_below()};
        break;
      case SwitchingSide::above:
        if (end < leave_above) return SideCrossing{at(leave_above), law.beyond_above()};
        break;
      case SwitchingSide::inside:
        if (end > enter_above) return SideCrossing{at(enter_above), SwitchingSide::above};
        if (end < enter_below) return SideCrossing{at(enter_below), SwitchingSide::below};
        break;
    }
  }
  return std::nullopt;
}

namespace {

// s - level along an arc; ds/dtau = omega + (T + 2 k |omega|) alpha.
struct SideScan {
  const ModalArc& arc;
  const SwitchingFunction& law;
  double level_rad;

  ScanPoint at(double tau) const { return point(arc.at(tau)); }
  ScanPoint point(const AxisMotion& motion) const {
    return {law.value(motion.angle_rad, motion.rate_rad_s) - level_rad,
            motion.rate_rad_s + law.rate_slope(motion.rate_rad_s) * motion.acceleration_rad_s2};
  }
  ScanLook look(double a, double b) const {
    const AxisMotion motion = arc.at(0.5 * (a + b));
    const double half = 0.5 * (b - a), k2 = 2 * std::abs(law.curvature());
    const double jerk = arc.jerk_bound(a, b);
    const double acceleration = std::abs(motion.acceleration_rad_s2) + half * jerk;
    const double rate = std::abs(motion.rate_rad_s) + half * acceleration;
    const ScanPoint middle = point(motion);
    return {middle.value, middle.slope,
            acceleration + law.rate_gain() * jerk + k2 * (acceleration * acceleration + rate * jerk)};
  }
};

}  // namespace

namespace {

// The first time in [from, h] at which s leaves the side.
std::optional<SideCrossing> side_crossing_within(const ModalArc& arc, const SwitchingFunction& law,
                                                 SwitchingSide side, double from, double h,
                                                 double margin_rad) {
  const auto passes = [&](double level, int sign, double until) {
    return first_crossing(SideScan{arc, law, level}, sign, from, until, 1e-13 * h);
  };
  if (side == SwitchingSide::below) {
    const auto tau = passes(law.leave_below_rad() + margin_rad, 1, h);
    return tau ? std::optional(SideCrossing{*tau, law.beyond_below()}) : std::nullopt;
  }
  if (side == SwitchingSide::above) {
    const auto tau = passes(law.leave_above_rad() - margin_rad, -1, h);
    return tau ? std::optional(SideCrossing{*tau, law.beyond_above()}) : std::nullopt;
  }
  const auto up = passes(law.enter_above_rad() + margin_rad, 1, h);
  const auto down = passes(law.enter_below_rad() - margin_rad, -1, up.value_or(h));
  if (down && (!up || *down < *up)) return SideCrossing{*down, SwitchingSide::below};
  if (up) return SideCrossing{*up, SwitchingSide::above};
  return std::nullopt;
}

}  // namespace

// Most arcs end soon, whatever the time that is left: the windows of the search grow.
std::optional<SideCrossing> side_crossing(const ModalArc& arc, const SwitchingFunction& law,
                                          SwitchingSide side, double h, double margin_rad) {
  double from = 0, width = 2 * arc.basis().panel_s();
  while (from < h) {
    const double until = h - from > width ? from + width : h;
    if (const auto crossing = side_crossing_within(arc, law, side, from, until, margin_rad)) return crossing;
    from = until;
    width *= 2;
  }
  return std::nullopt;
}

int side_motion(const ModalArc& arc, const SwitchingFunction& law) {
  const AxisMotion begin = arc.begin();
  return side_motion(QuadraticArc<double>{begin.angle_rad, begin.rate_rad_s, begin.acceleration_rad_s2}, law);
}

int side_motion(const QuadraticArc<double>& arc, const SwitchingFunction& law) {
  const double rate = arc.rate_rad_s;
  const double acceleration = arc.acceleration_rad_s2;
  if (rate == 0 && acceleration == 0) return 0;
  const double sigma = rate != 0 ? sign_of(rate) : sign_of(acceleration);
  double slope = sigma + 2 * law.curvature() * acceleration;
  if (law.rate_gain() != 0) {
    const double factor = 1 + 2 * sigma * law.curvature() * acceleration;
    slope = first_coefficient(arc, law, factor);
    if (slope == 0) slope = acceleration * factor;
  }
  return slope > 0 ? 1 : slope < 0 ? -1 : 0;
}

namespace {

template <typename Path>
std::optional<double> box_crossing_on_path(const Path& path, const EndBox& box, double final_angle_rad,
                                           bool inside, double h, double resolution) {
  // Every time at which one of the four sides is met; between two of them the answer cannot change.
  AscendingTimes<8> times;
  const auto add = [&](double tau) {
    if (tau > 0 && tau < h) times.add(tau);
  };
  for (const double side : {-box.angle_rad, box.angle_rad})
    each_time_at_angle(path, final_angle_rad, side, add);
  for (const double side : {-box.rate_rad_s, box.rate_rad_s}) each_time_at_rate(path, side, add);
  times.add(h);

  double begin = 0;
  for (std::size_t i = 0; i < times.count(); ++i) {
    if (times[i] - begin > resolution &&
        in_box(path, box, final_angle_rad, 0.5 * (begin + times[i])) != inside)
      return begin;
    begin = times[i];
  }
  return std::nullopt;
}

}  // namespace

std::optional<double> box_crossing(const QuadraticArc<double>& arc, const EndBox& box, double final_angle_rad,
                                   bool inside, double h, double resolution) {
  return box_crossing_on_path(arc, box, final_angle_rad, inside, h, resolution);
}

std::optional<double> box_crossing(const HubPath& path, const EndBox& box, double final_angle_rad,
                                   bool inside, double h, double resolution) {
  return box_crossing_on_path(path, box, final_angle_rad, inside, h, resolution);
}

namespace {

// Between `from` and h, by all four sides of the box.
std::optional<double> box_crossing_within(const ModalArc& arc, const EndBox& box, double final_angle_rad,
                                          bool inside, double from, double h, double resolution) {
  // The four sides, the side of each on which the arc is, and when it gets to the other.
  struct Side {
    bool is_rate;
    double level;
    int sign;  ///< of the quantity minus the level
    std::optional<double> next;
  };
  std::array<Side, 4> sides{{{false, final_angle_rad - box.angle_rad, 0, {}},
                             {false, final_angle_rad + box.angle_rad, 0, {}},
                             {true, -box.rate_rad_s, 0, {}},
                             {true, box.rate_rad_s, 0, {}}}};
  const double scan_resolution = 1e-13 * h;
  const AxisMotion start = arc.at(from);
  const auto look_ahead = [&](Side& side, double after) {
    side.next =
        side.is_rate
            ? first_crossing(RateScan<ModalArc>{arc, side.level}, -side.sign, after, h, scan_resolution)
            : first_crossing(AngleScan<ModalArc>{arc, side.level}, -side.sign, after, h, scan_resolution);
  };
  for (Side& side : sides) {
    const double value = side.is_rate ? start.rate_rad_s : start.angle_rad;
    side.sign = value > side.level ? 1 : -1;
    look_ahead(side, from);
  }
  double begin = from;
  for (int i = 0; i < 10000; ++i) {
    Side* first = nullptr;
    for (Side& side : sides)
      if (side.next && (!first || *side.next < *first->next)) first = &side;
    const double next = first ? *first->next : h;
    if (next - begin > resolution) {
      const AxisMotion middle = arc.at(0.5 * (begin + next));
      const bool is_in = std::abs(middle.angle_rad - final_angle_rad) <= box.angle_rad &&
                         std::abs(middle.rate_rad_s) <= box.rate_rad_s;
      if (is_in != inside) return begin;
    }
    if (!first) return std::nullopt;
    begin = next;
    first->sign = -first->sign;
    look_ahead(*first, begin);
  }
  return std::nullopt;
}

}  // namespace

// Far from the sides of the box nothing can happen, and bounds tell: only what is near them is looked at
// closely.
std::optional<double> box_crossing(const ModalArc& arc, const EndBox& box, double final_angle_rad,
                                   bool inside, double h, double resolution) {
  std::array<double, 80> ends;
  std::size_t depth = 0;
  double begin = 0;
  ends[0] = h;
  const double closely = std::min(h, 1e-3 * h + 1e-2);
  while (true) {
    const double end = ends[depth], half = 0.5 * (end - begin);
    const AxisMotion middle = arc.at(begin + half);
    const double acceleration = std::abs(middle.acceleration_rad_s2) + half * arc.jerk_bound(begin, end);
    const double angle_reach = half * (std::abs(middle.rate_rad_s) + 0.5 * half * acceleration);
    const double rate_reach = half * acceleration;
    const double angle_excess = std::abs(middle.angle_rad - final_angle_rad) - box.angle_rad;
    const double rate_excess = std::abs(middle.rate_rad_s) - box.rate_rad_s;
    const bool is_all_outside = angle_excess > angle_reach || rate_excess > rate_reach;
    const bool is_all_inside = -angle_excess > angle_reach && -rate_excess > rate_reach;
    if (inside ? !is_all_inside : !is_all_outside) {
      if (inside ? is_all_outside : is_all_inside) return begin;
      if (2 * half > closely && depth + 1 < ends.size()) {
        ends[++depth] = begin + half;
        continue;
      }
      if (const auto tau = box_crossing_within(arc, box, final_angle_rad, inside, begin, end, resolution))
        return tau;
    }
    begin = end;
    if (depth-- == 0) return std::nullopt;
  }
}

}  // namespace slew
