#include "server/control/control_profile.hpp"

#include <algorithm>

#include "server/attitude/dual.hpp"

namespace slew {

namespace {

using ControlDual = Dual<8>;
constexpr std::size_t kMostSwitches = 4;

template <typename Scalar>
Scalar control(const ProfileLayout& layout, std::span<const Scalar> own, double t) {
  if (layout.family == ProfileFamily::impulses) return impulse_control<Scalar>(t, own[0], own[1], own[2]);
  const std::size_t switches = own.size() - 3;
  return smooth_control<Scalar>(t, own[0], own.subspan(1, switches), own[1 + switches], own[2 + switches]);
}

}  // namespace

OwnParameters own_parameters(const ProfileLayout& layout, std::size_t i) {
  OwnParameters own;
  if (layout.family == ProfileFamily::impulses) {
    for (const std::size_t place : {layout.amplitude(i), layout.last_peak(i), layout.t1(i)}) own.add(place);
    return own;
  }
  own.add(layout.amplitude(i));
  for (std::size_t j = 0; j < static_cast<std::size_t>(layout.switches[i]); ++j)
    own.add(layout.first_switch(i) + j);
  own.add(layout.smoothness(i));
  own.add(layout.rise());
  return own;
}

double profile_control(const ProfileLayout& layout, std::span<const double> parameters, std::size_t i,
                       double t) {
  std::array<double, kMostSwitches + 3> own{};
  const auto from = own_parameters(layout, i);
  for (std::size_t k = 0; k < from.size(); ++k) own[k] = parameters[from[k]];
  return control<double>(layout, std::span<const double>(own.data(), from.size()), t);
}

ControlSlope profile_slope(const ProfileLayout& layout, std::span<const double> parameters, std::size_t i,
                           double t) {
  std::array<ControlDual, kMostSwitches + 3> own;
  const auto from = own_parameters(layout, i);
  for (std::size_t k = 0; k < from.size(); ++k)
    own[k] = ControlDual::variable(parameters[from[k]], static_cast<int>(k));
  const ControlDual u =
      control<ControlDual>(layout, std::span<const ControlDual>(own.data(), from.size()), t);
  ControlSlope slope;
  slope.control = u.value;
  for (std::size_t k = 0; k < 8; ++k) slope.slope[k] = u.gradient[static_cast<Eigen::Index>(k)];
  return slope;
}

std::vector<double> profile_grid(const ProfileLayout& layout, std::span<const double> parameters) {
  // An arctangent's nearest poles are delta beside a switch: steps grow with the distance from them.
  struct Steep {
    double at, delta;
  };
  std::vector<Steep> steep;
  std::vector<double> breaks = {0, 0.5, 1};
  for (std::size_t i = 0; i < layout.controls; ++i) {
    if (layout.family == ProfileFamily::impulses) {
      const double t1 = parameters[layout.t1(i)];
      breaks.insert(breaks.end(), {t1, 2 * t1, 1 - 2 * t1, 1 - t1});
      continue;
    }
    const double alpha = parameters[layout.smoothness(i)];
    const auto count = static_cast<std::size_t>(layout.switches[i]);
    for (std::size_t j = 0; j < count; ++j) {
      const double at = parameters[layout.first_switch(i) + j];
      double apart = 1;
      for (std::size_t k = 0; k < count; ++k)
        if (k != j) apart *= std::abs(parameters[layout.first_switch(i) + k] - at);
      steep.push_back({at, std::min(alpha / std::max(apart, 1e-12), std::sqrt(alpha))});
      breaks.push_back(at);
    }
  }
  if (layout.family == ProfileFamily::smooth_switches) {
    const double rise = parameters[layout.rise()];
    breaks.insert(breaks.end(), {rise, 1 - rise});
  }
  std::erase_if(breaks, [](double t) { return !(t >= 0 && t <= 1); });
  std::sort(breaks.begin(), breaks.end());
  const auto longest = [&](double t) {
    double h = 1.0 / 32;
    for (const Steep& s : steep) h = std::min(h, 0.4 * std::hypot(t - s.at, s.delta));
    return h;
  };
  std::vector<double> grid = {0};
  for (std::size_t b = 1; b < breaks.size(); ++b) {
    const double from = breaks[b - 1], length = breaks[b] - from;
    if (length < 1e-12) continue;
    std::vector<double> inside;
    double t = from;
    while (t < breaks[b]) {
      double h = longest(t);
      h = 0.5 * (h + longest(std::min(t + h, breaks[b])));
      t += h;
      inside.push_back(t);
    }
    const double fit = length / (inside.back() - from);
    for (const double at : inside) grid.push_back(from + fit * (at - from));
    grid.back() = breaks[b];
  }
  return grid;
}

}  // namespace slew
