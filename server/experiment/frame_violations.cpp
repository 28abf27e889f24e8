// What is wrong with a frame, in the words and at the places of the request.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "server/experiment/frame_request.hpp"
#include "server/experiment/limits.hpp"
#include "server/experiment/schema.hpp"
#include "server/experiment/structure_request.hpp"

namespace slew {
namespace {

using Eigen::Index;
using nlohmann::json;

// The modes have eight digits and so has the sum of D^2: inertia that is left below that is rounding.
constexpr double kResidualRounding = 1e-7;
// Sine of the angle by which an axis may lean on a plane's normal.
constexpr double kLean = 1e-9;

// As the schema has it for a beam's section.
constexpr std::size_t kLongestName = 64;

std::string text(double value) {
  return json(value).dump();
}

class FrameJudge {
 public:
  explicit FrameJudge(const json& plant) : plant_(plant) {}

  std::vector<Violation> judge() {
    if (!is_structure(plant_)) check_inertia();
    check_axis();
    check_sections();
    check_geometry();
    if (is_structure(plant_)) check_masses();
    if (is_structure(plant_) && violations_.empty()) check_connections();
    if (violations_.empty()) is_structure(plant_) ? check_hub() : check_modes();
    return std::move(violations_);
  }

 private:
  /// The same thing once: beams share their sections.
  void violate(const json::json_pointer& place, std::string problem, std::string given, std::string allowed) {
    std::string pointer = (json::json_pointer("/plant") / place).to_string();
    for (const Violation& known : violations_)
      if (known.pointer == pointer && known.problem == problem) return;
    violations_.push_back({std::move(pointer), std::move(problem), std::move(given), std::move(allowed)});
  }
  void violate(const char* field, std::string problem, std::string given, std::string allowed) {
    violate(json::json_pointer() / field, std::move(problem), std::move(given), std::move(allowed));
  }
  std::string given(const char* field) const { return shortened(plant_.at(field)); }

  void check_inertia() {
    const bool has_whole = plant_.contains("inertia_kg_m2"), has_hub = plant_.contains("hub_inertia_kg_m2");
    if (has_whole && has_hub)
      violate("hub_inertia_kg_m2", "the inertia is given twice: of the whole spacecraft and of its hub",
              given("hub_inertia_kg_m2"), "one of the two; null removes the other");
    if (!has_whole && !has_hub)
      violate("inertia_kg_m2", "a required field is missing", "",
              "inertia_kg_m2 of the whole spacecraft, or hub_inertia_kg_m2");
  }

  void check_axis() {
    if (!plant_.contains("axis")) return;
    const Eigen::Vector3d axis = hub_axis(plant_);
    json in_plane = plant_;
    in_plane.erase("axis");
    const Eigen::Vector3d normal = hub_axis(in_plane);
    if (axis.isZero(0))
      violate("axis", "the axis has no direction", given("axis"), "a vector that is not 0");
    else if (plant_.contains("plane") && !is_structure(plant_) && !(axis.cross(normal).norm() < kLean))
      violate("axis", "to turn about this axis moves nothing in the frame's plane", given("axis"),
              "left out, or along the plane's normal");
  }

  void check_sections() {
    const char* allowed = "bending_stiffness_N_m2, or bending_stiffness_y_N_m2 and bending_stiffness_z_N_m2";
    std::vector<std::string> names;
    for (const auto& [name, section] : plant_.at("sections").items()) {
      // Longer ones no beam can name, and they would take long to compare.
      if (name.size() <= kLongestName) names.push_back(name);
      const auto place = json::json_pointer("/sections") / name / "bending_stiffness_N_m2";
      const bool has_either = section.contains("bending_stiffness_N_m2"),
                 has_y = section.contains("bending_stiffness_y_N_m2"),
                 has_z = section.contains("bending_stiffness_z_N_m2");
      if (has_either && (has_y || has_z))
        violate(place, "the bending stiffness is given about either axis and about one of them",
                shortened(section.at("bending_stiffness_N_m2")), allowed);
      if (!has_either && !(has_y && has_z)) violate(place, "a required field is missing", "", allowed);
    }
    const json& beams = plant_.at("beams");
    for (std::size_t i = 0; i < beams.size() && violations_.size() <= limits().max_violations; ++i) {
      const auto& name = beams[i].at("section").get_ref<const std::string&>();
      if (plant_.at("sections").contains(name)) continue;
      const std::string like = nearest(name, names);
      violate(json::json_pointer("/beams") / i / "section",
              "there is no such section" + (like.empty() ? "" : "; did you mean \"" + like + "\"?"),
              shortened(beams[i].at("section")), "a name in plant.sections");
    }
  }

  /// "beams/2/section/axial_stiffness_N" is a fault of the section that the beam names.
  json::json_pointer place_of(const std::string& field) const {
    json::json_pointer place("/" + field);
    constexpr std::string_view kSection = "/section/";
    const auto inside = field.find(kSection);
    if (inside == std::string::npos) return place;
    const auto& name = plant_.at(json::json_pointer("/" + field.substr(0, inside)) / "section")
                           .get_ref<const std::string&>();
    return json::json_pointer("/sections") / name / field.substr(inside + kSection.size());
  }

  void check_geometry() {
    const SpaceFrame frame = specify_frame(plant_);
    const std::size_t count = coordinate_count(frame), most = limits().max_frame_coordinates;
    if (count > most)
      violate(frame.elements_per_member > 1 ? "elements_per_member" : "nodes",
              "the frame has too many coordinates: six for each node, those inside members included",
              std::to_string(count), "at most " + std::to_string(most));
    for (FrameFault& fault : validate(frame))
      if (fault.field != "elements_per_member")  // the same with the library's bound
        violate(place_of(fault.field), std::move(fault.problem), std::move(fault.given),
                std::move(fault.allowed));
  }

  /// Consistent masses are all there is to accelerate a structure's nodes with.
  void check_masses() {
    const json& beams = plant_.at("beams");
    for (std::size_t i = 0; i < beams.size() && violations_.size() <= limits().max_violations; ++i) {
      const auto& name = beams[i].at("section").get_ref<const std::string&>();
      const auto section = plant_.at("sections").find(name);
      if (section != plant_.at("sections").end() && section->at("mass_per_length_kg_m") == 0)
        violate(json::json_pointer("/sections") / name / "mass_per_length_kg_m", "its beams have no mass",
                "0", "more than 0");
    }
    const json& bars = plant_.at("bars");
    for (std::size_t i = 0; i < bars.size() && violations_.size() <= limits().max_violations; ++i)
      if (bars[i].at("mass_per_length_kg_m") == 0)
        violate(json::json_pointer("/bars") / i / "mass_per_length_kg_m", "the bar has no mass", "0",
                "more than 0");
  }

  /// From the nodes that are held, along members, to all others.
  void check_connections() {
    const SpaceFrame frame = specify_frame(plant_);
    std::vector<char> reached(frame.nodes.size(), 0);
    for (std::size_t i = 0; i < frame.nodes.size(); ++i)
      for (const bool held : frame.nodes[i].held)
        if (held) reached[i] = 1;
    if (std::count(reached.begin(), reached.end(), 1) == 0)
      return violate("nodes", "nothing of the structure is held to its hub", "",
                     "a node with held [\"all\"], which is the hub");
    std::vector<std::pair<std::size_t, std::size_t>> members;
    for (const FrameBeam& beam : frame.beams) members.emplace_back(beam.from_node, beam.to_node);
    for (const FrameBar& bar : frame.bars) members.emplace_back(bar.from_node, bar.to_node);
    for (bool grows = true; grows;) {
      grows = false;
      for (const auto& [from, to] : members)
        if (reached[from] != reached[to]) {
          reached[from] = reached[to] = 1;
          grows = true;
        }
    }
    for (std::size_t i = 0; i < reached.size() && violations_.size() <= limits().max_violations; ++i)
      if (!reached[i])
        violate(json::json_pointer("/nodes") / i, "no member connects the node with the hub",
                shortened(plant_.at("nodes")[i]), "beams or bars that lead to a node that is held");
  }

  /// What the hub and the structure are together.
  void check_hub() try {
    constexpr double kRounding = 1e-12;
    const AssembledFrame frame = assemble(specify_frame(plant_));
    const Eigen::Matrix3d inertia = mass_properties(frame).inertia_about_centre_kg_m2;
    const Eigen::Vector3d moments = inertia.selfadjointView<Eigen::Lower>().eigenvalues();
    if (!(moments[0] > kRounding * moments[2]))
      violate("nodes", "the structure has no inertia about one of its axes", text(moments[0]) + " kg m^2",
              "a body or plate with inertia, or a polar inertia of its beams");
    const NormalModes clamped = normal_modes(frame, FrameBoundary::kClamped);
    if (clamped.size() == 0)
      violate("nodes", "nothing of the structure can deform", "", "a node that is not held");
    else if (clamped.frequency_rad_s[0] == 0)
      violate(
          "nodes",
          "the structure can move on its hub without being strained: it is a mechanism, or a member is so "
          "stiff that others are lost in its rounding",
          "", "nodes held, or members that resist every motion");
  } catch (const std::domain_error& error) {
    violate("nodes", error.what(), "", "parts that resist every motion, or have mass");
  }

  void check_modes() try {
    const DerivedFrame frame = derive_frame(plant_);
    check_kept(frame.clamped.frequency_rad_s / (2 * std::numbers::pi));
    if (frame.hub_inertia_kg_m2 < 0)
      violate("inertia_kg_m2", "the frame alone has more inertia than the whole spacecraft",
              given("inertia_kg_m2"), "at least " + text(frame.coupling.inertia_kg_m2));
    if (!violations_.empty()) return;
    const SingleAxisPlant flown = keep_modes(plant_, frame);
    const double residual = residual_inertia_kg_m2(flown);
    const char* field = plant_.contains("inertia_kg_m2") ? "inertia_kg_m2" : "hub_inertia_kg_m2";
    if (!(residual > kResidualRounding * flown.inertia_kg_m2))
      violate(field, "the modes carry all the inertia there is: I - sum D^2 must be positive", given(field),
              "I more than sum D^2, " + text(flown.inertia_kg_m2 - residual));
  } catch (const std::domain_error& error) {
    violate("nodes", error.what(), "", "parts that resist every motion, or have mass");
  }

  void check_kept(const Eigen::VectorXd& frequency_hz) {
    const auto kept = plant_.at("modes_kept").get<Index>();
    if (kept > frequency_hz.size())
      violate("modes_kept", "the frame has fewer modes", std::to_string(kept),
              "at most " + std::to_string(frequency_hz.size()));
    const Limits& most = limits();
    for (Index i = 0; i < std::min(kept, frequency_hz.size()); ++i) {
      const std::string mode = "mode " + std::to_string(i + 1) + " at " + text(frequency_hz(i)) + " Hz";
      if (frequency_hz(i) == 0)
        violate("nodes",
                "the frame can move without being strained: it is a mechanism, or a member is so stiff that "
                "others are lost in its rounding",
                mode, "nodes held, or members that resist every motion");
      else if (!(frequency_hz(i) >= most.min_mode_frequency_hz &&
                 frequency_hz(i) <= most.max_mode_frequency_hz))
        violate("modes_kept", "a mode that is kept is out of range", mode,
                text(most.min_mode_frequency_hz) + " to " + text(most.max_mode_frequency_hz) + " Hz");
    }
  }

  const json& plant_;
  std::vector<Violation> violations_;
};

}  // namespace

std::vector<Violation> frame_violations(const json& request,
                                        const std::vector<Violation>& schema_violations) {
  const bool is_unsound =
      std::any_of(schema_violations.begin(), schema_violations.end(), [](const Violation& violation) {
        return violation.pointer.empty() || violation.pointer == "/plant" ||
               violation.pointer.starts_with("/plant/");
      });
  if (is_unsound || !request.contains("plant")) return {};
  if (!is_frame(request.at("plant")) && !is_structure(request.at("plant"))) return {};
  return FrameJudge(request.at("plant")).judge();
}

}  // namespace slew
