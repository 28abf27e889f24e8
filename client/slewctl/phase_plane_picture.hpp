// The phase plane of an on-off law.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace slew::ctl {

/// gnuplot's script for a description whose `design` is a phase plane: switching curves, dead band, end box,
/// and the path, coloured by what fires.
std::string phase_plane_script(const nlohmann::json& description, const std::string& title,
                               const std::string& file);

}  // namespace slew::ctl
