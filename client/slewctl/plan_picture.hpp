// Pictures of a plan: its histories in time, and its path on the cube of controls (Vadali, Singh & Carter
// 1993, Fig. 2).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace slew::ctl {

/// `curves` as slew::plan_curves makes them; scripts for gnuplot.
std::string plan_history_script(const nlohmann::json& plan, const nlohmann::json& curves,
                                const std::string& title, const std::string& file);
std::string control_cube_script(const nlohmann::json& plan, const nlohmann::json& curves,
                                const std::string& title, const std::string& file);

}  // namespace slew::ctl
