#include "client/slewctl/phase_plane_picture.hpp"

#include <nlohmann/json.hpp>

#include "client/slewctl/gnuplot.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

struct Firing {
  int u;
  const char* name;
  const char* title;
  const char* color;
};

constexpr Firing kFirings[] = {{1, "positive", "u = +1", "#2e7d32"},
                               {0, "off", "u = 0", "#1f4e9c"},
                               {-1, "negative", "u = -1", "#b71c1c"},
                               {2, "sliding", "sliding", "#ef6c00"}};

// While thrusters chatter their on-times are fractions.
int firing_of(const json& point) {
  const double u = point.at(2);
  return u == 1 ? 1 : u == 0 ? 0 : u == -1 ? -1 : 2;
}

// The stretches of the path under one firing, joined to where the next begins.
std::string stretches(const json& path, int firing) {
  std::string points;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const bool belongs = firing_of(path[i]) == firing;
    const bool ends_here = i > 0 && firing_of(path[i - 1]) == firing;
    if (belongs || ends_here) points += in_full(path[i].at(0)) + ' ' + in_full(path[i].at(1)) + '\n';
    if (!belongs && ends_here) points += '\n';
  }
  return points;
}

}  // namespace

std::string phase_plane_script(const json& description, const std::string& title, const std::string& file) {
  const json& design = description.at("design");
  const json& path = design.at("path");
  std::string blocks, plots;
  const auto add = [&](const std::string& name, const std::string& points, const std::string& style) {
    if (points.empty()) return;
    blocks += "$" + name + " << EOD\n" + points + "EOD\n";
    plots += (plots.empty() ? "plot $" : ", $") + name + ' ' + style;
  };
  std::string edges;
  for (const json& edge : design.at("edges")) {
    for (const json& point : edge.at("curve"))
      edges += in_full(point.at(0)) + ' ' + in_full(point.at(1)) + '\n';
    edges += '\n';
  }
  add("edges", edges, "with lines lw 1.5 dt 2 lc rgb '#555555' title 'edges of the band (s = level)'");
  for (const Firing& firing : kFirings)
    add(firing.name, stretches(path, firing.u),
        "with lines lw 2.5 lc rgb '" + std::string(firing.color) + "' title '" + firing.title + "'");
  if (!path.empty()) {
    const auto place = [](const json& point) {
      return in_full(point.at(0)) + ' ' + in_full(point.at(1)) + '\n';
    };
    add("begin", place(path.front()), "with points pt 6 ps 1.6 lw 2 lc rgb 'black' title 'start'");
    add("end", place(path.back()), "with points pt 7 ps 1.2 lc rgb 'black' title 'end'");
  }
  std::string text = terminal_for(file, 1000, 800) + "set encoding utf8\nset grid\nset key below\n";
  text += "set title " + quoted(title + (design.at("path_is_whole") ? "" : " (the beginning)")) + "\n";
  text +=
      "set xlabel 'theta - theta_f, deg'\nset ylabel 'theta-dot, deg/s'\nset zeroaxis lt 1 lc rgb "
      "'#888888'\n";
  text += "set offsets graph 0.05, graph 0.05, graph 0.05, graph 0.05\n";
  if (const json& box = design.at("end_box"); !box.is_null()) {
    const std::string angle = in_full(box.at("angle_deg")), rate = in_full(box.at("rate_deg_s"));
    text += "set object 1 rectangle from -" + angle + ",-" + rate + " to " + angle + ',' + rate +
            " fillstyle empty border lc rgb '#6a1b9a' lw 2\n";
  }
  return text + blocks + plots + "\n";
}

}  // namespace slew::ctl
