#include "client/slewctl/plan_picture.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "client/slewctl/gnuplot.hpp"
#include "client/slewctl/terminal.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

constexpr const char* kColors[] = {"#1f4e9c", "#b71c1c", "#2e7d32", "#ef6c00", "#6a1b9a", "#00838f"};

std::string heading(const json& plan, const std::string& title) {
  std::string text = title + ": " + number(plan.at("time_s").get<double>()) + " s, ";
  const std::string status = plan.at("status");
  text += status == "given" ? "as given" : status == "best_found" ? "best found" : status;
  for (char& c : text)
    if (c == '_') c = ' ';
  return text;
}

// Columns: t, then those of each list of `names`.
std::string data_block(const json& curves, const std::vector<const char*>& names) {
  std::string text = "$data << EOD\n";
  for (std::size_t k = 0; k < curves.at("t_s").size(); ++k) {
    text += in_full(curves.at("t_s")[k].get<double>());
    for (const char* name : names)
      for (const json& value : curves.at(name)[k]) text += ' ' + in_full(value.get<double>());
    text += '\n';
  }
  return text + "EOD\n";
}

std::string plots(std::size_t from, const std::vector<std::string>& titles) {
  std::string text = "plot ";
  for (std::size_t i = 0; i < titles.size(); ++i)
    text += (i > 0 ? ", " : "") + std::string("$data using 1:") + std::to_string(from + i) +
            " with lines lw 2 lc rgb '" + kColors[i % std::size(kColors)] + "' title " + quoted(titles[i]);
  return text + "\n";
}

std::string joined(const json& point) {
  std::string text;
  for (const json& value : point) text += in_full(value.get<double>()) + ' ';
  return text + '\n';
}

// The twelve edges of the cube of +-1.
std::string cube_edges() {
  std::string text;
  for (int axis = 0; axis < 3; ++axis)
    for (const int u : {-1, 1})
      for (const int v : {-1, 1})
        for (const int end : {-1, 1}) {
          int point[3];
          point[axis] = end;
          point[(axis + 1) % 3] = u;
          point[(axis + 2) % 3] = v;
          text += joined({point[0], point[1], point[2]}) + (end == 1 ? "\n\n" : "");
        }
  return text;
}

}  // namespace

std::string plan_history_script(const json& plan, const json& curves, const std::string& title,
                                const std::string& file) {
  const std::size_t controls = curves.at("controls").front().size();
  std::vector<std::string> names;
  for (std::size_t i = 1; i <= controls; ++i) names.push_back("u" + std::to_string(i));
  const bool has_vibration = curves.contains("vibration_deg");
  std::vector<const char*> columns{"controls", "rate_deg_s", "attitude_deg"};
  if (has_vibration) columns.push_back("vibration_deg");
  std::string text = terminal_for(file, 1000, has_vibration ? 1200 : 1000) + "set encoding utf8\n";
  text += data_block(curves, columns) + "set multiplot layout " + (has_vibration ? "4" : "3") + ",1 title " +
          quoted(heading(plan, title)) +
          "\nset grid\nset lmargin 12\nset rmargin 18\nset key outside right\nset xrange [0:" +
          in_full(curves.at("t_s").back().get<double>()) + "]\n";
  text += "set ylabel 'controls'\nset yrange [-1.1:1.1]\n" + plots(2, names);
  text += "set yrange [*:*]\nset ylabel 'rate, deg/s'\n" + plots(2 + controls, {"w1", "w2", "w3"});
  if (!has_vibration) text += "set xlabel 't, s'\n";
  text += "set ylabel 'attitude, deg'\n" + plots(5 + controls, {"yaw", "pitch", "roll", "to the end"});
  if (has_vibration) {
    std::vector<std::string> modes;
    for (const json& mode : plan.at("vibration").at("modes"))
      modes.push_back(number(mode.at("frequency_hz").get<double>()) + " Hz");
    text += "set xlabel 't, s'\nset ylabel 'vibration (surrogate), deg'\n" + plots(9 + controls, modes);
  }
  return text + "unset multiplot\n";
}

std::string control_cube_script(const json& plan, const json& curves, const std::string& title,
                                const std::string& file) {
  std::string path;
  // The last of them is after the end.
  for (std::size_t k = 0; k + 1 < curves.at("controls").size(); ++k) path += joined(curves.at("controls")[k]);
  std::vector<double> effort = plan.at("bounds").at("effort_s2").get<std::vector<double>>();
  double largest = 1e-300;
  for (const double one : effort) largest = std::max(largest, std::abs(one));
  json forward = json::array(), back = json::array();
  for (const double one : effort) {
    forward.push_back(one / largest);
    back.push_back(-one / largest);
  }
  std::string text = terminal_for(file, 900, 800) + "set encoding utf8\n";
  text += "set title " +
          quoted(heading(plan, title) + "; critical control u" +
                 std::to_string(plan.at("bounds").at("critical_control").get<int>())) +
          "\n";
  text +=
      "set xlabel 'u1'\nset ylabel 'u2'\nset zlabel 'u3'\nset view 65,35\nset xyplane at -1.2\nset key at "
      "screen 0.98, 0.1 vertical samplen 3\n";
  text += "set xrange [-1.2:1.2]\nset yrange [-1.2:1.2]\nset zrange [-1.2:1.2]\n";
  text += "$cube << EOD\n" + cube_edges() + "EOD\n$path << EOD\n" + path + "EOD\n$axis << EOD\n" +
          joined(back) + joined(forward) + "EOD\n$begin << EOD\n" + joined(curves.at("controls").front()) +
          "EOD\n";
  text +=
      "splot $cube using 1:2:3 with lines lc rgb '#aaaaaa' notitle, "
      "$axis using 1:2:3 with lines lw 1.5 dt 2 lc rgb '#555555' title 'about the eigenaxis', "
      "$path using 1:2:3 with linespoints lw 2.5 pt 7 ps 0.6 lc rgb '#b71c1c' title 'controls', "
      "$begin using 1:2:3 with points pt 6 ps 2 lw 2 lc rgb 'black' title 'start'\n";
  return text;
}

}  // namespace slew::ctl
