#include "server/propagation/axis_events.hpp"

#include <algorithm>

namespace slew {
namespace {

// Where omega keeps its sign sigma, s is a quadratic in tau,
//   s = (theta_0 - theta_f + sigma k omega_0^2) + omega_0 (1 + 2 sigma k alpha) tau
//       + alpha/2 (1 + 2 sigma k alpha) tau^2,
// and monotone: ds/dtau = omega (1 + 2 sigma k alpha).
struct Piece {
  double begin;
  double end;
  double sigma;
};

// At most two, divided where omega passes through zero.
struct Pieces {
  int count;
  std::array<Piece, 2> piece;
};

double sign_of(double value) {
  return value < 0 ? -1 : 1;
}

Pieces monotone_pieces(const QuadraticArc<double>& arc, double h) {
  const double rate = arc.rate_rad_s;
  const double sigma = rate != 0 ? sign_of(rate) : sign_of(arc.acceleration_rad_s2);
  if (rate != 0)
    if (const auto rest = rest_time(arc, h); rest && *rest < h)
      return {2, {Piece{0, *rest, sigma}, Piece{*rest, h, -sigma}}};
  return {1, {Piece{0, h, sigma}, Piece{}}};
}

double s_at(const QuadraticArc<double>& arc, const SwitchingFunction& law, double tau) {
  return law.value(arc.angle_at(tau), arc.rate_at(tau));
}

// The time in the piece at which s = level, which is known to be passed there.
double crossing_time(const QuadraticArc<double>& arc, const SwitchingFunction& law, const Piece& piece,
                     double final_angle_rad, double level_rad) {
  const double k = law.curvature();
  const double slope = 1 + 2 * piece.sigma * k * arc.acceleration_rad_s2;
  const double c0 =
      arc.angle_rad - final_angle_rad + piece.sigma * k * arc.rate_rad_s * arc.rate_rad_s - level_rad;
  const auto roots = quadratic_roots(c0, arc.rate_rad_s * slope, 0.5 * arc.acceleration_rad_s2 * slope);
  // Rounding may put the root a little outside; the nearest one is meant.
  double best = piece.end;
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

bool in_box(const QuadraticArc<double>& arc, const EndBox& box, double final_angle_rad, double tau) {
  return std::abs(arc.angle_at(tau) - final_angle_rad) <= box.angle_rad &&
         std::abs(arc.rate_at(tau)) <= box.rate_rad_s;
}

}  // namespace

std::optional<SideCrossing> side_crossing(const QuadraticArc<double>& arc, const SwitchingFunction& law,
                                          SwitchingSide side, double final_angle_rad, double h) {
  const Pieces pieces = monotone_pieces(arc, h);
  for (int i = 0; i < pieces.count; ++i) {
    const Piece& piece = pieces.piece[static_cast<std::size_t>(i)];
    const double end = s_at(arc, law, piece.end);
    const auto at = [&](double level) { return crossing_time(arc, law, piece, final_angle_rad, level); };
    switch (side) {
      case SwitchingSide::below:
        if (end > law.lower_rad())
          return SideCrossing{at(law.lower_rad()), law.lower_rad() == law.upper_rad()
                                                       ? SwitchingSide::above
                                                       : SwitchingSide::inside};
        break;
      case SwitchingSide::above:
        if (end < law.upper_rad())
          return SideCrossing{at(law.upper_rad()), law.lower_rad() == law.upper_rad()
                                                       ? SwitchingSide::below
                                                       : SwitchingSide::inside};
        break;
      case SwitchingSide::inside:
        if (end > law.upper_rad()) return SideCrossing{at(law.upper_rad()), SwitchingSide::above};
        if (end < law.lower_rad()) return SideCrossing{at(law.lower_rad()), SwitchingSide::below};
        break;
    }
  }
  return std::nullopt;
}

int side_motion(const QuadraticArc<double>& arc, const SwitchingFunction& law) {
  const double rate = arc.rate_rad_s;
  const double acceleration = arc.acceleration_rad_s2;
  if (rate == 0 && acceleration == 0) return 0;
  const double sigma = rate != 0 ? sign_of(rate) : sign_of(acceleration);
  const double slope = sigma + 2 * law.curvature() * acceleration;
  return slope > 0 ? 1 : slope < 0 ? -1 : 0;
}

std::optional<double> box_crossing(const QuadraticArc<double>& arc, const EndBox& box, double final_angle_rad,
                                   bool inside, double h, double resolution) {
  // Every time at which one of the four sides is met; between two of them the answer cannot change.
  AscendingTimes<8> times;
  const auto add = [&](double tau) {
    if (tau > 0 && tau < h) times.add(tau);
  };
  for (const double side : {-box.angle_rad, box.angle_rad}) {
    const auto roots = quadratic_roots(arc.angle_rad - final_angle_rad - side, arc.rate_rad_s,
                                       0.5 * arc.acceleration_rad_s2);
    for (int i = 0; i < roots.count; ++i) add(roots.tau[static_cast<std::size_t>(i)]);
  }
  if (arc.acceleration_rad_s2 != 0)
    for (const double side : {-box.rate_rad_s, box.rate_rad_s})
      add((side - arc.rate_rad_s) / arc.acceleration_rad_s2);
  times.add(h);

  double begin = 0;
  for (std::size_t i = 0; i < times.count(); ++i) {
    if (times[i] - begin > resolution &&
        in_box(arc, box, final_angle_rad, 0.5 * (begin + times[i])) != inside)
      return begin;
    begin = times[i];
  }
  return std::nullopt;
}

}  // namespace slew
