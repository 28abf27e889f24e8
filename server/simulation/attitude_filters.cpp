#include "server/simulation/attitude_filters.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/actuator/pwpf_filter.hpp"
#include "server/propagation/quartic.hpp"

namespace slew {
namespace {

constexpr std::array<double, 5> kNodes{0, 0.25, 0.5, 0.75, 1};
/// Where a quartic through the nodes is furthest from what it follows, and its powers there.
constexpr double kBetween = 0.125;
/// A corner so near to where the step begins is the one at which it began.
constexpr double kBegins = 1e-5;

double value(const std::array<double, 5>& quartic, double x) {
  return quartic[0] + x * (quartic[1] + x * (quartic[2] + x * (quartic[3] + x * quartic[4])));
}

}  // namespace

void AttitudeFilters::ask(const AttitudeLoop& loop, const AttitudeHold& hold, double t_s, const double* state,
                          Place& place) {
  const AttitudeDemand demand = loop.demand(hold, t_s, state);
  loop.allocate(hold, t_s, demand.torque_N_m, std::span(place.demands).first(loop.channels().size()));
  place.surface_rad_s = demand.law.surface_rad_s;
}

double AttitudeFilters::begin(const AttitudeLoop& loop, const AttitudeHold& hold, double t_s,
                              const AttitudeState& state, const std::array<bool, kMaxThrusters>& is_free) {
  ask(loop, hold, t_s, state.data(), places_[0]);
  const PwpfModulator& pwpf = *loop.pwpf();
  double first_s = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < loop.channels().size(); ++c) {
    if (!is_free[c]) continue;
    const double filter = state[loop.filters_at() + c];
    const int output = hold.outputs[c];
    const double limit = loop.filter_limit(c, places_[0].demands[c], output);
    const double threshold = output != 0 ? output * pwpf.off : std::copysign(pwpf.on, limit);
    first_s = std::min(first_s, time_to_reach(pwpf, filter, limit, threshold));
  }
  return first_s;
}

AttitudeFilters::Outcome AttitudeFilters::step(const AttitudeLoop& loop, const AttitudeHold& hold, double t_s,
                                               double h, Body& body, const double* filters) {
  const double time_constant_s = loop.pwpf()->time_constant_s;
  const double longest = LaggedInput::kLongest * time_constant_s;
  if (h > longest) return {false, longest, longest};
  AttitudeState state;
  const auto ask_at = [&](double x, Place& place) {
    body.at(x, 0, body.size(), state.data());
    ask(loop, hold, t_s + x * h, state.data(), place);
  };
  for (std::size_t i = 1; i < 4; ++i) ask_at(kNodes[i], places_[i]);
  ask(loop, hold, t_s + h, body.end().data(), places_[4]);
  if (const auto corner = first_corner(loop)) return {false, *corner * h, h};

  Place between;
  ask_at(kBetween, between);
  const double relative = loop.specification().relative_tolerance;
  const double length = h / time_constant_s;
  double worst = 0;
  for (std::size_t c = 0; c < loop.channels().size(); ++c) {
    std::array<double, 5> inputs;
    for (std::size_t i = 0; i < 5; ++i)
      inputs[i] = loop.filter_limit(c, places_[i].demands[c], hold.outputs[c]);
    const std::array<double, 5> quartic = LaggedInput::quartic(inputs);
    lags_[c].begin(filters[c], quartic, length);
    const double off = loop.filter_limit(c, between.demands[c], hold.outputs[c]) - value(quartic, kBetween);
    const double size = std::max(std::abs(filters[c]), std::abs(lags_[c].at(1)));
    worst = std::max(worst, std::abs(off) * length / (relative * (size + 1e-3)));
  }
  // The quartic's error grows with the sixth power of the length.
  const double growth =
      worst <= 1 ? std::min(2.0, 0.9 / std::sqrt(std::sqrt(std::sqrt(worst)))) : Body::growth(worst);
  const double next = std::min(longest, h * growth);
  return worst <= 1 ? Outcome{true, h, next} : Outcome{false, std::min(next, 0.7 * h), next};
}

// Where s of an axis enters or leaves the boundary layer.
std::optional<double> AttitudeFilters::first_corner(const AttitudeLoop& loop) const {
  const std::optional<double> layer = boundary_layer_rad_s(loop.specification().law);
  if (!layer) return std::nullopt;
  std::optional<double> first;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) {
      std::array<double, 5> beyond;
      for (std::size_t i = 0; i < 5; ++i) beyond[i] = sign * places_[i].surface_rad_s[axis] - *layer;
      const auto is_beyond = [](double b) { return b > 0; };
      // At the beginning itself rounding decides.
      const auto count = std::count_if(beyond.begin() + 1, beyond.end(), is_beyond);
      if (count == 0 ? beyond[0] < 1e-9 * *layer : count == 4 && beyond[0] > -1e-9 * *layer) continue;
      const Quartic curve = Quartic::through(beyond);
      const bool begins_beyond = curve.at(kBegins) > 0;
      const auto x = (begins_beyond ? curve.shifted(-1, 0) : curve).first_positive(1e-9);
      if (x && *x > kBegins && *x < 1 - kBegins && (!first || *x < *first)) first = x;
    }
  return first;
}

std::optional<AttitudeFilters::Crossing> AttitudeFilters::first_crossing(
    const AttitudeLoop& loop, const AttitudeHold& hold,
    const std::array<bool, kMaxThrusters>& is_free) const {
  const PwpfModulator& pwpf = *loop.pwpf();
  std::optional<Crossing> first;
  for (std::size_t c = 0; c < loop.channels().size(); ++c) {
    if (!is_free[c]) continue;
    const LaggedInput& lag = lags_[c];
    std::array<double, 5> f;
    for (std::size_t i = 0; i < 5; ++i) f[i] = lag.at(kNodes[i]);
    // sign * f passes a threshold upwards: the quartic tells where about, the lag itself where.
    const auto consider = [&](double sign, double threshold, int output) {
      const auto [least, most] =
          std::minmax({sign * f[0], sign * f[1], sign * f[2], sign * f[3], sign * f[4]});
      if (most + (most - least) <= threshold) return;
      const auto guess = Quartic::through(f).shifted(sign, sign * threshold).first_positive(1e-3);
      if (!guess) return;
      double x = *guess;
      for (int i = 0; i < 6; ++i) {
        const double slope = sign * lag.slope(x);
        if (!(slope > 0)) break;
        const double next = std::clamp(x - (sign * lag.at(x) - threshold) / slope, 0.0, 1.0);
        const double change = std::abs(next - x);
        x = next;
        if (change <= 1e-9) break;  // the next one would change 1e-18
      }
      if (!first || x < first->x) first = Crossing{x, c, output};
    };
    const int output = hold.outputs[c];
    if (output != 0) {
      consider(-output, -pwpf.off, 0);
    } else {
      consider(1, pwpf.on, 1);
      if (loop.channels()[c].is_signed) consider(-1, pwpf.on, -1);
    }
  }
  return first;
}

}  // namespace slew
