// What is wrong with a request in three axes, in the words and at the places of the request.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/actuator/torque_authority.hpp"
#include "server/experiment/attitude_request.hpp"
#include "server/experiment/law_fields.hpp"

namespace slew {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using nlohmann::json;

constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};

// ---- what has one axis does not fit what has three

/// A choice of a request, those of its words that are for one axis or for three, and what to say of one that
/// does not fit. What stands in neither list fits both.
struct Choice {
  const char* pointer;
  std::vector<std::string> one, three;
  const char* one_on_a_body;
  const char* three_on_an_axis;
};

std::vector<std::string> attitude_law_types() {
  std::vector<std::string> types;
  for_each_law([&](const auto& law) { types.emplace_back(std::decay_t<decltype(law)>::kType); });
  return types;
}

const std::vector<Choice>& choices() {
  static const std::vector<Choice> all = {
      {"/maneuver/type",
       {"single_axis"},
       {"three_axis"},
       "a maneuver about one axis does not say where a body in three axes should point",
       "a plant with one axis cannot follow a maneuver in three"},
      {"/controller/type",
       {"switching_function", "linear_switching_function", "schmitt_trigger", "firing_program",
        "attitude_rate_feedback", "lead_compensation"},
       attitude_law_types(),
       "a law for one axis cannot turn a body in three",
       "a law for a body in three axes has no use for a plant with one"},
      {"/actuator/type",
       {"on_off_pair", "proportional"},
       {"ideal_torque", "axis_thrusters", "thruster_couples", "thruster_set"},
       "thrusters about one axis cannot turn a body in three",
       "a plant with one axis has no use for torque about three"},
      {"/estimator/type",
       {"second_order_angle", "first_order_angle"},
       {"disturbance_observer"},
       "an estimator of one angle does not see a body in three axes",
       "an observer of the disturbances of a body in three axes has no use for a plant with one"},
      {"/sensors/type", {}, {"sampled_attitude"}, "", "a plant with one axis has only ideal sensors"},
      {"/metrics/settling/quantity",
       {},
       {"mrp_1", "mrp_2", "mrp_3", "mrp_norm"},
       "",
       "a plant with one axis has no modified Rodrigues parameters"}};
  return all;
}

const Choice& disturbance_types() {
  static const Choice types = {"",
                               {"constant", "fraction_of_thrust", "step", "sinusoid", "friction"},
                               {"body_constant", "body_step", "body_sinusoid"},
                               "a disturbance about one axis does not say how it acts on a body in three",
                               "a disturbance of a body in three axes does not fit a plant with one"};
  return types;
}

bool contains(const std::vector<std::string>& list, const json& value) {
  return value.is_string() &&
         std::find(list.begin(), list.end(), value.get_ref<const std::string&>()) != list.end();
}

std::string listed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "\"" : ", \"") + word + "\"";
  return text;
}

void check_choice(const SoundFields& fields, const Choice& choice, const std::string& pointer,
                  const Violate& violate) {
  const json* given = fields.at(pointer);
  if (!given) return;
  const bool three = has_three_axes(fields);
  if (!contains(three ? choice.one : choice.three, *given)) return;
  std::string allowed = listed(three ? choice.three : choice.one);
  if (choice.pointer == std::string("/estimator/type")) allowed = "\"none\", " + allowed;
  if (choice.pointer == std::string("/sensors/type")) allowed = "\"ideal\"";
  if (choice.pointer == std::string("/metrics/settling/quantity")) allowed = "\"angle_deg\"";
  violate(pointer, three ? choice.one_on_a_body : choice.three_on_an_axis, shortened(*given), allowed);
}

void check_axes(const SoundFields& fields, const Violate& violate) {
  for (const Choice& choice : choices()) check_choice(fields, choice, choice.pointer, violate);
  const json* disturbances = fields.at("/disturbances");
  if (!disturbances || !disturbances->is_array()) return;
  for (std::size_t i = 0; i < disturbances->size(); ++i)
    check_choice(fields, disturbance_types(), "/disturbances/" + std::to_string(i) + "/type", violate);
}

void check_settling(const SoundFields& fields, const Violate& violate) {
  if (!fields.says("/metrics/settling/tolerance/type", "absolute")) return;
  const json* quantity = fields.at("/metrics/settling/quantity");
  if (!quantity) return;
  const bool is_angle = *quantity == "angle_deg";
  const std::string block = "/metrics/settling/tolerance", right = is_angle ? "value_deg" : "value",
                    wrong = is_angle ? "value" : "value_deg";
  const std::string what = is_angle ? "an angle's tolerance is in degrees"
                                    : "the tolerance of modified Rodrigues parameters is no angle";
  if (fields.lacks(block, right)) violate(block + '/' + right, "a required field is missing", "", "a number");
  if (const json* given = fields.at(block + '/' + wrong))
    violate(block + '/' + wrong, what, shortened(*given), "left out; " + right + " says it");
}

// ---- inertia

/// Symmetric, positive definite, and of a body that can exist: no principal moment larger than the two others
/// together. A law may believe in one that cannot.
void check_inertia(const SoundFields& fields, const std::string& pointer, bool is_belief,
                   const Violate& violate) {
  const json* given = fields.at(pointer);
  if (!given || !given->is_array() || given->size() != 3) return;
  const auto rows =
      std::count_if(given->begin(), given->end(), [](const json& row) { return row.is_array(); });
  if (rows != 0 && rows != 3) {
    violate(pointer, "this is neither a diagonal nor a matrix", shortened(*given),
            "three numbers, or three rows of three");
    return;
  }
  // Where a number is wrong the schema has said so.
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string row = pointer + '/' + std::to_string(i);
    if (rows == 0 ? !fields.number(row) : !fields.has(row)) return;
    for (std::size_t j = 0; rows == 3 && j < 3; ++j)
      if (!fields.number(row + '/' + std::to_string(j))) return;
  }
  const Matrix3d inertia = matrix_of(*given);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < i; ++j)
      if (inertia(i, j) != inertia(j, i)) {
        const std::string names = std::string(kAxes[j]) + kAxes[i];
        violate(pointer + '/' + std::to_string(i) + '/' + std::to_string(j),
                "the matrix of inertia is not symmetric: J_" + names + " and its mirror differ",
                number(inertia(i, j)), number(inertia(j, i)) + ", or both the same");
        return;
      }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(inertia);
  const Vector3d& moments = solver.eigenvalues();
  const std::string principal =
      "[" + number(moments[0]) + ", " + number(moments[1]) + ", " + number(moments[2]) + "]";
  // Beyond this the inverse has no digits left.
  constexpr double kRounding = 1e-12;
  if (!(moments[0] > kRounding * moments[2])) {
    violate(pointer,
            "the inertia is not positive definite: the principal moments are " + principal + " kg m^2",
            shortened(*given), "principal moments greater than 0");
    return;
  }
  if (is_belief || moments[2] <= (1 + kRounding) * (moments[0] + moments[1])) return;
  Eigen::Index nearest = 0;
  solver.eigenvectors().col(2).cwiseAbs().maxCoeff(&nearest);
  violate(pointer,
          "no body has this inertia: the principal moments are " + principal +
              " kg m^2, and the largest, about an axis near body " +
              kAxes[static_cast<std::size_t>(nearest)] + ", is more than the two others together",
          shortened(*given), "each at most the sum of the two others");
}

// ---- attitudes

/// Whether it is one at all.
bool check_attitude_block(const SoundFields& fields, const std::string& pointer, const Violate& violate) {
  const json* attitude = fields.at(pointer);
  if (!attitude || !attitude->is_object()) return false;
  const auto is_zero = [](const json& numbers) {
    return std::all_of(numbers.begin(), numbers.end(), [](const json& value) { return value == 0; });
  };
  for (const char* name : {"/type", "/axis", "/angle_deg", "/value", "/angles_deg"})
    if (attitude->contains(name + 1) && !fields.has(pointer + name)) return false;
  if (!attitude->contains("type")) return false;
  const bool is_rotation = attitude->at("type") == "rotation";
  const bool is_angles = attitude->at("type") == "euler_123";
  const char* name = is_rotation ? "axis" : is_angles ? "angles_deg" : "value";
  if (!attitude->contains(name) || (is_rotation && !attitude->contains("angle_deg"))) return false;
  const json& numbers = attitude->at(name);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (!fields.number(pointer + '/' + name + '/' + std::to_string(i))) return false;
  if (attitude->at("type") == "mrp" || is_angles || !is_zero(numbers)) return true;
  violate(pointer + '/' + name,
          is_rotation ? "the axis has no direction" : "Euler parameters that are all 0 are no attitude",
          shortened(numbers), is_rotation ? "a vector that is not 0" : "at least one that is not 0");
  return false;
}

void check_maneuver(const SoundFields& fields, const Violate& violate) {
  const bool begins = check_attitude_block(fields, "/maneuver/initial_attitude", violate);
  const bool ends = check_attitude_block(fields, "/maneuver/final_attitude", violate);
  if (begins && ends) {
    constexpr double kMostNorm = 1000;
    const double norm = initial_mrp_of(*fields.at("/maneuver")).norm();
    if (!(norm <= kMostNorm))
      violate(
          "/maneuver/initial_attitude",
          "the initial attitude is a whole turn from the final one, where there are no modified Rodrigues "
          "parameters",
          shortened(*fields.at("/maneuver/initial_attitude")),
          "another, or the same the short way round (Euler parameters with the other sign)");
  }
  if (const json* axis = fields.at("/maneuver/reference/axis"); axis && axis->is_array())
    if (std::all_of(axis->begin(), axis->end(), [](const json& value) { return value == 0; }))
      violate("/maneuver/reference/axis", "the axis has no direction", shortened(*axis),
              "a vector that is not 0");
}

// ---- law, observer, sensors

/// Matrices of a law are beliefs of the inertia; its lists are times, in the order in which they come.
class LawChecked {
 public:
  LawChecked(const SoundFields& fields, const Violate& violate) : fields_(fields), violate_(violate) {}

  template <typename Value>
  void operator()(const char* name, const Value&) {
    if constexpr (std::is_same_v<Value, std::vector<double>>) check(std::string("/controller/") + name);
  }
  void inertia(const char* name, const Matrix3d&) {
    check_inertia(fields_, std::string("/controller/") + name, true, violate_);
  }

 private:
  void check(const std::string& pointer) {
    const json* times = fields_.at(pointer);
    if (!times || !times->is_array()) return;
    double last = 0;
    for (std::size_t i = 0; i < times->size(); ++i) {
      const std::string place = pointer + '/' + std::to_string(i);
      const auto time = fields_.number(place);
      if (!time) continue;
      if (*time <= last)
        violate_(place,
                 i == 0 ? "what changes at once is there from the beginning"
                        : "times stand in the order in which they come",
                 number(*time), "more than " + number(last));
      last = std::max(last, *time);
    }
  }

  const SoundFields& fields_;
  const Violate& violate_;
};

void check_law(const SoundFields& fields, const Violate& violate) {
  const json* type = fields.at("/controller/type");
  auto law = type && type->is_string() ? attitude_law_of(type->get_ref<const std::string&>()) : std::nullopt;
  if (!law) return;
  LawChecked checked(fields, violate);
  std::visit([&](auto& one) { one.fields(checked); }, *law);
  check_inertia(fields, "/estimator/inertia_kg_m2", true, violate);

  std::vector<std::string> with_surface, tracking;
  for_each_law([&](const auto& one) {
    using Law = std::decay_t<decltype(one)>;
    if (Law::kHasSurface) with_surface.emplace_back(Law::kType);
    if (Law::kTracks) tracking.emplace_back(Law::kType);
  });
  if (fields.says("/estimator/type", "disturbance_observer") && !has_surface(*law))
    violate("/estimator/type",
            "the observer reads disturbances off the law's sliding surface, and this law has none",
            "\"disturbance_observer\"", "\"none\", or controller.type one of " + listed(with_surface));
  const json* reference = fields.at("/maneuver/reference/type");
  if (reference && *reference != "fixed" && !tracks(*law))
    violate("/maneuver/reference/type", "this law cannot follow a reference that moves",
            shortened(*reference), "\"fixed\", or controller.type one of " + listed(tracking));
  if (const auto norm = fields.number("/plant/shadow_switch_norm");
      norm && reference && *reference != "fixed")
    violate(
        "/plant/shadow_switch_norm",
        "a law that follows a moving reference steers by p - p_d, which jumps where p changes to its shadow",
        number(*norm), "left out, or maneuver.reference of type \"fixed\"");

  const bool is_continuous = fields.says("/controller/evaluation/type", "continuous");
  if (!is_program(*law) && !is_continuous) return;
  const char* why = is_continuous ? "a law that is evaluated at every instant" : "a program";
  const char* instead = is_continuous ? ", or controller.evaluation of type \"sampled\"" : "";
  if (fields.says("/actuator/modulator/type", "pulse_width"))
    violate("/actuator/modulator/type",
            std::string("pulses are made wide at every sample, and ") + why + " has none", "\"pulse_width\"",
            std::string("\"pwpf\" or \"schmitt_trigger\"") + instead);
  if (fields.says("/sensors/type", "sampled_attitude"))
    violate("/sensors/type", std::string("sensors are read at every sample, and ") + why + " has none",
            "\"sampled_attitude\"", std::string("\"ideal\"") + instead);
}

// ---- actuators

void check_modulator(const SoundFields& fields, const Violate& violate) {
  const auto on = fields.number("/actuator/modulator/on"), off = fields.number("/actuator/modulator/off");
  if (on && off && *off >= *on)
    violate("/actuator/modulator/off", "a Schmitt trigger goes off below where it goes on", number(*off),
            "less than actuator.modulator.on, " + number(*on));
}

// Whether every number of the thrusters' geometry is sound.
bool are_sound(const SoundFields& fields, std::size_t thrusters) {
  for (std::size_t i = 0; i < thrusters; ++i)
    for (const char* vector : {"/position_m/", "/direction/"})
      for (const char* component : {"0", "1", "2"})
        if (!fields.number("/actuator/thrusters/" + std::to_string(i) + vector + component)) return false;
  return true;
}

void check_authority(const SoundFields& fields, const json& thrusters, const Violate& violate) {
  if (!are_sound(fields, thrusters.size())) return;
  std::vector<Thruster> set(thrusters.size());
  for (std::size_t i = 0; i < set.size(); ++i) {
    set[i].position_m = vector_of(thrusters[i].at("position_m"));
    set[i].direction = vector_of(thrusters[i].at("direction")).stableNormalized();
  }
  std::string missing;
  for (const AxisDirection& direction : torques_that_cannot_be_made(set))
    missing += std::string(missing.empty() ? "" : ", ") + (direction.sign > 0 ? '+' : '-') +
               kAxes[static_cast<std::size_t>(direction.axis)];
  if (missing.empty()) return;
  violate("/actuator/thrusters",
          "no combination of these thrusters makes a torque about " + missing +
              " alone, so there are torques that cannot be allocated",
          std::to_string(set.size()) + " thrusters",
          "thrusters that push about each axis in both directions; at least four are needed");
}

void check_thrusters(const SoundFields& fields, const Violate& violate) {
  const json* thrusters = fields.at("/actuator/thrusters");
  if (!thrusters || !thrusters->is_array()) return;
  const bool is_set = !fields.says("/actuator/type", "thruster_couples");
  bool have_directions = true;
  for (std::size_t i = 0; i < thrusters->size(); ++i) {
    const std::string place = "/actuator/thrusters/" + std::to_string(i);
    const json* direction = fields.at(place + "/direction");
    if (direction && direction->is_array() &&
        std::all_of(direction->begin(), direction->end(), [](const json& value) { return value == 0; })) {
      violate(place + "/direction", "the thruster has no direction", shortened(*direction),
              "a vector that is not 0");
      have_directions = false;
    }
    if (is_set && fields.lacks(place, "thrust_N") && fields.lacks("/actuator", "thrust_N"))
      violate(place + "/thrust_N", "a required field is missing", "",
              "given here, or as actuator.thrust_N for all");
  }
  if (have_directions && is_set) check_authority(fields, *thrusters, violate);
}

}  // namespace

bool has_three_axes(const SoundFields& fields) {
  if (fields.has("/plant/type")) return fields.says("/plant/type", "rigid_body");
  const json* law = fields.at("/controller/type");
  return law && contains(attitude_law_types(), *law);
}

void check_attitude(const SoundFields& fields, const Violate& violate) {
  check_axes(fields, violate);
  check_settling(fields, violate);
  if (!has_three_axes(fields)) return;
  check_inertia(fields, "/plant/inertia_kg_m2", false, violate);
  check_maneuver(fields, violate);
  check_law(fields, violate);
  check_modulator(fields, violate);
  check_thrusters(fields, violate);
  if (fields.has("/actuator/tank_kg") && fields.lacks("/actuator", "specific_impulse_s"))
    violate("/actuator/specific_impulse_s",
            "when a tank is empty cannot be told without the specific impulse", "",
            "given together with tank_kg");
  if (fields.says("/actuator/type", "axis_thrusters") && fields.has("/actuator/tank_kg") &&
      fields.lacks("/actuator", "lever_arm_m"))
    violate("/actuator/lever_arm_m", "the propellant cannot be told from a torque without its lever arm", "",
            "given together with tank_kg");
  if (fields.has("/stop/when") && !fields.says("/stop/when", "duration"))
    violate("/stop/when", "a run in three axes ends with its duration: it has neither end box nor first rest",
            shortened(*fields.at("/stop/when")), "\"duration\"");
}

}  // namespace slew
