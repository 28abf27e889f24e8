// Pictures of a series, drawn by gnuplot.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace slew::ctl {

/// Draws angle, rate, switching function and torque over time. `file` ends in .png or .svg; "-" draws in the
/// terminal. `series` is the answer to a series query. Throws Stop with a sentence.
void draw_series(const nlohmann::json& series, const std::string& title, const std::string& file);

/// Throws Stop unless the file's name ends in something that can be drawn.
void check_picture_name(const std::string& file);

}  // namespace slew::ctl
