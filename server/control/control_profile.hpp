// Smooth control histories over the maneuver's time t in [0, 1], written once over the scalar (Vadali, Singh
// & Carter 1993, Eqs. 7-9, 16). Parameters are one list:
//   smooth_switches: amplitudes a_i in [-1, 1], then the switches p_ij control by control, then the alpha_i,
//                    then T_R:   u_i = a_i m1(t) 2/pi atan(prod_j (p_ij - t) / alpha_i)
//   impulses:        peaks of the first bumps a_i, of the last b_i, then the t1_i:
//                    u_i = a_i m2(t / t1_i) + b_i m2((t + 2 t1_i - 1) / t1_i)
// A switch at 0 reverses the sign of what follows. Amplitudes are parts of the control's bounds.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace slew {

/// What a family of control histories leaves to be chosen: see below.
enum class ProfileFamily {
  on_off,           ///< least, zero or most control, or throttled along singular arcs: what is time-optimal
  smooth_switches,  ///< arctangents for switches, rounded at both ends (Eqs. 7, 8, 16)
  impulses          ///< thrust, coast, thrust (Eq. 9)
};

/// m1: rises over [0, T_R] and falls over [1 - T_R, 1] (Eq. 7).
template <typename Scalar>
Scalar rise_and_fall(double t, const Scalar& rise) {
  const double edge = t < 0.5 ? t : 1 - t;
  const Scalar part = edge / rise;
  if (!(part < Scalar(1))) return Scalar(1);
  return part * part * (3 - 2 * part);
}

/// One bump of m2 (Eq. 9): 0 at x = 0, 1 at x = 1, 0 at x = 2. Its last bump is printed with a minus, which
/// the signs of the peaks hold here.
template <typename Scalar>
Scalar bump(const Scalar& x) {
  if (!(x > Scalar(0)) || !(x < Scalar(2))) return Scalar(0);
  if (x < Scalar(1)) return x * x * (3 - 2 * x);
  const Scalar y = 2 - x;
  return y * y * (2 * x - 1);
}

template <typename Scalar>
Scalar smooth_control(double t, const Scalar& amplitude, std::span<const Scalar> switches,
                      const Scalar& smoothness, const Scalar& rise) {
  using std::atan;
  Scalar product = 1 / smoothness;
  for (const Scalar& at : switches) product = product * (at - t);
  return amplitude * rise_and_fall(t, rise) * (2 / std::numbers::pi * atan(product));
}

template <typename Scalar>
Scalar impulse_control(double t, const Scalar& first, const Scalar& last, const Scalar& t1) {
  return first * bump<Scalar>(t / t1) + last * bump<Scalar>((t + 2 * t1 - 1) / t1);
}

/// Where the parameters of a family stand in its list.
struct ProfileLayout {
  ProfileFamily family = ProfileFamily::smooth_switches;
  std::size_t controls = 3;
  std::vector<int> switches;

  std::size_t switch_count() const {
    std::size_t count = 0;
    for (const int n : switches) count += static_cast<std::size_t>(n);
    return count;
  }
  std::size_t size() const {
    return family == ProfileFamily::impulses ? 3 * controls : 2 * controls + switch_count() + 1;
  }
  std::size_t amplitude(std::size_t i) const { return i; }
  std::size_t first_switch(std::size_t i) const {
    std::size_t at = controls;
    for (std::size_t k = 0; k < i; ++k) at += static_cast<std::size_t>(switches[k]);
    return at;
  }
  std::size_t smoothness(std::size_t i) const { return controls + switch_count() + i; }
  std::size_t rise() const { return 2 * controls + switch_count(); }
  std::size_t last_peak(std::size_t i) const { return controls + i; }
  std::size_t t1(std::size_t i) const { return 2 * controls + i; }
};

/// u_i at t, as a part of its bounds.
double profile_control(const ProfileLayout& layout, std::span<const double> parameters, std::size_t i,
                       double t);

/// u_i and what it changes by with each of its own parameters: those stand in the list at `own_parameters`.
struct ControlSlope {
  double control;
  std::array<double, 8> slope;
};
struct OwnParameters {
  std::array<std::size_t, 8> places{};
  std::size_t count = 0;

  void add(std::size_t place) { places[count++] = place; }
  std::size_t size() const { return count; }
  const std::size_t* begin() const { return places.data(); }
  const std::size_t* end() const { return places.data() + count; }
  std::size_t operator[](std::size_t k) const { return places[k]; }
};
OwnParameters own_parameters(const ProfileLayout& layout, std::size_t i);
ControlSlope profile_slope(const ProfileLayout& layout, std::span<const double> parameters, std::size_t i,
                           double t);

/// Times between which the controls are smooth, with so many in between that a step of order 8 follows them.
std::vector<double> profile_grid(const ProfileLayout& layout, std::span<const double> parameters);

}  // namespace slew
