// What a linear loop is (Bryson 1994, section 3.2): compensator, closed loop, gains that are stable, margins.
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/control/frequency_response.hpp"
#include "server/control/root_locus.hpp"
#include "server/experiment/description.hpp"
#include "server/experiment/shaper_request.hpp"

namespace slew {
namespace {

using nlohmann::json;
using Complex = std::complex<double>;

// [real part, imaginary part], as a plant's poles are told.
json complex(Complex value) {
  return json::array({value.real(), value.imag()});
}

json complex(const std::vector<Complex>& values) {
  json list = json::array();
  for (const Complex value : values) list.push_back(complex(value));
  return list;
}

// Infinity is no number in JSON.
json finite(double value) {
  return std::isfinite(value) ? json(value) : json(nullptr);
}

json optional(const std::optional<double>& value) {
  return value ? json(*value) : json(nullptr);
}

json law_document(const LinearFeedback& feedback) {
  json document = {{"loop_gain", feedback.loop_gain}};
  if (const auto* lead = std::get_if<LeadCompensation>(&feedback.law)) {
    document["type"] = "lead_compensation";
    document["gain_N_m_rad"] = lead->gain_N_m_rad;
    document["zero_rad_s"] = lead->zero_rad_s;
    document["pole_rad_s"] = lead->pole_rad_s;
  } else {
    const auto& law = std::get<AttitudeRateFeedback>(feedback.law);
    document["type"] = "attitude_rate_feedback";
    document["attitude_gain_N_m_rad"] = law.attitude_gain_N_m_rad;
    document["rate_gain_N_m_s_rad"] = law.rate_gain_N_m_s_rad;
  }
  return document;
}

// Of the rigid axis with attitude and rate sensed, and k_0 = 1: what the gains were chosen for.
json regulator_document(const LinearAxisSpecification& spec) {
  const auto* law = std::get_if<AttitudeRateFeedback>(&spec.feedback.law);
  if (!law) return nullptr;
  const double inertia = spec.plant.inertia_kg_m2;
  return {{"poles_rad_s", complex(roots(regulator_polynomial(*law, inertia)))},
          {"attitude_gain_per_inertia_1_s2", law->attitude_gain_N_m_rad / inertia},
          {"rate_gain_per_inertia_1_s", law->rate_gain_N_m_s_rad / inertia}};
}

json estimator_document(const AngleEstimator& estimator) {
  json document = {{"type", "none"}};
  if (const auto* second = std::get_if<SecondOrderAngleEstimator>(&estimator))
    document = {{"type", "second_order_angle"},
                {"rate_gain_1_s2", second->rate_gain_1_s2},
                {"attitude_gain_1_s", second->attitude_gain_1_s},
                {"inertia_kg_m2", second->inertia_kg_m2}};
  if (const auto* first = std::get_if<FirstOrderAngleEstimator>(&estimator))
    document = {{"type", "first_order_angle"},
                {"gain_1_s", first->gain_1_s},
                {"inertia_kg_m2", first->inertia_kg_m2}};
  document["error_poles_rad_s"] = complex(roots(error_polynomial(estimator)));
  return document;
}

// Q(s)/z(s), with k_0: in N m/rad, and per inertia as the problems print it.
json compensator_document(const ControlLoop& loop) {
  const Compensator& compensator = loop.compensator();
  Polynomial numerator = compensator.of_angle.numerator;
  for (double& coefficient : numerator) coefficient *= compensator.loop_gain;
  Polynomial per_inertia = numerator;
  for (double& coefficient : per_inertia) coefficient /= loop.plant().inertia_kg_m2;
  return {{"numerator_N_m_rad", numerator},
          {"numerator_per_inertia", per_inertia},
          {"denominator", compensator.of_angle.denominator},
          {"zeros_rad_s", complex(roots(numerator))},
          {"poles_rad_s", complex(roots(compensator.of_angle.denominator))}};
}

json closed_loop_document(const ControlLoop& loop) {
  const double gain = loop.compensator().loop_gain;
  const auto poles = loop.poles(gain);
  json frequencies = json::array(), ratios = json::array();
  for (const Complex pole : poles) {
    frequencies.push_back(std::abs(pole));
    ratios.push_back(damping_ratio(pole));
  }
  const Polynomial polynomial = loop.characteristic_polynomial(gain);
  return {{"is_stable", is_stable(poles)},
          {"poles_rad_s", complex(poles)},
          {"natural_frequencies_rad_s", std::move(frequencies)},
          {"damping_ratios", std::move(ratios)},
          {"characteristic_polynomial", polynomial.empty() ? json(nullptr) : json(polynomial)}};
}

json range_document(const ControlLoop& loop) {
  json list = json::array();
  for (const StableGains& range : stable_gains(loop))
    list.push_back({{"from", range.from},
                    {"to", finite(range.to)},
                    {"from_crossing_rad_s", optional(range.from_crossing_rad_s)},
                    {"to_crossing_rad_s", optional(range.to_crossing_rad_s)}});
  return list;
}

json margins_document(const ControlLoop& loop) {
  const double gain = loop.compensator().loop_gain;
  json gains = json::array(), phases = json::array();
  for (const PhaseCrossover& crossover : phase_crossovers(loop))
    gains.push_back({{"frequency_rad_s", crossover.frequency_rad_s},
                     {"gain_margin", crossover.loop_gain / gain},
                     {"gain_margin_dB", 20 * std::log10(crossover.loop_gain / gain)}});
  for (const GainCrossover& crossover : gain_crossovers(loop, gain))
    phases.push_back(
        {{"frequency_rad_s", crossover.frequency_rad_s}, {"phase_margin_deg", crossover.phase_margin_deg}});
  return {{"phase_crossovers", std::move(gains)}, {"gain_crossovers", std::move(phases)}};
}

json bode_document(const ControlLoop& loop, double gain) {
  json frequencies = json::array(), magnitudes = json::array(), phases = json::array();
  for (const BodePoint& point : bode(loop, gain, bode_grid(loop, gain))) {
    frequencies.push_back(point.frequency_rad_s);
    magnitudes.push_back(finite(point.magnitude_dB));
    phases.push_back(point.phase_deg);
  }
  return {{"frequency_rad_s", std::move(frequencies)},
          {"magnitude_dB", std::move(magnitudes)},
          {"phase_deg", std::move(phases)}};
}

// What the locus is about: the poles that the rigid body and the compensator make of the loop, not modes far
// above them.
double radius_of(const ControlLoop& loop, double gain) {
  double radius = 0;
  for (const Complex root : roots(loop.compensator().of_angle.denominator))
    radius = std::max(radius, std::abs(root));
  for (const Complex root : roots(loop.compensator().of_angle.numerator))
    radius = std::max(radius, std::abs(root));
  for (const GainCrossover& crossover : gain_crossovers(loop, gain))
    radius = std::max(radius, crossover.frequency_rad_s);
  if (loop.plant().modes.empty())
    for (const Complex pole : loop.poles(gain)) radius = std::max(radius, std::abs(pole));
  return radius > 0 ? 1.5 * radius : 1;
}

}  // namespace

json system_document(const LinearAxisSpecification& spec) {
  const ControlLoop loop = control_loop(spec);
  json command = command_document(spec.shaper, vibrating_modes(spec), spec.impulses, 0);
  command["type"] = "angle";
  return {{"plant", plant_document(spec.plant)},
          {"law", law_document(spec.feedback)},
          {"regulator", regulator_document(spec)},
          {"estimator", estimator_document(spec.estimator)},
          {"compensator", compensator_document(loop)},
          {"closed_loop", closed_loop_document(loop)},
          {"command", std::move(command)},
          {"loop_gain_stability_range", range_document(loop)},
          {"margins", margins_document(loop)},
          {"size",
           {{"most_propagator_steps", propagator_steps(spec)},
            {"most_telemetry_samples", std::floor(spec.duration_s / spec.telemetry_period_s) + 2}}}};
}

json design_document(const LinearAxisSpecification& spec) {
  const ControlLoop loop = control_loop(spec);
  const double gain = spec.feedback.loop_gain, radius = radius_of(loop, gain);
  constexpr double kMostGain = 1000;
  const RootLocus locus = root_locus(loop, kMostGain * gain, radius);
  json branches = json::array();
  for (const auto& branch : locus.branches) branches.push_back(complex(branch));
  return {{"type", "linear"},
          {"radius_rad_s", radius},
          {"root_locus",
           {{"loop_gains", locus.gains},
            {"branches_rad_s", std::move(branches)},
            {"poles_rad_s", complex(loop.loop_poles())},
            {"zeros_rad_s", complex(loop.loop_zeros())}}},
          {"bode", bode_document(loop, gain)}};
}

}  // namespace slew
