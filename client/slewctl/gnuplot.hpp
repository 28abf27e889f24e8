// gnuplot as a child process, and pieces of its scripts.
#pragma once

#include <string>

namespace slew::ctl {

/// In single quotes, in which nothing is special.
std::string quoted(const std::string& text);
std::string in_full(double value);

/// Sets terminal and output: a file that ends in .png or .svg, or "-" for the text terminal.
std::string terminal_for(const std::string& file, int width = 1000, int height = 1000);

/// Throws Stop with a sentence when it is not installed or cannot draw.
void run_gnuplot(const std::string& script, const std::string& file);

/// Throws Stop unless the file's name ends in something that can be drawn.
void check_picture_name(const std::string& file);

}  // namespace slew::ctl
