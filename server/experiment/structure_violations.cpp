// What is wrong with a request for a flexible structure, in the words and at the places of the request.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "server/experiment/structure_request.hpp"

namespace slew {
namespace {

using nlohmann::json;

/// A choice of a request, what of it fits a structure, what fits nothing else, and what to say.
struct Choice {
  const char* pointer;
  std::vector<std::string> fits;   ///< a structure
  std::vector<std::string> alone;  ///< and no other plant
  const char* on_a_structure;
  const char* elsewhere;
};

const std::vector<Choice>& choices() {
  static const std::vector<Choice> all = {
      {"/maneuver/type",
       {"single_axis"},
       {},
       "a structure slews about one fixed axis, to first order in what departs from that",
       ""},
      {"/guidance/type",
       {"sine_squared_pulses"},
       {"sine_squared_pulses"},
       "a structure flies the command of a guidance",
       "pulses in the form of a sine squared are flown by flexible structures only"},
      {"/controller/type",
       {"open_loop", "tracking_sliding_mode"},
       {"open_loop", "tracking_sliding_mode"},
       "this law does not say what actuators at the nodes of a structure do",
       "this law is for a flexible structure"},
      {"/actuator/type",
       {"node_actuators"},
       {"node_actuators"},
       "a structure has actuators at its nodes",
       "actuators at nodes need a structure that has nodes"},
      {"/estimator/type",
       {"none", "kalman_filter"},
       {"kalman_filter"},
       "this estimator does not see a structure's elastic states",
       "the filter is one of a structure's elastic states"},
      {"/sensors/type",
       {"ideal", "node_sensors"},
       {"node_sensors"},
       "a structure has sensors at its nodes",
       "sensors at nodes need a structure that has nodes"},
      {"/metrics/settling/quantity",
       {"angle_deg", "antenna_pointing_deg", "antenna_rotation_deg"},
       {"antenna_pointing_deg", "antenna_rotation_deg"},
       "a structure has no modified Rodrigues parameters",
       "only a structure has an antenna"},
      {"/metrics/settling/origin",
       {"start", "command_arrival"},
       {"command_arrival"},
       "",
       "only the command of a structure's guidance arrives"},
      {"/stop/when", {"duration"}, {}, "a structure's run ends with its duration", ""}};
  return all;
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

void check_disturbances(const SoundFields& fields, bool on_a_structure, const Violate& violate) {
  const json* disturbances = fields.at("/disturbances");
  if (!disturbances || !disturbances->is_array()) return;
  std::size_t noises = 0;
  for (std::size_t i = 0; i < disturbances->size(); ++i) {
    const std::string pointer = "/disturbances/" + std::to_string(i) + "/type";
    const json* type = fields.at(pointer);
    if (!type) continue;
    const bool is_noise = *type == "elastic_noise";
    if (on_a_structure && !is_noise)
      violate(pointer, "this disturbance does not say where it acts on a structure", shortened(*type),
              "\"elastic_noise\"");
    if (!on_a_structure && is_noise)
      violate(pointer, "noise on elastic coordinates needs a structure that has them", shortened(*type),
              "another type");
    if (on_a_structure && is_noise && ++noises > 1)
      violate(pointer, "there is one noise on the elastic coordinates", shortened(*type), "one of it");
  }
}

void check_node(const SoundFields& fields, const std::string& pointer, const Violate& violate) {
  const json* nodes = fields.at("/plant/nodes");
  const auto node = fields.number(pointer);
  if (!nodes || !nodes->is_array() || !node) return;
  if (*node >= static_cast<double>(nodes->size()))
    violate(pointer, "no such node", number(*node),
            nodes->empty() ? "there is no node" : "0 to " + std::to_string(nodes->size() - 1));
}

void check_nodes_of(const SoundFields& fields, const std::string& list, const Violate& violate) {
  const json* entries = fields.at(list);
  if (!entries || !entries->is_array()) return;
  for (std::size_t i = 0; i < entries->size(); ++i)
    check_node(fields, list + '/' + std::to_string(i) + "/node", violate);
}

void check_groups(const SoundFields& fields, const Violate& violate) {
  const json* groups = fields.at("/actuator/groups");
  if (!groups || !groups->is_array()) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < groups->size(); ++i) {
    const std::string place = "/actuator/groups/" + std::to_string(i);
    if (const json* name = fields.at(place + "/name"); name && name->is_string()) {
      const auto& text = name->get_ref<const std::string&>();
      if (text.empty() ||
          text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") != std::string::npos)
        violate(place + "/name", "a channel cannot be named after this group", shortened(*name),
                "lower-case letters, digits and _");
      else if (!names.insert(text).second)
        violate(place + "/name", "two groups have one name", shortened(*name), "another name");
    }
    const json* motions = fields.at(place + "/motions");
    if (!motions || !motions->is_array()) continue;
    const auto torques = std::count_if(motions->begin(), motions->end(), [](const json& motion) {
      return motion.is_string() && motion.get_ref<const std::string&>().starts_with('r');
    });
    if (torques != 0 && torques != static_cast<std::ptrdiff_t>(motions->size()))
      violate(place + "/motions", "the effort of forces and of torques has not the same unit",
              shortened(*motions), "all of them ux, uy, uz, or all rx, ry, rz");
  }
}

void check_loop(const SoundFields& fields, const Violate& violate) {
  const bool is_open = fields.says("/controller/type", "open_loop");
  const bool is_tracking = fields.says("/controller/type", "tracking_sliding_mode");
  if (is_open && fields.says("/estimator/type", "kalman_filter"))
    violate("/estimator/type", "nothing has a use for what is estimated: the loop is open",
            "\"kalman_filter\"", "\"none\", or controller.type \"tracking_sliding_mode\"");
  if (!is_tracking) return;
  if (fields.says("/estimator/type", "none"))
    violate("/estimator/type", "the law needs the elastic states, which a filter estimates", "\"none\"",
            "\"kalman_filter\"");
  if (fields.says("/sensors/type", "ideal"))
    violate("/sensors/type", "the filter sees the structure by sensors at its nodes", "\"ideal\"",
            "\"node_sensors\"");
  if (const json* groups = fields.at("/actuator/groups"); groups && groups->is_array() && groups->empty())
    violate("/actuator/groups", "the law has nothing to push with", "[]", "at least one group");
}

void check_settling_of_antenna(const SoundFields& fields, const Violate& violate) {
  const std::string block = "/metrics/settling/tolerance";
  const bool is_antenna = fields.says("/metrics/settling/quantity", "antenna_pointing_deg") ||
                          fields.says("/metrics/settling/quantity", "antenna_rotation_deg");
  if (is_antenna && fields.says(block + "/type", "fraction_of_initial"))
    violate(block + "/type", "the antenna begins where it should be: a fraction of that is nothing",
            "\"fraction_of_initial\"", "\"absolute\"");
  if (!fields.says(block + "/type", "absolute")) return;
  if (fields.lacks(block, "value_deg"))
    violate(block + "/value_deg", "a required field is missing", "", "a number");
  if (const json* given = fields.at(block + "/value"))
    violate(block + "/value", "an angle's tolerance is in degrees", shortened(*given),
            "left out; value_deg says it");
}

}  // namespace

bool has_structure(const SoundFields& fields) {
  if (fields.has("/plant/type")) return fields.says("/plant/type", "flexible_structure");
  return fields.says("/controller/type", "open_loop") ||
         fields.says("/controller/type", "tracking_sliding_mode");
}

void check_no_structure(const SoundFields& fields, const Violate& violate) {
  for (const Choice& choice : choices())
    if (const json* given = fields.at(choice.pointer); given && contains(choice.alone, *given))
      violate(choice.pointer, choice.elsewhere, shortened(*given), "another");
  check_disturbances(fields, false, violate);
}

void check_structure(const SoundFields& fields, const Violate& violate) {
  for (const Choice& choice : choices())
    if (const json* given = fields.at(choice.pointer); given && !contains(choice.fits, *given))
      violate(choice.pointer, choice.on_a_structure, shortened(*given), listed(choice.fits));
  check_disturbances(fields, true, violate);
  if (const auto rate = fields.number("/maneuver/initial_rate_deg_s"); rate && *rate != 0)
    violate("/maneuver/initial_rate_deg_s", "a structure's slew begins at rest", number(*rate), "0");
  check_node(fields, "/plant/antenna_node", violate);
  check_nodes_of(fields, "/plant/coordinates/loads", violate);
  check_nodes_of(fields, "/controller/design/loads", violate);
  check_nodes_of(fields, "/actuator/groups", violate);
  check_nodes_of(fields, "/sensors/groups", violate);
  check_groups(fields, violate);
  check_loop(fields, violate);
  check_settling_of_antenna(fields, violate);
}

}  // namespace slew
