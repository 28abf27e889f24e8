// Pictures of a design that nobody has flown yet.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace slew::ctl {

/// Draws what `description.design` holds: root locus and Bode's curves of a linear law, the phase plane of an
/// on-off one, the responses of a structure. `file` ends in .png or .svg; "-" draws in the terminal. Throws
/// Stop with a sentence.
void draw_design(const nlohmann::json& description, const std::string& title, const std::string& file);

}  // namespace slew::ctl
