#include "client/slewctl/picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "client/slewctl/connection.hpp"
#include "client/slewctl/gnuplot.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;

struct Quantity {
  const char* channel;
  const char* label;
  const char* color;
  double factor;
};

// Drawn in degrees, where the run has them; the torque only where nothing fires.
constexpr Quantity kQuantities[] = {{"error_rad", "error, deg", "#1f4e9c", kDegPerRad},
                                    {"rate_rad_s", "rate, deg/s", "#2e7d32", kDegPerRad},
                                    {"switching_function_rad", "s, deg", "#6a1b9a", kDegPerRad}};
constexpr Quantity kTorque = {"torque_N_m", "torque, N m", "#b71c1c", 1};
constexpr Quantity kCommand = {"slew_torque_N_m", "command, N m", "#37474f", 1};

// Of three axes, in one panel: their channels are named prefix + axis + suffix.
struct Vector {
  const char* prefix;
  const char* suffix;
  const char* label;
  double factor;
};
constexpr Vector kVectors[] = {{"mrp_", "", "p, MRP", 1},
                               {"rate_", "_rad_s", "rate, deg/s", kDegPerRad},
                               {"surface_", "_rad_s", "s, deg/s", kDegPerRad},
                               {"antenna_pointing_", "_rad", "pointing, deg", kDegPerRad},
                               {"antenna_rotation_", "_rad", "antenna to hub, deg", kDegPerRad},
                               {"estimated_disturbance_", "_N_m", "disturbance^, N m", 1},
                               {"torque_", "_N_m", "torque, N m", 1}};
constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr const char* kAxisColors[] = {"#b71c1c", "#2e7d32", "#1f4e9c"};

// Data blocks of gnuplot's, how they are drawn, and what must be set before.
struct Curve {
  std::string name;
  std::string points;
  std::string style;
};
struct Panel {
  std::string label;
  std::vector<Curve> curves;
  std::string settings;
};

std::string points_of(const json& t_s, const json& column, double factor) {
  std::string points;
  for (std::size_t i = 0; i < t_s.size(); ++i)
    points += in_full(t_s[i]) + ' ' + in_full(factor * column.at(i).get<double>()) + '\n';
  return points;
}

void add_panel(std::vector<Panel>& panels, const json& series, const Quantity& quantity) {
  const auto column = series.at("columns").find(quantity.channel);
  if (column == series.at("columns").end()) return;
  panels.push_back({quantity.label,
                    {{quantity.channel, points_of(series.at("t_s"), *column, quantity.factor),
                      "with lines lw 2 lc rgb '" + std::string(quantity.color) + "'"}},
                    ""});
}

void add_panel(std::vector<Panel>& panels, const json& series, const Vector& vector) {
  Panel panel{vector.label, {}, ""};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string channel = vector.prefix + std::to_string(axis + 1) + vector.suffix;
    const auto column = series.at("columns").find(channel);
    if (column == series.at("columns").end()) continue;
    panel.curves.push_back(
        {channel, points_of(series.at("t_s"), *column, vector.factor),
         std::string("with lines lw 1.5 lc rgb '") + kAxisColors[axis] + "' title '" + kAxes[axis] + "'"});
  }
  if (panel.curves.empty()) return;
  // Which axis is which is said once.
  const bool is_said = std::any_of(panels.begin(), panels.end(),
                                   [](const Panel& other) { return other.settings.starts_with("set key"); });
  panel.settings = is_said ? "unset key\n" : "set key top right horizontal\n";
  panels.push_back(std::move(panel));
}

// ---- when which thruster of three axes fires: a bar for each interval, a row for each thruster

struct Firing {
  double from_s, to_s;
};

// What tells of a thruster: its valve, where delays or faults make it differ from its command; its own
// command; or that of its pair, in which it is the positive or the negative one.
struct Teller {
  std::string channel;
  int mode;
};

Teller teller_of(const json& events, std::size_t thruster) {
  const std::string number = std::to_string(thruster);
  for (const json& event : events.at("list"))
    if (event.at("channel").get<std::string>().starts_with("valve_")) return {"valve_" + number, 1};
  for (const json& channel : events.at("channels"))
    if (channel == "thruster_" + number) return {channel, 1};
  return {"axis_" + std::to_string((thruster + 1) / 2), thruster % 2 == 1 ? 1 : -1};
}

// To full precision, where the result tells every event.
std::vector<Firing> firings_by_events(const json& events, std::size_t thruster, double end_s) {
  const Teller teller = teller_of(events, thruster);
  std::vector<Firing> firings;
  bool is_on = false;
  for (const json& event : events.at("list")) {
    if (event.at("channel") != teller.channel) continue;
    const bool goes_on = event.at("mode") == teller.mode;
    if (goes_on && !is_on) firings.push_back({event.at("t_s"), end_s});
    if (!goes_on && is_on) firings.back().to_s = event.at("t_s");
    is_on = goes_on;
  }
  return firings;
}

// As the samples have it, otherwise.
std::vector<Firing> firings_by_samples(const json& t_s, const json& on) {
  std::vector<Firing> firings;
  for (std::size_t i = 0; i + 1 < t_s.size(); ++i) {
    if (on[i].get<double>() == 0) continue;
    if (firings.empty() || firings.back().to_s != t_s[i].get<double>()) firings.push_back({t_s[i], 0});
    firings.back().to_s = t_s[i + 1];
  }
  return firings;
}

void add_bars(std::vector<Panel>& panels, const json& events, const json& series) {
  const json& columns = series.at("columns");
  const bool tells_all = events.at("reported") == events.at("total");
  Panel panel{"thrusters", {}, ""};
  std::string tics;
  std::size_t count = 0;
  for (;; ++count) {
    const std::string number = std::to_string(count + 1);
    const auto on = columns.find("thruster_" + number + "_on");
    if (on == columns.end()) break;
    std::string points;
    for (const Firing& firing : tells_all ? firings_by_events(events, count + 1, series.at("t_s").back())
                                          : firings_by_samples(series.at("t_s"), *on))
      points += in_full(firing.from_s) + ' ' + number + ' ' + in_full(firing.to_s - firing.from_s) + " 0\n";
    tics += (tics.empty() ? "" : ", ") + ("'" + number + "' ") + number;
    if (!points.empty())
      panel.curves.push_back(
          {"bars_" + number, points, "using 1:2:3:4 with vectors nohead lw 6 lc rgb '#b71c1c'"});
  }
  if (panel.curves.empty()) return;
  panel.settings =
      "set yrange [0.3:" + in_full(static_cast<double>(count) + 0.7) + "]\nset ytics (" + tics + ")\n";
  panels.push_back(std::move(panel));
}

// The modes of one event channel, from the first to the last that the result tells, or to the end.
Panel firing_panel(const json& events, const std::string& channel, double end_s) {
  Panel panel{channel, {{channel, "0 0\n", "with steps lw 1 lc rgb '#b71c1c'"}}, ""};
  std::string& points = panel.curves.front().points;
  int mode = 0;
  for (const json& event : events.at("list")) {
    if (event.at("channel") != channel) continue;
    mode = event.at("mode");
    points += in_full(event.at("t_s")) + ' ' + std::to_string(mode) + '\n';
  }
  if (events.at("reported") == events.at("total"))
    points += in_full(end_s) + ' ' + std::to_string(mode) + '\n';
  else
    panel.label += ", first " + std::to_string(events.at("reported").get<long>()) + " of " +
                   std::to_string(events.at("total").get<long>());
  return panel;
}

// What actuators at the nodes of a structure do, a panel for each group of them.
void add_groups(std::vector<Panel>& panels, const json& series, const json& structure) {
  for (const json& one : structure.at("efforts")) {
    const std::string group = one.at("group").get<std::string>() + "_";
    const bool is_torque = one.at("control_effort_N2_m2_s").is_number();
    std::string label = group.substr(0, group.size() - 1) + (is_torque ? ", N m" : ", N");
    std::replace(label.begin(), label.end(), '_', ' ');
    add_panel(panels, series, Vector{group.c_str(), is_torque ? "_N_m" : "_N", label.c_str(), 1});
  }
}

std::string line_through(const json& members, const json& positions) {
  std::string points;
  for (const json& member : members) {
    for (const json& end : member) {
      const json& at = positions.at(end.get<std::size_t>());
      points += in_full(at[0]) + ' ' + in_full(at[1]) + ' ' + in_full(at[2]) + '\n';
    }
    points += "\n\n";
  }
  return points;
}

/// The frame as it is and as it is deflected, many times enlarged.
std::string shape_panel(const json& shape) {
  const json& positions = shape.at("position_m");
  double size = 0, most = 0;
  for (const json& position : positions)
    for (const json& coordinate : position) size = std::max(size, std::abs(coordinate.get<double>()));
  for (const json& displacement : shape.at("displacement_m"))
    for (const json& component : displacement) most = std::max(most, std::abs(component.get<double>()));
  constexpr double kShown = 0.15;  // of the frame's size
  const double factor = most > 0 ? kShown * size / most : 0;
  json deflected = positions;
  for (std::size_t i = 0; i < deflected.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      deflected[i][k] =
          deflected[i][k].get<double>() + factor * shape.at("displacement_m").at(i).at(k).get<double>();
  char caption[80];
  std::snprintf(caption, sizeof caption, "deflection at %.3g s, %.3g times", shape.at("t_s").get<double>(),
                factor);
  return "$frame << EOD\n" + line_through(shape.at("members"), positions) + "EOD\n$deflected << EOD\n" +
         line_through(shape.at("members"), deflected) +
         "EOD\nunset xlabel\nunset ylabel\nunset lmargin\nunset rmargin\nunset offsets\nset autoscale\n"
         "set xtics 1\nset ytics 1\nset ztics 1\nset xyplane relative 0.05\nset view 65, 35\nset view equal "
         "xyz\n"
         "unset key\nset title " +
         quoted(caption) +
         "\nsplot $frame with lines lc rgb '#9e9e9e', $deflected with lines lw 2 lc rgb '#1f4e9c'\n";
}

std::string script(const json& result, const json& series, const std::string& title,
                   const std::string& file) {
  const double end_s = series.at("t_s").back();
  std::vector<Panel> panels;
  for (const Quantity& quantity : kQuantities) add_panel(panels, series, quantity);
  for (const Vector& vector : kVectors) add_panel(panels, series, vector);
  const std::size_t quantities = panels.size();
  if (series.at("columns").contains("mrp_1"))
    add_bars(panels, result.at("events"), series);
  else
    for (const json& channel : result.at("events").at("channels"))
      if (channel.get<std::string>().starts_with("thruster"))
        panels.push_back(firing_panel(result.at("events"), channel, end_s));
  if (panels.size() == quantities) add_panel(panels, series, kTorque);
  const json& metrics = result.at("metrics");
  const json structure = metrics.is_object() ? metrics.value("structure", json()) : json();
  if (structure.is_object()) {
    add_panel(panels, series, kCommand);
    add_groups(panels, series, structure);
  }

  std::string text = (structure.is_object() ? terminal_for(file, 1100, 1500) : terminal_for(file)) +
                     "set encoding utf8\nset grid\nunset key\n";
  if (structure.is_object()) text += "set ylabel font ',8'\nset ytics font ',8'\n";
  for (const Panel& panel : panels)
    for (const Curve& curve : panel.curves) text += "$" + curve.name + " << EOD\n" + curve.points + "EOD\n";
  text += "set lmargin 10\nset rmargin 3\nset xrange [0:" + in_full(end_s) + "]\n";
  text += "set autoscale y\nset offsets 0, 0, graph 0.05, graph 0.05\n";
  const std::size_t rows = structure.is_object() ? panels.size() + 3 : panels.size();
  text += "set multiplot layout " + std::to_string(rows) + ",1 title " + quoted(title) + "\n";
  for (const Panel& panel : panels) {
    text += "set ylabel " + quoted(panel.label) + "\nset xlabel " +
            (&panel == &panels.back() ? "'t, s'" : "''") + "\n" + panel.settings;
    std::string plots;
    for (const Curve& curve : panel.curves)
      plots += (plots.empty() ? "plot $" : ", $") + curve.name + ' ' + curve.style;
    text += plots + "\n";
  }
  if (structure.is_object())
    text += "set origin 0,0\nset size 1," + in_full(2.9 / static_cast<double>(rows)) + "\n" +
            shape_panel(structure.at("deflected_shape"));
  return text + "unset multiplot\n";
}

}  // namespace

void draw_run(const json& result, const json& series, const std::string& title, const std::string& file) {
  check_picture_name(file);
  if (series.at("t_s").size() < 2) throw Stop{kRunFailed, "there are not enough samples to draw"};
  run_gnuplot(script(result, series, title, file), file);
}

}  // namespace slew::ctl
