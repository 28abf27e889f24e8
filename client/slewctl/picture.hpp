// Pictures of a run, drawn by gnuplot.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace slew::ctl {

/// Draws error, rate and switching function over time from `series` (the answer to a series query), and the
/// firings from the exact times of `result`'s events: samples would alias them. `file` ends in .png or .svg;
/// "-" draws in the terminal. Throws Stop with a sentence.
void draw_run(const nlohmann::json& result, const nlohmann::json& series, const std::string& title,
              const std::string& file);

}  // namespace slew::ctl
