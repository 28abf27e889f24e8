// Every law on every plant through every actuator, in every evaluation. What fits is flown for a short slew:
// its momentum is the integral of the torque to 1e-9, and SUNDIALS ends where it ends. What does not fit is
// refused with a sentence. The tables of what fits are fits_one_axis and fits_three_axes.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "server/attitude/mrp.hpp"
#include "server/experiment/experiment.hpp"
#include "tests/unit/single_axis_cases.hpp"

namespace slew {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

// ---- the words that can be combined

const std::map<std::string, json> kPlants{
    {"rigid_axis", {{"type", "rigid_axis"}, {"inertia_kg_m2", 2.0}}},
    {"flexible_axis",
     {{"type", "flexible_axis"},
      {"inertia_kg_m2", 2.0},
      {"modes", {{{"frequency_hz", 0.7}, {"damping_ratio", 0.01}, {"coupling_sqrt_kg_m", 0.6}}}}}},
    {"body", {{"type", "rigid_body"}, {"inertia_kg_m2", {{3, 0.2, -0.1}, {0.2, 2.5, 0.3}, {-0.1, 0.3, 2}}}}},
    {"body, Euler parameters",
     {{"type", "rigid_body"}, {"inertia_kg_m2", {2, 2.5, 3}}, {"attitude", "euler_parameters"}}},
    {"body, shadow set",
     {{"type", "rigid_body"}, {"inertia_kg_m2", {2, 2.5, 3}}, {"shadow_switch_norm", 1.001}}}};

bool has_three_axes(const std::string& plant) {
  return plant.starts_with("body");
}

const std::map<std::string, json> kLaws{
    {"switching_function", {{"gamma_bar", 1.3}, {"deadband", {{"type", "single_sided"}, {"width_deg", 2}}}}},
    {"linear_switching_function",
     {{"rate_gain_s", 1.2}, {"deadband", {{"type", "double_sided"}, {"width_deg", 1}}}}},
    {"schmitt_trigger", {{"rate_gain_s", 1.2}, {"on_deg", 2}, {"off_deg", 1}}},
    {"firing_program", {{"firings", {{{"from_s", 0.2}, {"to_s", 0.9}, {"direction", 1}}}}}},
    {"attitude_rate_feedback", {{"attitude_gain_N_m_rad", 1.5}, {"rate_gain_N_m_s_rad", 2}}},
    {"lead_compensation", {{"gain_N_m_rad", 3}, {"zero_rad_s", 0.5}, {"pole_rad_s", 4}}},
    {"sliding_mode",
     {{"lambda_1_s", {-0.6, -0.7, -0.8}}, {"gain_rad_s2", {0.3, 0.3, 0.3}}, {"boundary_layer_rad_s", 0.2}}},
    {"linear_surface",
     {{"slope_1_s", {0.5, 0.5, 0.6}}, {"gain_N_m", {0.8, 0.8, 0.8}}, {"boundary_layer_rad_s", 0.2}}},
    {"quaternion_feedback", {{"attitude_gain_1_s2", 0.8}, {"rate_gain_1_s", 1.0}}},
    {"rate_damping", {{"damping_N_m_s", {1, 1.2, 1.4}}}},
    {"torque_program",
     {{"initial_torque_N_m", {0.5, -0.5, 0.5}},
      {"switch_times_x_s", {0.7}},
      {"switch_times_z_s", {0.3, 1.1}},
      {"end_s", 1.6}}},
    {"planned_torque", json::object()}};

const std::set<std::string> kOnOffLaws{"switching_function", "linear_switching_function", "schmitt_trigger"};
const std::set<std::string> kLinearLaws{"attitude_rate_feedback", "lead_compensation"};
const std::set<std::string> kAttitudeLaws{"sliding_mode", "linear_surface", "quaternion_feedback",
                                          "rate_damping"};

json twelve_thrusters() {
  // Three pairs of couples: each axis is turned by two thrusters that push against each other.
  json thrusters = json::array();
  for (int axis = 0; axis < 3; ++axis)
    for (const int turn : {1, -1})
      for (const int side : {1, -1}) {
        Vector3d position = Vector3d::Zero(), direction = Vector3d::Zero();
        position[(axis + 1) % 3] = side;
        direction[(axis + 2) % 3] = side * turn;
        thrusters.push_back({{"position_m", {position[0], position[1], position[2]}},
                             {"direction", {direction[0], direction[1], direction[2]}},
                             {"thrust_N", 0.5}});
      }
  return thrusters;
}

const json kSkew = {{0.5, 0.5, 0}, {-0.3, 0.3, 0}, {-0.3, -0.3, 0.6}};

std::map<std::string, json> actuators() {
  const std::map<std::string, json> modulators{
      {"PWPF", {{"type", "pwpf"}, {"gain", 6}, {"time_constant_s", 0.3}, {"on", 0.45}, {"off", 0.2}}},
      {"Schmitt trigger", {{"type", "schmitt_trigger"}, {"on", 0.5}, {"off", 0.2}}},
      {"pulse width", {{"type", "pulse_width"}, {"minimum_on_time_s", 0.01}}}};
  std::map<std::string, json> all{
      {"on_off_pair", {{"type", "on_off_pair"}, {"torque_N_m", 1}, {"minimum_on_time_s", 0.02}}},
      {"on_off_pair, no minimum", {{"type", "on_off_pair"}, {"torque_N_m", 1}}},
      {"proportional", {{"type", "proportional"}}},
      {"ideal torque", {{"type", "ideal_torque"}}},
      {"ideal torque, limited", {{"type", "ideal_torque"}, {"maximum_torque_N_m", {0.4, 0.5, 0.6}}}},
      {"ideal torque, skew",
       {{"type", "ideal_torque"}, {"influence_N_m", kSkew}, {"gas_flow_m3_s", {1, 2, 3}}}}};
  for (const auto& [name, modulator] : modulators) {
    all["thruster couples, " + name] = {
        {"type", "thruster_couples"}, {"influence_N_m", kSkew}, {"modulator", modulator}};
    all["axis thrusters, " + name] = {
        {"type", "axis_thrusters"}, {"torque_N_m", {1, 1, 1}}, {"modulator", modulator}};
    for (const char* allocation : {"non_negative_least_squares", "linear_programme"})
      all["thruster set by " + std::string(allocation) + ", " + name] = {
          {"type", "thruster_set"},
          {"thrusters", twelve_thrusters()},
          {"allocation", {{"type", allocation}}},
          {"modulator", modulator}};
  }
  return all;
}

// "" is for what is not evaluated: programs, and linear laws, which act at every instant.
const std::vector<std::string> kEvaluations{"", "sampled", "continuous", "ideal"};

// ---- the tables

bool fits_one_axis(const std::string& law, const std::string& actuator, const std::string& evaluation) {
  if (kLinearLaws.contains(law)) return actuator == "proportional" && evaluation.empty();
  if (law == "firing_program") return actuator.starts_with("on_off_pair") && evaluation.empty();
  if (!kOnOffLaws.contains(law) || evaluation.empty()) return false;
  if (actuator == "on_off_pair") return evaluation != "ideal";
  if (actuator != "on_off_pair, no minimum") return false;
  // Something must regularise what is evaluated continuously; a Schmitt trigger does, and is never ideal.
  if (law == "schmitt_trigger") return evaluation != "ideal";
  return evaluation != "continuous";
}

bool fits_three_axes(const std::string& law, const std::string& actuator, const std::string& evaluation) {
  if (!actuator.starts_with("ideal torque") && !actuator.starts_with("axis thrusters") &&
      !actuator.starts_with("thruster couples") && !actuator.starts_with("thruster set"))
    return false;
  const bool is_pulse_width = actuator.ends_with("pulse width");
  // Nothing can be planned where torque has no limit.
  if (law == "planned_torque") return evaluation.empty() && !is_pulse_width && actuator != "ideal torque";
  if (law == "torque_program") return evaluation.empty() && !is_pulse_width;
  if (!kAttitudeLaws.contains(law)) return false;
  return evaluation == "sampled" || (evaluation == "continuous" && !is_pulse_width);
}

// ---- a request of it

json request_of(const std::string& plant, const std::string& law, const std::string& actuator,
                const std::string& evaluation) {
  static const auto all_actuators = actuators();
  json controller = kLaws.at(law);
  controller["type"] = law;
  if (!evaluation.empty()) {
    controller["evaluation"] = {{"type", evaluation}};
    if (evaluation == "sampled") controller["evaluation"]["period_s"] = 0.05;
  }
  json maneuver = {{"type", "single_axis"}, {"final_angle_deg", 20}};
  if (has_three_axes(plant))
    maneuver = {{"type", "three_axis"},
                {"initial_attitude", {{"type", "rotation"}, {"axis", {1, -2, 3}}, {"angle_deg", 170}}},
                {"initial_rate_deg_s", {6, -9, 12}}};
  json request = {{"plant", kPlants.at(plant)},
                  {"maneuver", maneuver},
                  {"controller", controller},
                  {"actuator", all_actuators.at(actuator)},
                  {"simulation", {{"duration_s", 2}, {"verification_relative_tolerance", 1e-12}}},
                  {"telemetry", {{"sample_period_s", 1}}}};
  if (law == "planned_torque") {
    const std::size_t controls = actuator.starts_with("thruster set") ? 12 : 3;
    request["guidance"] = {{"type", "given_controls"}, {"time_s", 1.5}, {"controls", {{"type", "on_off"}}}};
    for (std::size_t i = 0; i < controls; ++i) {
      const double first_s = 0.1 + 0.04 * static_cast<double>(i);
      request["guidance"]["controls"]["sequences"].push_back(i % 2 == 0 ? json{1, 0, -1} : json{-1, 0, 1});
      request["guidance"]["controls"]["switch_times_s"].push_back({first_s, 2 * first_s});
    }
  }
  return request;
}

// ---- momentum

struct Column {
  std::size_t at;
};

/// What momentum and torque are made of in one row of outputs.
class Balance {
 public:
  Balance(const json& plant, const ChannelTable& channels)
      : is_body_(plant.at("type") == "rigid_body"),
        momentum_(column(channels.state, "momentum_N_m_s")),
        rate_(column(channels.state, is_body_ ? "rate_1_rad_s" : "rate_rad_s").value()),
        torque_(column(channels.thrusters, is_body_ ? "torque_1_N_m" : "torque_N_m").value()) {
    const json& inertia = plant.at("inertia_kg_m2");
    for (int i = 0; i < 3 && is_body_; ++i)
      for (int k = 0; k < 3; ++k)
        inertia_(i, k) = inertia[i].is_array() ? inertia[i][k].get<double>()
                         : i == k              ? inertia[i].get<double>()
                                               : 0;
    if (!is_body_) inertia_(0, 0) = inertia;
  }

  Vector3d momentum(const OutputRow& row) const {
    if (!is_body_) return {momentum_ ? row.state[*momentum_] : inertia_(0, 0) * row.state[rate_], 0, 0};
    return inertial(row, inertia_ * Eigen::Map<const Vector3d>(&row.state[rate_]));
  }
  Vector3d torque(const OutputRow& row) const {
    if (!is_body_) return {row.thrusters[torque_], 0, 0};
    return inertial(row, Eigen::Map<const Vector3d>(&row.thrusters[torque_]));
  }

 private:
  static std::optional<std::size_t> column(const std::vector<Channel>& channels, const std::string& name) {
    for (std::size_t i = 0; i < channels.size(); ++i)
      if (channels[i].name == name) return i;
    return std::nullopt;
  }
  // v + 2 q0 (q x v) + 2 q x (q x v): out of the body's axes.
  static Vector3d inertial(const OutputRow& row, const Vector3d& v) {
    const Eigen::Map<const Vector3d> p(row.state.data());
    const double sum = 1 + p.squaredNorm();
    const Vector3d q = 2 / sum * p;
    const double q0 = (2 - sum) / sum;
    return v + 2 * q0 * q.cross(v) + 2 * q.cross(q.cross(v));
  }

  bool is_body_;
  std::optional<std::size_t> momentum_;
  std::size_t rate_, torque_;
  Eigen::Matrix3d inertia_ = Eigen::Matrix3d::Zero();
};

std::vector<OutputRow> rows_at(const Prepared& prepared, const std::vector<double>& times_s) {
  Prepared copy = prepared;
  std::visit([&](auto& spec) { spec.output_times_s = times_s; }, copy.system);
  return test::fly(*make_run(copy)).outputs;
}

/// Integral of the torque over [0, end] by Gauss's rule, in pieces that are halved until they no longer
/// differ.
Vector3d impulse(const Prepared& prepared, const Balance& balance, std::vector<double> breaks) {
  constexpr std::array<double, 5> kX{-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831,
                                     0.9061798459386640};
  constexpr std::array<double, 5> kW{0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                     0.4786286704993665, 0.2369268850561891};
  struct Piece {
    double from, to;
    Vector3d value;
  };
  const auto evaluate = [&](std::vector<Piece>& pieces) {
    std::vector<double> times;
    for (const Piece& piece : pieces)
      for (const double x : kX) times.push_back(0.5 * (piece.from + piece.to + x * (piece.to - piece.from)));
    const auto rows = rows_at(prepared, times);
    ASSERT_EQ(rows.size(), times.size());
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      pieces[i].value.setZero();
      for (std::size_t k = 0; k < 5; ++k)
        pieces[i].value += 0.5 * (pieces[i].to - pieces[i].from) * kW[k] * balance.torque(rows[5 * i + k]);
    }
  };
  std::vector<Piece> open;
  for (std::size_t i = 0; i + 1 < breaks.size(); ++i)
    if (breaks[i + 1] > breaks[i]) open.push_back({breaks[i], breaks[i + 1], {}});
  evaluate(open);
  Vector3d sum = Vector3d::Zero();
  for (int depth = 0; depth < 24 && !open.empty(); ++depth) {
    std::vector<Piece> halves;
    for (const Piece& piece : open) {
      const double middle = 0.5 * (piece.from + piece.to);
      halves.push_back({piece.from, middle, {}});
      halves.push_back({middle, piece.to, {}});
    }
    evaluate(halves);
    std::vector<Piece> next;
    for (std::size_t i = 0; i < open.size(); ++i) {
      const Vector3d both = halves[2 * i].value + halves[2 * i + 1].value;
      if ((both - open[i].value).norm() < 1e-13) {
        sum += both;
      } else {
        next.push_back(halves[2 * i]);
        next.push_back(halves[2 * i + 1]);
      }
    }
    open = std::move(next);
  }
  for (const Piece& piece : open) sum += piece.value;
  return sum;
}

void check_flight(const json& request, const Prepared& prepared) {
  const auto run = make_run(prepared);
  const Balance balance(request.at("plant"), run->channels());
  const RunReport report = test::fly(*run);
  ASSERT_FALSE(report.failure.has_value()) << report.failure->sentence;
  const double end_s = report.metrics.end_time_s;

  std::vector<double> breaks{0, end_s};
  for (const SwitchEvent& event : report.events) breaks.push_back(event.t_s);
  // A corner of a law that acts at every instant hides between a piece's last place and its end.
  const bool has_corners = report.propagator.name == "dormand_prince_5_4" && report.events.empty();
  const double piece_s = has_corners ? 5e-4 : 0.05;
  for (int i = 0; i * piece_s < end_s; ++i) breaks.push_back(i * piece_s);
  std::sort(breaks.begin(), breaks.end());
  const auto ends = rows_at(prepared, {0, end_s});
  ASSERT_EQ(ends.size(), 2u);
  const Vector3d gained = balance.momentum(ends[1]) - balance.momentum(ends[0]);
  const double scale = std::max(balance.momentum(ends[0]).norm(), 1.0);
  EXPECT_LT((gained - impulse(prepared, balance, breaks)).norm(), 1e-9 * scale);

  const auto verification = make_verification(prepared);
  const Verification difference = compare(report, test::fly(*verification));
  EXPECT_TRUE(difference.same_event_sequence);
  for (std::size_t i = 0; i < difference.final_state_difference.size(); ++i)
    EXPECT_NEAR(difference.final_state_difference[i], 0, 1e-7) << run->channels().state[i].name;
}

class Combination : public testing::TestWithParam<std::string> {};

TEST_P(Combination, flies_or_is_refused) {
  const std::string& plant = GetParam();
  int flown = 0, refused = 0;
  for (const auto& [law, unused_parameters] : kLaws)
    for (const auto& [actuator, unused_block] : actuators())
      for (const std::string& evaluation : kEvaluations) {
        SCOPED_TRACE(plant + " | " + law + " | " + actuator + " | " + evaluation);
        const json request = request_of(plant, law, actuator, evaluation);
        const auto prepared = prepare(request.dump());
        const bool fits = has_three_axes(plant) ? fits_three_axes(law, actuator, evaluation)
                                                : fits_one_axis(law, actuator, evaluation);
        if (const auto* rejection = std::get_if<Rejection>(&prepared)) {
          EXPECT_FALSE(fits) << rejection->sentence;
          ASSERT_FALSE(rejection->violations.empty());
          for (const Violation& violation : rejection->violations) {
            EXPECT_TRUE(violation.pointer.starts_with("/")) << violation.problem;
            EXPECT_GT(violation.problem.size(), 15u);
          }
          ++refused;
          continue;
        }
        EXPECT_TRUE(fits);
        check_flight(request, std::get<Prepared>(prepared));
        ++flown;
      }
  RecordProperty("flown", flown);
  RecordProperty("refused", refused);
  EXPECT_GT(flown, 10);
}

INSTANTIATE_TEST_SUITE_P(EveryPlant, Combination,
                         testing::Values("rigid_axis", "flexible_axis", "body", "body, Euler parameters",
                                         "body, shadow set"),
                         [](const auto& parameter) {
                           std::string name = parameter.param;
                           for (char& c : name)
                             if (c == ' ' || c == ',') c = '_';
                           return name;
                         });

}  // namespace
}  // namespace slew
