// The two kinds of motion between switchings: a rigid axis on parabolas, a flexible one on its modes. What
// the loop and the metrics ask of an arc has one name in both.
#pragma once

#include <algorithm>
#include <complex>
#include <memory>
#include <span>
#include <vector>

#include "server/propagation/axis_events.hpp"
#include "server/propagation/constrained_arc.hpp"
#include "server/propagation/taylor_arc.hpp"
#include "server/simulation/axis.hpp"
#include "server/simulation/digest.hpp"

namespace slew {

/// A part of an arc on which the angle is monotone but for its end: what metrics are taken from.
class RigidPiece {
 public:
  RigidPiece(const QuadraticArc<double>& arc, double h) : arc_(arc), h_(h) {}

  double angle_at(double tau) const { return arc_.angle_at(tau); }
  AxisMotion begin() const { return {arc_.angle_rad, arc_.rate_rad_s, arc_.acceleration_rad_s2}; }
  AxisMotion end() const { return {arc_.angle_at(h_), arc_.rate_at(h_), arc_.acceleration_rad_s2}; }
  double peak_rate(double) const { return std::max(std::abs(arc_.rate_rad_s), std::abs(arc_.rate_at(h_))); }
  std::optional<double> rest() const { return rest_time(arc_, h_); }
  std::optional<double> reach(double angle_rad) const { return reach_time(arc_, angle_rad, h_); }
  /// Calls `each` with the times in (0, h) at which the angle is this.
  template <typename Function>
  void each_time_at(double angle_rad, Function&& each) const {
    const auto roots =
        quadratic_roots(arc_.angle_rad - angle_rad, arc_.rate_rad_s, 0.5 * arc_.acceleration_rad_s2);
    for (int i = 0; i < roots.count; ++i)
      if (const double tau = roots.tau[static_cast<std::size_t>(i)]; tau > 0 && tau < h_) each(tau);
  }

 private:
  const QuadraticArc<double>& arc_;
  const double h_;
};

/// The hub on a known path.
class PathPiece {
 public:
  PathPiece(const HubPath& path, double h) : path_(path), h_(h) {}

  double angle_at(double tau) const { return path_.angle_at(tau); }
  AxisMotion begin() const { return motion_at(0); }
  AxisMotion end() const { return motion_at(h_); }
  double peak_rate(double) const { return std::max(std::abs(path_.rate_rad_s), std::abs(path_.rate_at(h_))); }
  std::optional<double> rest() const { return rest_time(path_, h_); }
  std::optional<double> reach(double angle_rad) const {
    std::optional<double> reached;
    each_time_at(angle_rad, [&](double tau) { reached = std::min(tau, reached.value_or(tau)); });
    return reached;
  }
  template <typename Function>
  void each_time_at(double angle_rad, Function&& each) const {
    path_.each_time_at_angle(angle_rad, [&](double tau) {
      if (tau > 0 && tau < h_) each(tau);
    });
  }

 private:
  AxisMotion motion_at(double tau) const {
    return {path_.angle_at(tau), path_.rate_at(tau), path_.acceleration_at(tau)};
  }

  const HubPath& path_;
  const double h_;
};

template <typename Arc>
class SmoothPiece {
 public:
  /// [from, from + h] of the arc, at whose end the rate may be zero and nowhere else inside.
  SmoothPiece(const Arc& arc, double from, double h, bool ends_at_rest)
      : arc_(arc),
        from_(from),
        h_(h),
        ends_at_rest_(ends_at_rest),
        begin_(arc.at(from)),
        end_(arc.at(from + h)) {
    if (ends_at_rest) end_.rate_rad_s = 0;
  }
  /// What moves by no more than rounding stands still.
  void stand_still() { begin_.rate_rad_s = begin_.acceleration_rad_s2 = end_.rate_rad_s = 0; }

  double angle_at(double tau) const { return arc_.angle_at(from_ + tau); }
  AxisMotion begin() const { return begin_; }
  AxisMotion end() const { return end_; }
  /// The largest |rate|, or a number that is at least it and no larger than `record`.
  double peak_rate(double record) const {
    const double at_ends = std::max(std::abs(begin_.rate_rad_s), std::abs(end_.rate_rad_s));
    const double jerk = arc_.loose_jerk_bound(from_, from_ + h_);
    if (at_ends + 0.125 * jerk * h_ * h_ <= record || std::abs(begin_.acceleration_rad_s2) > jerk * h_)
      return at_ends;
    return searched_peak(at_ends);
  }
  std::optional<double> rest() const { return ends_at_rest_ ? std::optional(h_) : std::nullopt; }
  std::optional<double> reach(double angle_rad) const {
    std::optional<double> reached;
    if (angle_rad == end_.angle_rad) reached = h_;
    each_time_at(angle_rad, [&](double tau) { reached = tau; });
    return reached;
  }
  template <typename Function>
  void each_time_at(double angle_rad, Function&& each) const {
    // Monotone: once at most, and only between the ends.
    const double a = begin_.angle_rad - angle_rad, b = end_.angle_rad - angle_rad;
    if ((a < 0) == (b < 0) || a == 0 || b == 0) return;
    const double tau =
        passing_time(AngleScan<Arc>{arc_, angle_rad}, a < 0 ? 1 : -1, from_, from_ + h_) - from_;
    if (tau > 0 && tau < h_) each(tau);
  }

 private:
  double searched_peak(double at_ends) const;

  const Arc& arc_;
  const double from_;
  const double h_;
  const bool ends_at_rest_;
  AxisMotion begin_;
  AxisMotion end_;
};

using FlexiblePiece = SmoothPiece<ModalArc>;
using TaylorPiece = SmoothPiece<TaylorMotion>;

class RigidDynamics {
 public:
  using Arc = QuadraticArc<double>;

  explicit RigidDynamics(const OnOffAxisSpecification& spec) : spec_(spec) {}

  std::size_t modes() const { return 0; }
  Arc start() const { return {spec_.maneuver.initial_angle_rad, spec_.maneuver.initial_rate_rad_s, 0}; }
  void push(Arc& arc, double torque_N_m) const {
    arc.acceleration_rad_s2 = torque_N_m / spec_.plant.inertia_kg_m2;
  }
  void make_ready(Arc&, double) const {}
  void move(Arc& arc, double h) const {
    const double angle_rad = arc.angle_at(h);
    arc.rate_rad_s = arc.rate_at(h);
    arc.angle_rad = angle_rad;
  }
  AxisMotion at(const Arc& arc, double tau) const {
    return {arc.angle_at(tau), arc.rate_at(tau), arc.acceleration_rad_s2};
  }
  AxisMotion begin(const Arc& arc) const { return {arc.angle_rad, arc.rate_rad_s, arc.acceleration_rad_s2}; }
  std::optional<double> rest(const Arc& arc, double h) const { return rest_time(arc, h); }
  /// When a motion of the given sense ends: the rate is beyond zero by more than the rounding.
  std::optional<double> turn(const Arc& arc, int sense, double rounding_rad_s, double h) const {
    if (sense * arc.acceleration_rad_s2 >= 0) return std::nullopt;
    return rest_time(Arc{arc.angle_rad, arc.rate_rad_s + sense * rounding_rad_s, arc.acceleration_rad_s2}, h);
  }
  template <typename Function>
  void each_piece(const Arc& arc, double h, Function&& each) const {
    each(0.0, h, RigidPiece(arc, h));
  }
  /// The hub is taken off the arc onto a path, and let go again.
  void hold(const Arc&, const HubPath& path, ConstrainedArc& held) const { held.begin(path, {}, {}, {}); }
  void let_go(const ConstrainedArc& held, Arc& arc) const {
    arc.angle_rad = held.path().angle_rad;
    arc.rate_rad_s = held.path().rate_rad_s;
  }
  void digest(const Arc&, Digester&) const {}
  void digest(const ConstrainedArc&, Digester&) const {}
  std::vector<ModeVibration> vibration(const Arc&) const { return {}; }
  void elastic_row(const Arc&, double, std::span<double>) {}
  void elastic_row(const ConstrainedArc&, double, std::span<double>) {}

 private:
  const OnOffAxisSpecification& spec_;
};

/// Also of a rigid axis under sinusoidal disturbances.
class FlexibleDynamics {
 public:
  using Arc = ModalArc;

  explicit FlexibleDynamics(const OnOffAxisSpecification& spec)
      : spec_(spec),
        basis_(std::make_shared<const ModalBasis>(spec.plant, spec.disturbances.sinusoids)),
        scratch_(basis_->size()),
        q_(modes()),
        v_(modes()) {}

  std::size_t modes() const { return basis_->modes().size(); }
  Arc start() const {
    return {*basis_, spec_.maneuver.initial_angle_rad, spec_.maneuver.initial_rate_rad_s,
            spec_.disturbances.sinusoids};
  }
  void push(Arc& arc, double torque_N_m) const { arc.set_torque(torque_N_m); }
  void make_ready(Arc& arc, double h) const { arc.make_ready(h); }
  void move(Arc& arc, double h) const { arc.move(h); }
  AxisMotion at(const Arc& arc, double tau) const { return arc.at(tau); }
  AxisMotion begin(const Arc& arc) const { return arc.begin(); }
  std::optional<double> rest(const Arc& arc, double h) const { return next_rest(arc, 0, h); }
  std::optional<double> turn(const Arc& arc, int sense, double rounding_rad_s, double h) const {
    const double rounding = rounding_rad_s > 0 ? rounding_rad_s + arc.rate_rounding_rad_s() : 0;
    return first_crossing(RateScan<Arc>{arc, -sense * rounding}, -sense, 0, h, 1e-13 * h);
  }
  /// Parts at whose ends the rate changes its sign.
  template <typename Function>
  void each_piece(const Arc& arc, double h, Function&& each) const {
    double from = 0;
    while (const auto tau = next_rest(arc, from, h)) {
      if (*tau >= h) break;
      each(from, *tau - from, FlexiblePiece(arc, from, *tau - from, true));
      from = *tau;
    }
    each(from, h - from, FlexiblePiece(arc, from, h - from, false));
  }
  void digest(const Arc& arc, Digester& digester) const {
    for (const auto& c : arc.coordinates()) {
      digester.real(c.real());
      digester.real(c.imag());
    }
  }
  void hold(const Arc& arc, const HubPath& path, ConstrainedArc& held) {
    arc.deflection_at(0, scratch_, q_, v_);
    held.begin(path, q_, v_, arc.sinusoids());
  }
  void let_go(const ConstrainedArc& held, Arc& arc) {
    held.deflection_at(0, q_, v_);
    const auto z = std::span(scratch_).first(basis_->sinusoids());
    held.sinusoids_at(0, z);
    arc.begin_anew(held.path().angle_rad, held.path().rate_rad_s, q_, v_, z);
  }
  void digest(const ConstrainedArc& held, Digester& digester) {
    held.deflection_at(0, q_, v_);
    for (const double q : q_) digester.real(q);
    for (const double v : v_) digester.real(v);
  }
  /// Of the angle in each mode with the hub free, about where the torque of the moment holds it.
  std::vector<ModeVibration> vibration(const Arc& arc) const {
    std::vector<ModeVibration> modes;
    for (std::size_t k = 0; k + basis_->sinusoids() < basis_->size(); ++k) {
      const std::complex<double> lambda = basis_->lambda()[k];
      if (lambda.imag() == 0) continue;
      const auto from_rest = arc.coordinates()[k] - basis_->rest()[k] * arc.torque_N_m();
      modes.push_back({std::abs(lambda), -lambda.real() / std::abs(lambda),
                       std::abs(basis_->p_weights()[k] * from_rest) / basis_->inertia_kg_m2()});
    }
    return modes;
  }
  /// Momentum, then q, then q'.
  void elastic_row(const Arc& arc, double tau, std::span<double> row) {
    if (row.empty()) return;
    row[0] = arc.momentum_at(tau);
    arc.deflection_at(tau, scratch_, row.subspan(1, modes()), row.subspan(1 + modes(), modes()));
  }
  void elastic_row(const ConstrainedArc& held, double tau, std::span<double> row) {
    if (row.empty()) return;
    row[0] = held.momentum_at(tau);
    held.deflection_at(tau, row.subspan(1, modes()), row.subspan(1 + modes(), modes()));
  }

 private:
  const OnOffAxisSpecification& spec_;
  std::shared_ptr<const ModalBasis> basis_;
  std::vector<std::complex<double>> scratch_;
  std::vector<double> q_, v_;
};

}  // namespace slew
